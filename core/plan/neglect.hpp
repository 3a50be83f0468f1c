// What a plan's rung neglects, in tables by which its motion is judged.
#pragma once

#include "core/plan/spec.hpp"

namespace freeflex {

/// Fills plan.neglect   (THEORY X140, X141).
/// \param whole  every mode of the structure: internal forces of those left out count too
/// \pre the plan has its modes
void compile_neglect(const Scene& scene, const Structure& whole, const PlanSpec& spec, Plan& plan);

}  // namespace freeflex
