#include "core/step/coupled/tables.hpp"

#include <algorithm>

#include "core/step/linear/kernels.hpp"

namespace freeflex {

Symmetric sum_tables(const StepPlan& plan, const StageState& stage, CoupledWorkspace& w) noexcept {
  const std::size_t n = index(plan.num_padded);
  const PlanKinetics& kinetics = plan.coupled.kinetics;
  const std::size_t block = index(kinetics.num_tables) * n;
  sum_rows(kinetics.tables.data(), block, stage.q, index(plan.num_moving), block, w.sums.data());
  std::copy_n(w.sums.begin(), 3 * n, w.C.begin());
  if (has_body_tables(plan)) combine_one(w.sums.data() + 9 * n, 1.0, true, 3 * n, w.C.data());
  Symmetric P{};
  for (std::size_t k = 0; k < 6; ++k)
    P[k] = 2.0 * dot_lanes(kinetics.moments.data() + k * n, stage.q, n) +
           dot_lanes(w.sums.data() + (3 + k) * n, stage.q, n);
  return P;
}

Symmetric rates_by_tables(const StepPlan& plan, const Vec3& w_B, const Symmetric& gradient,
                          CoupledWorkspace& w) noexcept {
  const std::size_t n = index(plan.num_padded), count = index(plan.num_moving);
  const PlanKinetics& kinetics = plan.coupled.kinetics;
  const std::size_t block = index(kinetics.num_tables) * n;
  const double *Y = kinetics.moments.data(), *Z = w.sums.data() + 3 * n;
  double *X_dot = w.sums_dot.data(), *G_dot = X_dot + 3 * n, *force = w.inertial.data();
  sum_rows(kinetics.tables.data(), block, w.q_dot.data(), count, 3 * n, X_dot);
  const Vec3 diagonal{w_B[1] * w_B[1] + w_B[2] * w_B[2] + gradient[0],
                      w_B[0] * w_B[0] + w_B[2] * w_B[2] + gradient[1],
                      w_B[0] * w_B[0] + w_B[1] * w_B[1] + gradient[2]};
  const Vec3 off{-2.0 * (w_B[0] * w_B[1] - gradient[3]), -2.0 * (w_B[0] * w_B[2] - gradient[4]),
                 -2.0 * (w_B[1] * w_B[2] - gradient[5])};
  combine_rows(Y, diagonal, false, n, force);
  combine_rows(Y + 3 * n, off, true, n, force);
  combine_rows(Z, diagonal, true, n, force);
  combine_rows(Z + 3 * n, off, true, n, force);
  combine_rows(X_dot, scale(-1.0, w_B), true, n, force);
  combine_rows(X_dot, w_B, false, n, w.C_dot_w.data());
  if (has_body_tables(plan)) {
    sum_rows(kinetics.tables.data() + 9 * n, block, w.q_dot.data(), count, 3 * n, G_dot);
    combine_rows(G_dot, w_B, true, n, force);
    combine_rows(G_dot, w_B, true, n, w.C_dot_w.data());
  }
  Symmetric P_dot{};
  for (std::size_t k = 0; k < 6; ++k)
    P_dot[k] = 2.0 * (dot_lanes(Y + k * n, w.q_dot.data(), n) + dot_lanes(Z + k * n, w.q_dot.data(), n));
  return P_dot;
}

}  // namespace freeflex
