// Compilation of the geometric stiffness due to loads and fields.
#pragma once

#include "core/plan.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// Sets the stiffness due to the fields of the spin and the attractor, on the rung `coupled`   (THEORY 8.49).
/// \pre plan.omega is filled
void compile_field_stiffening(const Structure& structure, StepPlan& plan);

/// Sets the stiffness due to the components of commands, on the rung `coupled`   (THEORY 8.49).
/// \pre the points, groups, wheels and rows of the plan are filled
void compile_command_stiffening(const Structure& structure, StepPlan& plan);

/// Returns the stiffness due to a built-in load, if it changes the frequency of any mode.
PlanStiffening load_stiffening(const Scene& scene, const Structure& structure, int load,
                               const StepPlan& plan);

}  // namespace freeflex
