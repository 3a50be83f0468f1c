// Sums over the mass from tables over pairs of modes   (THEORY 12.48 to 12.51).
#pragma once

#include <array>

#include "core/step/coupled/stage.hpp"

namespace freeflex {

/// Holds a symmetric matrix as xx, yy, zz, xy, xz, yz.
using Symmetric = std::array<double, 6>;

/// Returns the inertia (tr P) 1 - P of a mass whose second moment is P.
inline Mat3 inertia_of(const Symmetric& P) noexcept {
  return {P[1] + P[2], -P[3], -P[4], -P[3], P[0] + P[2], -P[5], -P[4], -P[5], P[0] + P[1]};
}

/// Returns whether the tables have the second-order displacements of bodies.
inline bool has_body_tables(const StepPlan& plan) noexcept {
  return plan.coupled.kinetics.num_tables == kBodyTables;
}

/// Returns P(q) - P(0) and computes C from tables. Does not project loads:
///   C_l = sum_k q_k (X_kl + G_kl),   P = P(0) + 2 sum_k q_k Y_k + sum_kl q_k q_l Z_kl   (THEORY 12.49)
Symmetric sum_tables(const StepPlan& plan, const StageState& stage, CoupledWorkspace& w) noexcept;

/// Returns P'. Computes the sums of rates_by_points from tables. With S = (w.w) 1 - w w^T, X'_l = sum_k q_k'
/// X_kl and G'_l = sum_k q_k' G_kl:
///   dE_kin/dq_l = S . (Y_l + sum_k q_k Z_kl) - w . (X'_l - G'_l)   (THEORY 12.50)
///   w . C'_l = w . (X'_l + G'_l)   (THEORY 12.51)
/// \param gradient  [1/s^2] added to S: the gradient of an attraction   (THEORY 12.113)
Symmetric rates_by_tables(const StepPlan& plan, const Vec3& w_B, const Symmetric& gradient,
                          CoupledWorkspace& w) noexcept;

}  // namespace freeflex
