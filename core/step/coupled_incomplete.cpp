// Stages of the coupled rungs where the modes are not a complete set of point masses: rigid links, modes left
// out, bodies (THEORY X190 to X195). Two ways to the same sums over the mass: point by point, or by tables
// over pairs of modes that the plan holds.
#include <algorithm>

#include "core/step/kernels.hpp"
#include "core/step/stage.hpp"

namespace freeflex {
namespace {

/// A symmetric matrix as xx, yy, zz, xy, xz, yz.
using Symmetric = std::array<double, 6>;

/// += s (a b^T + b a^T)
void add_products(double s, const Vec3& a, const Vec3& b, Symmetric& P) noexcept {
  for (std::size_t k = 0; k < 3; ++k) P[k] += 2.0 * s * (a[k] * b[k]);
  P[3] += s * (a[0] * b[1] + a[1] * b[0]);
  P[4] += s * (a[0] * b[2] + a[2] * b[0]);
  P[5] += s * (a[1] * b[2] + a[2] * b[1]);
}

/// (tr P) 1 - P, what a second moment is as an inertia
Mat3 inertia_of(const Symmetric& P) noexcept {
  return {P[1] + P[2], -P[3], -P[4], -P[3], P[0] + P[2], -P[5], -P[4], -P[5], P[0] + P[1]};
}

bool has_tables(const Plan& plan) noexcept {
  return plan.coupled.kinetics.form == PlanKinetics::Form::kTables;
}
bool has_body_tables(const Plan& plan) noexcept { return plan.coupled.kinetics.num_tables == kBodyTables; }

/// By points: the second moment's change P(q) - P(0), V, and C; loads are projected beside its last row.
/// C_l = sum m V x b_l, axis by axis sum m b_l . (e_a x V)
Symmetric sum_points(const Plan& plan, CoupledWorkspace& w) noexcept {
  const std::size_t n = index(plan.num_padded);
  Symmetric P{};
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const PlanPoint& point = plan.points[i];
    const Vec3& V = w.V[i];
    const double m = point.mass;
    add_products(m, add_scaled(point.r, 0.5, V), V, P);
    w.drift[i] = {0.0, -m * V[2], m * V[1]};
    w.arms[i] = {m * V[2], 0.0, -m * V[0]};
  }
  project_all_points(plan, w.drift, w.arms, w.C.data(), w.C.data() + n);
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const double m = plan.points[i].mass;
    w.drift[i] = {-m * w.V[i][1], m * w.V[i][0], 0.0};
  }
  project_all_points(plan, w.drift, w.force, w.C.data() + 2 * n, w.load.data());
  return P;
}

/// By tables: the same without loads   (X194).
Symmetric sum_tables(const Plan& plan, const Place& place, CoupledWorkspace& w) noexcept {
  const std::size_t n = index(plan.num_padded);
  const PlanKinetics& kinetics = plan.coupled.kinetics;
  const std::size_t block = index(kinetics.num_tables) * n;
  sum_rows(kinetics.tables.data(), block, place.q, index(plan.num_moving), block, w.sums.data());
  std::copy_n(w.sums.begin(), 3 * n, w.C.begin());
  if (has_body_tables(plan)) combine_one(w.sums.data() + 9 * n, 1.0, true, 3 * n, w.C.data());
  Symmetric P{};
  for (std::size_t k = 0; k < 6; ++k)
    P[k] = 2.0 * dot_lanes(kinetics.moments.data() + k * n, place.q, n) +
           dot_lanes(w.sums.data() + (3 + k) * n, place.q, n);
  return P;
}

/// Resultant, moments and, by tables, generalized forces of the loads on points.
Vec3 sum_point_loads(const Plan& plan, const Place& place, CoupledWorkspace& w, Gain& gain) noexcept {
  const std::size_t n = index(plan.num_padded);
  if (has_tables(plan)) std::fill(w.load.begin(), w.load.end(), 0.0);
  Vec3 resultant{};
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const Vec3& force = w.force[i];
    if (is_zero(force)) continue;
    const PlanPoint& point = plan.points[i];
    const double* rows = point_rows(plan, point.row);
    const Vec3 V = has_tables(plan) ? contract_rows(rows, place.q, n) : w.V[i];
    if (has_tables(plan)) combine_rows(rows, force, true, n, w.load.data());
    resultant = add(resultant, force);
    gain.rest_moment_B = add(gain.rest_moment_B, cross(point.r, force));
    gain.moment_B = add(gain.moment_B, cross(add(point.r, V), force));
  }
  return resultant;
}

/// Those on a body, force F at its centre and torque T, both gathered from its particles   (X197):
///   Q_l += b_l . F + theta_l . (T + (T x theta + (theta x d) x F + d x (F x theta)) / 2)
void add_turning_loads(const Plan& plan, const PlanTurn& turn, const Place& place, CoupledWorkspace& w,
                       Gain& gain, Vec3& resultant) noexcept {
  const std::size_t n = index(plan.num_padded);
  Vec3 F{}, T{}, V{};
  for (std::int32_t k = turn.first; k < turn.first + turn.count; ++k) {
    const Vec3& force = w.force[plan.points.size() + index(k)];
    const PlanPoint& part = plan.particles.all[index(k)];
    const double* rows = point_rows(plan, part.row);
    F = add(F, force);
    T = add(T, cross(sub(part.r, turn.centre), force));
    V = add_scaled(V, 1.0 / turn.count, contract_rows(rows, place.q, n));
    combine_rows(rows, force, true, n, w.load.data());
  }
  if (is_zero(F) && is_zero(T)) return;
  const Vec3 theta = contract_rows(turn.rows.data(), place.q, n), &d = turn.offset;
  const Vec3 twice = add(cross(T, theta), add(cross(cross(theta, d), F), cross(d, cross(F, theta))));
  combine_rows(turn.rows.data(), scale(0.5, twice), true, n, w.load.data());
  resultant = add(resultant, F);
  gain.rest_moment_B = add(gain.rest_moment_B, add(cross(turn.centre, F), T));
  gain.moment_B = add(gain.moment_B, add(cross(add(turn.centre, V), F), T));
}

void sum_loads(const Plan& plan, const Place& place, CoupledWorkspace& w, Gain& gain) noexcept {
  Vec3 resultant = sum_point_loads(plan, place, w, gain);
  for (const PlanTurn& turn : plan.coupled.kinetics.turns)
    add_turning_loads(plan, turn, place, w, gain, resultant);
  gain.force_W = multiply(place.R_WB, resultant);
}

/// Torques on bodies, those that follow turned with them: Q_l += theta_l . T, with T to first order of the
/// turn (X165). Every plan that has them has tables.
void add_torques(const External& external, const Place& place, CoupledWorkspace& w, Gain& gain) noexcept {
  const Plan& plan = external.plan;
  const std::size_t n = index(plan.num_padded);
  const auto add_one = [&](std::int32_t turning, const Vec3& torque) {
    const double* rows = turn_rows(plan, turning);
    const Vec3 half = scale(0.5, cross(torque, contract_rows(rows, place.q, n)));  // as in X197
    combine_rows(rows, add(torque, half), true, n, w.load.data());
    gain.moment_B = add(gain.moment_B, torque);
    gain.rest_moment_B = add(gain.rest_moment_B, torque);
  };
  const auto add_all = [&](const TorqueSums& sums, double amplitude) {
    for (std::size_t k = 0; k < sums.W.size(); ++k)
      if (!is_zero(sums.W[k]) || !is_zero(sums.B[k]))
        add_one(static_cast<std::int32_t>(k),
                scale(amplitude, add(multiply_transposed(place.R_WB, sums.W[k]), sums.B[k])));
  };
  add_all(external.commands.sums.torque, 1.0);
  for (const PlanHistory& history : plan.histories) {
    const double amplitude = external.amplitude(history, place.instant);
    add_all(history.pattern.sums.torque, amplitude);
    for (const PlanTorque& each : history.torques.all)
      add_one(each.turning, scale(amplitude, cross(contract_rows(turn_rows(plan, each.turning), place.q, n),
                                                   each.torque_B)));
  }
}

/// dT/dq_l = sum m b_l . ((V' + w x x) x w), w . C'_l = sum m b_l . (w x V'), and the second moment's rate
/// P'.
Symmetric move_points(const Plan& plan, const Vec3& w_B, CoupledWorkspace& w) noexcept {
  contract_points(plan, w.q_dot.data(), w.q_dot.data(), w.W, w.arms);
  Symmetric P_dot{};
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const PlanPoint& point = plan.points[i];
    const Vec3 x = add(point.r, w.V[i]), &V_dot = w.W[i];
    add_products(point.mass, x, V_dot, P_dot);
    w.drift[i] = scale(point.mass, cross(add(V_dot, cross(w_B, x)), w_B));
    w.arms[i] = scale(point.mass, cross(w_B, V_dot));
  }
  project_all_points(plan, w.drift, w.arms, w.inertial.data(), w.C_dot_w.data());
  return P_dot;
}

/// The same by tables: S . (Y + Z q) - w . X' + w . G', w . (X' + G')   (X195).
Symmetric move_tables(const Plan& plan, const Vec3& w_B, CoupledWorkspace& w) noexcept {
  const std::size_t n = index(plan.num_padded), count = index(plan.num_moving);
  const PlanKinetics& kinetics = plan.coupled.kinetics;
  const std::size_t block = index(kinetics.num_tables) * n;
  const double *Y = kinetics.moments.data(), *Z = w.sums.data() + 3 * n;
  double *X_dot = w.sums_dot.data(), *G_dot = X_dot + 3 * n, *force = w.inertial.data();
  sum_rows(kinetics.tables.data(), block, w.q_dot.data(), count, 3 * n, X_dot);
  const Vec3 diagonal{w_B[1] * w_B[1] + w_B[2] * w_B[2], w_B[0] * w_B[0] + w_B[2] * w_B[2],
                      w_B[0] * w_B[0] + w_B[1] * w_B[1]};
  const Vec3 off{-2.0 * w_B[0] * w_B[1], -2.0 * w_B[0] * w_B[2], -2.0 * w_B[1] * w_B[2]};
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

}  // namespace

/// Q_l -= m theta_l . (d x (a x theta) + (theta x d) x a) / 2, a = F / M   (X198)
void add_offset_loads(const Plan& plan, const Place& place, Gain& gain) noexcept {
  if (plan.coupled.kinetics.offsets.empty() || is_zero(gain.force_W)) return;
  const std::size_t n = index(plan.num_padded);
  const Vec3 a = scale(1.0 / plan.mass, multiply_transposed(place.R_WB, gain.force_W));
  for (const PlanOffset& body : plan.coupled.kinetics.offsets) {
    const Vec3 theta = contract_rows(body.rows.data(), place.q, n), &d = body.offset;
    const Vec3 twice = add(cross(d, cross(a, theta)), cross(cross(theta, d), a));
    const Vec3 torque = scale(-0.5 * body.mass, twice);
    combine_rows(body.rows.data(), scale(1.0 / plan.mass, torque), true, n, gain.rate_p);
    if (gain.Q != nullptr) combine_rows(body.rows.data(), torque, true, n, gain.Q);
  }
}

namespace {

/// C times what is a number a mode.
Vec3 times_C(const CoupledWorkspace& w, const double* x, std::size_t n) noexcept {
  return contract_rows(w.C.data(), x, n);
}

/// Accelerations (X193), and in Q what is left of the loads on constraint shapes when the points accelerate.
void accelerate(const External& external, const Place& place, const Mat3& matrix, const Symmetric& P_dot,
                CoupledWorkspace& w, Gain& gain) noexcept {
  const Plan& plan = external.plan;
  const std::size_t n = index(plan.num_padded), moving = index(plan.num_moving);
  double* const known = w.spare.data();  // q'' but for w'
  const double inverse_mass = 1.0 / plan.mass;
  std::fill(w.spare.begin(), w.spare.end(), 0.0);
  for (std::size_t l = 0; l < moving; ++l)
    known[l] = (gain.rate_p[l] - inverse_mass * w.C_dot_w[l]) -
               (plan.omega[l] * (plan.omega[l] * place.q[l]) + 2.0 * plan.decay[l] * place.p[l]);
  const Vec3& w_B = gain.w_B;
  Vec3 rest = sub(add(cross(place.H_B, w_B), gain.moment_B), multiply(inertia_of(P_dot), w_B));
  if (!w.wheels.empty()) {
    std::fill(w.wheel_share.begin(), w.wheel_share.end(), 0.0);
    rest = sub(rest, add_wheel_rates(external, place, w.q_dot.data(), w.wheel_share.data()));
    for (std::size_t l = 0; l < n; ++l) gain.Q[l] += w.wheel_share[l];
    for (std::size_t l = 0; l < moving; ++l) known[l] += inverse_mass * w.wheel_share[l];
  }
  rest = sub(rest, times_C(w, known, n));
  if (has_body_tables(plan))
    rest = sub(rest, contract_rows(w.sums_dot.data() + 3 * n, w.q_dot.data(), n));  // C' q'
  gain.w_dot_B = solve_turning(plan, matrix, rest);
  combine_rows(w.C.data(), gain.w_dot_B, false, n, gain.q_ddot);
  for (std::size_t l = moving; l < n; ++l) gain.Q[l] += (w.inertial[l] - w.C_dot_w[l]) - gain.q_ddot[l];
  for (std::size_t l = 0; l < n; ++l)
    gain.q_ddot[l] = l < moving ? known[l] - inverse_mass * gain.q_ddot[l] : 0.0;
}

}  // namespace

void evaluate_incomplete(const External& external, const Place& place, Workspace& workspace,
                         Gain& gain) noexcept {
  const Plan& plan = external.plan;
  CoupledWorkspace& w = workspace.coupled;
  const std::size_t n = index(plan.num_padded), moving = index(plan.num_moving);
  const double inverse_mass = 1.0 / plan.mass;
  gather_forces(external, place, w);
  if (!has_tables(plan)) contract_points(plan, place.q, place.q, w.V, w.W);
  sum_loads(plan, place, w, gain);
  // w = (I(q) - C C^T / M)^-1 (H - C p),   q' = p - C^T w / M   (X192)
  const Symmetric P = has_tables(plan) ? sum_tables(plan, place, w) : sum_points(plan, w);
  if (!plan.particles.turning.empty()) add_torques(external, place, w, gain);
  Mat3 J = inertia_of(P);
  for (std::size_t k = 0; k < 9; ++k) J[k] += plan.inertia[k];
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b <= a; ++b) {
      const double carried = inverse_mass * dot_lanes(w.C.data() + a * n, w.C.data() + b * n, moving);
      J[3 * a + b] -= carried;
      if (a != b) J[3 * b + a] -= carried;
    }
  const Mat3 matrix = turning_matrix(plan, J);
  Vec3 H_B = place.H_B;
  if (!w.wheels.empty()) {
    H_B = sub(H_B, turned_wheel_momentum(plan, place.wheels, place.q));
    std::fill(w.wheel_share.begin(), w.wheel_share.end(), 0.0);
    add_wheel_momenta(plan, place.wheels, place.q, 1.0, w.wheel_share.data());
    std::fill(w.wheel_share.begin() + static_cast<std::ptrdiff_t>(moving), w.wheel_share.end(), 0.0);
    H_B = sub(H_B, times_C(w, w.wheel_share.data(), n));
  }
  gain.w_B = solve_turning(plan, matrix, sub(H_B, times_C(w, place.p, n)));
  combine_rows(w.C.data(), scale(-inverse_mass, gain.w_B), false, n, gain.rate_q);
  for (std::size_t l = 0; l < w.wheel_share.size(); ++l) gain.rate_q[l] += w.wheel_share[l];
  std::fill(gain.rate_q + moving, gain.rate_q + n, 0.0);
  for (std::size_t l = 0; l < n; ++l) w.q_dot[l] = place.p[l] + gain.rate_q[l];
  const Symmetric P_dot = has_tables(plan) ? move_tables(plan, gain.w_B, w) : move_points(plan, gain.w_B, w);
  if (!w.wheels.empty()) add_wheel_forces(external, place, gain.w_B, w.q_dot.data(), w.load.data());
  for (std::size_t l = 0; l < n; ++l)
    gain.rate_p[l] = inverse_mass * (w.inertial[l] + w.load[l]) - 2.0 * plan.decay[l] * gain.rate_q[l];
  if (gain.Q != nullptr) std::copy_n(w.load.data(), n, gain.Q);
  add_modal_loads(external, place, workspace, gain);
  add_offset_loads(plan, place, gain);
  std::fill(gain.rate_p + moving, gain.rate_p + n, 0.0);
  if (gain.Q != nullptr) accelerate(external, place, matrix, P_dot, w, gain);
}

Vec3 momenta_by_tables(const Plan& plan, const Vec3& w_B, const double* q, const double* q_dot,
                       double* p) noexcept {
  const std::size_t n = index(plan.num_padded);
  const PlanKinetics& kinetics = plan.coupled.kinetics;
  const bool has_bodies = has_body_tables(plan);
  Symmetric P{};
  for (std::size_t k = 0; k < 6; ++k) P[k] = 2.0 * dot_lanes(kinetics.moments.data() + k * n, q, n);
  Vec3 H{};
  for (std::size_t l = 0; l < index(plan.num_elastic); ++l) {
    const double* X = kinetics.tables.data() + l * index(kinetics.num_tables) * n;
    H = add_scaled(H, q[l], contract_rows(X, q_dot, n));
    combine_rows(X, scale(q[l] / plan.mass, w_B), true, n, p);
    for (std::size_t k = 0; k < 6; ++k) P[k] += q[l] * dot_lanes(X + (3 + k) * n, q, n);
    if (!has_bodies) continue;
    H = add_scaled(H, q[l], contract_rows(X + 9 * n, q_dot, n));
    combine_rows(X + 9 * n, scale(q[l] / plan.mass, w_B), true, n, p);
  }
  Mat3 J = inertia_of(P);
  for (std::size_t k = 0; k < 9; ++k) J[k] += plan.inertia[k];
  return add(H, multiply(J, w_B));
}

}  // namespace freeflex
