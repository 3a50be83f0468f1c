// Links at true geometry and their joints, for the rungs with true geometry.
#pragma once

#include "core/plan.hpp"
#include "core/plan/spec.hpp"
#include "core/structure/links/link_factor.hpp"

namespace freeflex {

/// Fills plan.coupled.links with the beams, plates, angle springs and matrices of a scene   (THEORY 12.60 to
/// 12.76, 12.102). Adds an error for a matrix that cannot turn as one piece.
/// \pre the modes and points of the plan are filled; the scene has point masses only
void compile_true_links(const Scene& scene, const Structure& structure, StepPlan& plan, Faults& faults);

/// Returns matrix link `number` of a scene without its ends   (THEORY 12.102). Adds an error if the link has
/// too many points, or if nothing determines how it turns about the line of its points.
PlanTrueMatrix true_matrix(const Scene& scene, const LinkFactor& factor, const Freedoms& freedoms, int number,
                           bool has_rotations, Faults& faults);

/// Returns angle spring `number` of a scene.
PlanTrueAngle true_angle(const Scene& scene, const LinkFactor& factor, int number, double stiffness);

}  // namespace freeflex
