// Choice of the modes that are small within a tolerance, and the error of omitting them
// (THEORY 14.6 to 14.15).
#pragma once

#include <vector>

#include "core/plan.hpp"
#include "core/plan/omit/motion_scope.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// Holds the modes to keep, and the report on the omitted ones (Feature::kSmallModes).
struct SmallModes {
  std::vector<int> kept;  // ascending
  PlanFeature feature;
  double horizon = 0.0;  // [s] time over which the plan was stepped under built-in loads
};

/// Omits as many modes as a tolerance allows. A tolerance of 0 keeps all modes. Under the built-in loads a
/// displacement changes by at most sum |b_il| A_l, where A_l is the peak amplitude of an omitted mode (THEORY
/// 14.6, 14.7). Under commands a displacement changes by at most sum |b_il| s_l per newton, where s_l = |Q_l|
/// / (M omega_l^2)   (THEORY 14.8, 14.9).
/// \param plan  The plan of the scene and structure, with all modes. The function steps this plan over the
/// horizon.
SmallModes find_small_modes(const Scene& scene, const Structure& structure, const MotionScope& scope,
                            const Plan& plan, double tolerance);

}  // namespace freeflex
