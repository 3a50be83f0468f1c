// What the coupled rungs need of a plan (THEORY section 12).
#pragma once

#include "core/model/structure.hpp"
#include "core/step/plan.hpp"

namespace freeflex {

/// Fills plan.coupled but for what depends on the period. Errors: rigid links, acceleration feedback.
/// \pre modes, points and coupling of the plan stand; its rung is coupled or above
void compile_coupled(const Scene& scene, const Structure& structure, Plan& plan, Faults& faults);

/// PlanCoupled::functions for the plan's period.
void set_coupled_period(Plan& plan);

}  // namespace freeflex
