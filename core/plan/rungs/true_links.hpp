// Links at true geometry and their joints, for the rungs with true geometry.
#pragma once

#include "core/plan.hpp"
#include "core/plan/spec.hpp"

namespace freeflex {

/// Fills plan.coupled.links with the beams, plates and angle springs of a scene   (THEORY 12.60 to 12.76).
/// \pre the modes and points of the plan are filled; the scene has point masses only
void compile_true_links(const Scene& scene, const Structure& structure, StepPlan& plan);

}  // namespace freeflex
