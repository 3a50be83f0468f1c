// The bodies of a plan that turn as a whole, for the rungs with true geometry.
#pragma once

#include "core/plan.hpp"
#include "core/plan/spec.hpp"

namespace freeflex {

/// Fills plan.coupled.turning with the bodies of a scene (THEORY 12.84). Adds the errors of rigid_bodies().
/// \pre the modes, points, particles and attitudes of the plan are filled
void compile_large_rotations(const Scene& scene, const Structure& structure, StepPlan& plan, Faults& faults);

}  // namespace freeflex
