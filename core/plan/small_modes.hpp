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
  double size = 0.0;  // [m] rms over all points, by mass, of what the others do under built-in loads, at most
  double horizon = 0.0;  // [s] over which built-in loads were followed
};

/// Leaves out as many modes as a tolerance allows, none at 0: a displacement changes by at most
/// sum |b_il| A_l under the built-in loads, A_l the largest swing of a mode left out, and by sum |b_il| s_l a
/// newton under commands, s_l = |Q_l| / (M omega_l^2)   (THEORY X123, X124).
/// \param plan  of the scene and structure, with all their modes; it is stepped over the horizon
SmallModes find_small_modes(const Scene& scene, const Structure& structure, const MotionScope& scope,
                            const Plan& plan, double tolerance);

}  // namespace freeflex
