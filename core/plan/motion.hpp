// What is to be said of a scene's motion on a plan: where its equations or its period do not hold.
#pragma once

#include "core/plan/spec.hpp"

namespace freeflex {

/// Errors and warnings of a plan with everything in it: a spin too fast for its rung, what the rigid rung
/// leaves out, feedback that drives, loads that ticks do not resolve. Said once of a scene, whatever is
/// compiled of it later.
void check_motion(const Scene& scene, const Structure& structure, const Plan& plan, Faults& faults);

}  // namespace freeflex
