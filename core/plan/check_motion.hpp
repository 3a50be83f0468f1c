// This file checks the motion of a scene on a plan against the limits of the equations and of the period.
#pragma once

#include "core/plan/spec.hpp"

namespace freeflex {

/// Reports errors and warnings on the full plan of a scene. The faults are a spin that is too fast for the
/// rung, requests that the rung `rigid` ignores, feedback and followers that make a motion grow, and loads
/// that the ticks do not resolve. Call this function once per scene, even if several plans are compiled from
/// the scene.
void check_motion(const Scene& scene, const Structure& structure, const Plan& plan, Faults& faults);

}  // namespace freeflex
