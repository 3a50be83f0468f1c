// Modes whose share of what is asked for is below a tolerance, and what leaving them out may change.
#pragma once

#include <vector>

#include "core/plan/motion_scope.hpp"
#include "core/step/plan.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// Which modes to keep, and the account of the rest (part kSmallModes).
struct SmallModes {
  std::vector<int> kept;  // ascending
  PlanPart part;
  double horizon = 0.0;  // [s] over which built-in loads were followed
};

/// Leaves out as many modes as a tolerance allows   (THEORY X123, X124). 0: none.
/// \param plan  of the scene and structure, with all their modes; it is stepped over the horizon
SmallModes find_small_modes(const Scene& scene, const Structure& structure, const MotionScope& scope,
                            const Plan& plan, double tolerance);

}  // namespace freeflex
