// Tables of the terms that the rung of a plan neglects, for the verdict on its motion.
#pragma once

#include "core/plan/spec.hpp"

namespace freeflex {

/// Fills plan.unmodelled   (THEORY X140, X141, X147).
/// \param whole  structure of the scene with all modes; the internal forces of omitted modes contribute too
/// \pre the modes of the plan are filled
void compile_unmodelled(const Scene& scene, const Structure& whole, const PlanSpec& spec, Plan& plan);

}  // namespace freeflex
