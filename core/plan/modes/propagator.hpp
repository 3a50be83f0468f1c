// Exact propagator of one mode over one period, for a load that is linear in time within the period
// (THEORY 6.1 to 6.5).
#pragma once

#include "core/plan.hpp"

namespace freeflex {

/// Fills mode `index` of `propagator` for q'' + 2 decay q' + omega^2 q = Q / M (THEORY 4.22) over the period
/// h. The given doubles are taken as exact, and the computation uses 120 digits:
///   P_qq = 1 - (omega h)^2 S, P_qv = h g, P_vq = -(omega h)^2 g / h, P_vv = P_qq - 2 decay h g (THEORY 6.2)
///   w_q0 = h^2 S / M, w_q1 = h^2 R / M, w_v0 = h g / M, w_v1 = h S / M   (THEORY 6.3)
/// where g, S, R are those of UnitStep, which are nu_0, nu_1, nu_2 of (THEORY 6.4).
/// \pre omega >= 0, decay >= 0, period > 0, mass > 0
void set_mode(Propagator& propagator, int index, double omega, double decay, double period, double mass);

/// Replaces the lanes by lanes without damping. A lane without damping has only five sixths of the
/// coefficients, because P_vv = P_qq.
/// \pre no mode has decay
void drop_damping(Propagator& propagator);

/// Returns the rows of PlanCoupled::functions for one mode, computed with 120 digits: phi_k(h L) = mu_k 1 +
/// nu_k h L with L = [0, 1; -omega^2, -2 decay], mu_0 = 1 - (omega h)^2 nu_1, mu_k = nu_(k-1) + 2 decay h
/// nu_k (THEORY 12.14).
using ModeFunctions = std::array<double, std::size_t{PlanCoupled::kNumFunctions} * PlanCoupled::kNumEntries>;
ModeFunctions mode_functions(double omega, double decay, double period);

}  // namespace freeflex
