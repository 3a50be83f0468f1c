// The stages of the coupled rungs if the modes are not a complete set for point masses, because there are
// rigid links, omitted modes or bodies (THEORY 12.33 to 12.51). The sums over the mass are computed point by
// point, or from the plan's tables over pairs of modes.
#include <algorithm>

#include "core/step/coupled/stage.hpp"
#include "core/step/coupled/tables.hpp"
#include "core/step/linear/kernels.hpp"

namespace freeflex {
namespace {

/// Adds s (a b^T + b a^T) to P.
void add_products(double s, const Vec3& a, const Vec3& b, Symmetric& P) noexcept {
  for (std::size_t k = 0; k < 3; ++k) P[k] += 2.0 * s * (a[k] * b[k]);
  P[3] += s * (a[0] * b[1] + a[1] * b[0]);
  P[4] += s * (a[0] * b[2] + a[2] * b[0]);
  P[5] += s * (a[1] * b[2] + a[2] * b[1]);
}

/// Returns the change of the second moment of the mass, P(q) - P(0), and computes C point by point:
///   C_l = sum_i m_i V_i x b_il   (THEORY 12.35),   and for each axis C_l,a = sum_i m_i b_il . (e_a x V_i)
/// (THEORY 12.36) The pass that computes the last row of C also projects the loads on points onto the modes,
/// into w.load.
Symmetric sum_points(const StepPlan& plan, CoupledWorkspace& w) noexcept {
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

/// Returns the resultant of the loads on points. Adds their moments to `rate` and, if the plan has tables,
/// their generalized forces to w.load.
Vec3 sum_point_loads(const StepPlan& plan, const StageState& stage, CoupledWorkspace& w,
                     StageRate& rate) noexcept {
  const std::size_t n = index(plan.num_padded);
  if (has_tables(plan.coupled.kinetics)) std::fill(w.load.begin(), w.load.end(), 0.0);
  Vec3 resultant{};
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const Vec3& force = w.force[i];
    if (is_zero(force)) continue;
    const PlanPoint& point = plan.points[i];
    const double* rows = point_rows(plan, point.row);
    const Vec3 V = has_tables(plan.coupled.kinetics) ? contract_rows(rows, stage.q, n) : w.V[i];
    if (has_tables(plan.coupled.kinetics)) combine_rows(rows, force, true, n, w.load.data());
    resultant = add(resultant, force);
    rate.rest_moment_B = add(rate.rest_moment_B, cross(point.r, force));
    rate.moment_B = add(rate.moment_B, cross(add(point.r, V), force));
  }
  return resultant;
}

/// Adds the loads on a body. The forces on its particles are summed to a force F at its centre of mass c and
/// a torque T:
///   Q_l += b_cl . F + theta_l . (T + (T x theta + (theta x d) x F + d x (F x theta)) / 2)   (THEORY 12.53)
///   L_B += (r_c + V_c) x F + T   (THEORY 12.54)
/// Here d is the vector from the point of the body to its centre.
void add_body_loads(const StepPlan& plan, const PlanBodyRotation& body, const StageState& stage,
                    CoupledWorkspace& w, StageRate& rate, Vec3& resultant) noexcept {
  const std::size_t n = index(plan.num_padded);
  Vec3 F{}, T{}, V{};
  for (std::int32_t k = body.first; k < body.first + body.count; ++k) {
    const Vec3& force = w.force[plan.points.size() + index(k)];
    const PlanPoint& particle = plan.particles.all[index(k)];
    const double* rows = point_rows(plan, particle.row);
    F = add(F, force);
    T = add(T, cross(sub(particle.r, body.centre), force));
    V = add_scaled(V, 1.0 / body.count, contract_rows(rows, stage.q, n));
    combine_rows(rows, force, true, n, w.load.data());
  }
  if (is_zero(F) && is_zero(T)) return;
  const Vec3 theta = contract_rows(body.rows.data(), stage.q, n), &d = body.offset;
  const Vec3 twice = add(cross(T, theta), add(cross(cross(theta, d), F), cross(d, cross(F, theta))));
  combine_rows(body.rows.data(), scale(0.5, twice), true, n, w.load.data());
  resultant = add(resultant, F);
  rate.rest_moment_B = add(rate.rest_moment_B, add(cross(body.centre, F), T));
  rate.moment_B = add(rate.moment_B, add(cross(add(body.centre, V), F), T));
}

void sum_loads(const StepPlan& plan, const StageState& stage, CoupledWorkspace& w, StageRate& rate) noexcept {
  Vec3 resultant = sum_point_loads(plan, stage, w, rate);
  for (const PlanBodyRotation& body : plan.coupled.kinetics.body_rotations)
    add_body_loads(plan, body, stage, w, rate, resultant);
  rate.force_W = multiply(stage.R_WB, resultant);
}

/// Adds torques T on bodies, including torques in local axes: Q_l += theta_l . (T + T x theta / 2), L_B += T
/// (THEORY 12.53, 12.54, 16.13, 16.14). Every plan with such torques has tables.
void add_torques(const StepLoads& step_loads, const StageState& stage, CoupledWorkspace& w,
                 StageRate& rate) noexcept {
  const StepPlan& plan = step_loads.plan;
  const std::size_t n = index(plan.num_padded);
  const auto add_one = [&](std::int32_t attitude_index, const Vec3& torque) {
    const double* rows = rotation_rows(plan, attitude_index);
    const Vec3 half = scale(0.5, cross(torque, contract_rows(rows, stage.q, n)));
    combine_rows(rows, add(torque, half), true, n, w.load.data());
    rate.moment_B = add(rate.moment_B, torque);
    rate.rest_moment_B = add(rate.rest_moment_B, torque);
  };
  const auto add_all = [&](const LoadSums& sums, double amplitude) {
    for (std::size_t k = 0; k < sums.torque_W.size(); ++k)
      if (!is_zero(sums.torque_W[k]) || !is_zero(sums.torque_B[k]))
        add_one(static_cast<std::int32_t>(k),
                scale(amplitude, add(multiply_transposed(stage.R_WB, sums.torque_W[k]), sums.torque_B[k])));
  };
  add_all(step_loads.commands(stage.stage_time).sums, 1.0);
  for (const PlanHistory& history : plan.histories) {
    const double amplitude = step_loads.amplitude(history, stage.stage_time);
    add_all(history.pattern.sums, amplitude);
    for (const PlanTorque& each : history.torques)
      add_one(each.attitude_index,
              scale(amplitude, cross(contract_rows(rotation_rows(plan, each.attitude_index), stage.q, n),
                                     each.torque_B)));
  }
}

/// Returns the rate P' of the second moment. Computes two sums over the points into w.inertial and w.C_dot_w:
///   dE_kin/dq_l = sum_i m_i b_il . ((V_i' + w x x_i) x w)   (THEORY 12.39)
///   w . C'_l = sum_i m_i b_il . (w x V_i')   (THEORY 12.40)
Symmetric rates_by_points(const StepPlan& plan, const Vec3& w_B, CoupledWorkspace& w) noexcept {
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

}  // namespace

// Q_l -= m theta_l . (d x (a x theta) + (theta x d) x a) / 2,   a = F / M   (THEORY 12.55)
void add_offset_loads(const StepPlan& plan, const StageState& stage, StageRate& rate) noexcept {
  if (plan.coupled.kinetics.offsets.empty() || is_zero(rate.force_W)) return;
  const std::size_t n = index(plan.num_padded);
  const Vec3 a = scale(1.0 / plan.mass, multiply_transposed(stage.R_WB, rate.force_W));
  for (const PlanOffset& body : plan.coupled.kinetics.offsets) {
    const Vec3 theta = contract_rows(body.rows.data(), stage.q, n), &d = body.offset;
    const Vec3 twice = add(cross(d, cross(a, theta)), cross(cross(theta, d), a));
    const Vec3 torque = scale(-0.5 * body.mass, twice);
    combine_rows(body.rows.data(), scale(1.0 / plan.mass, torque), true, n, rate.rate_p);
    if (rate.Q != nullptr) combine_rows(body.rows.data(), torque, true, n, rate.Q);
  }
}

namespace {

/// Returns the product C x.
/// \param x  (num_padded) one value for each elastic coordinate
Vec3 times_C(const CoupledWorkspace& w, const double* x, std::size_t n) noexcept {
  return contract_rows(w.C.data(), x, n);
}

/// Computes the accelerations w' and q''. With k_l = w . C'_l / M:
///   (I(q) - C C^T / M) w' = H_B' - I'(q) w - C' q' - C (p' - k)   (THEORY 12.41)
///   q'' = p' - k - C^T w' / M   (THEORY 12.42)
/// For a constraint shape l, sets Q_l to the load on the rigid links, Q_l + dE_kin/dq_l - w . C'_l - w' . C_l
/// (THEORY 12.44). If there are wheels, their momenta are subtracted from H_B and p, and the rates of their
/// momenta from H_B' and p'   (THEORY 16.29, 16.30).
void accelerate(const StepLoads& step_loads, const StageState& stage, const Mat3& matrix,
                const Symmetric& P_dot, CoupledWorkspace& w, StageRate& rate) noexcept {
  const StepPlan& plan = step_loads.plan;
  const std::size_t n = index(plan.num_padded), moving = index(plan.num_moving);
  double* const known = w.spare.data();  // q'' without the term of w'
  const double inverse_mass = 1.0 / plan.mass;
  std::fill(w.spare.begin(), w.spare.end(), 0.0);
  for (std::size_t l = 0; l < moving; ++l)
    known[l] = (rate.rate_p[l] - inverse_mass * w.C_dot_w[l]) -
               (plan.omega[l] * (plan.omega[l] * stage.q[l]) + 2.0 * plan.decay[l] * stage.p[l]);
  const Vec3& w_B = rate.w_B;
  Vec3 rest = sub(add(cross(stage.H_B, w_B), rate.moment_B), multiply(inertia_of(P_dot), w_B));
  if (!w.wheels.empty()) {
    std::fill(w.wheel_share.begin(), w.wheel_share.end(), 0.0);
    rest = sub(rest, add_wheel_rates(step_loads, stage, w.q_dot.data(), w.wheel_share.data()));
    for (std::size_t l = 0; l < n; ++l) rate.Q[l] += w.wheel_share[l];
    for (std::size_t l = 0; l < moving; ++l) known[l] += inverse_mass * w.wheel_share[l];
  }
  rest = sub(rest, times_C(w, known, n));
  if (has_body_tables(plan))
    rest = sub(rest, contract_rows(w.sums_dot.data() + 3 * n, w.q_dot.data(), n));  // C' q'
  rate.w_dot_B = solve_for_spin(plan, matrix, rest);
  combine_rows(w.C.data(), rate.w_dot_B, false, n, rate.q_ddot);
  for (std::size_t l = moving; l < n; ++l) rate.Q[l] += (w.inertial[l] - w.C_dot_w[l]) - rate.q_ddot[l];
  for (std::size_t l = 0; l < n; ++l)
    rate.q_ddot[l] = l < moving ? known[l] - inverse_mass * rate.q_ddot[l] : 0.0;
}

}  // namespace

void evaluate_incomplete(const StepLoads& step_loads, const StageState& stage, Workspace& workspace,
                         StageRate& rate) noexcept {
  const StepPlan& plan = step_loads.plan;
  CoupledWorkspace& w = workspace.coupled;
  const std::size_t n = index(plan.num_padded), moving = index(plan.num_moving);
  const double inverse_mass = 1.0 / plan.mass;
  gather_forces(step_loads, stage, w);
  if (!has_tables(plan.coupled.kinetics)) contract_points(plan, stage.q, stage.q, w.V, w.W);
  sum_loads(plan, stage, w, rate);
  // w = (I(q) - C C^T / M)^-1 (H_B - C p),   q' = p - C^T w / M   (THEORY 12.37, 12.38)
  const Symmetric P = has_tables(plan.coupled.kinetics) ? sum_tables(plan, stage, w) : sum_points(plan, w);
  if (!plan.particles.attitude_points.empty()) add_torques(step_loads, stage, w, rate);
  Mat3 J = inertia_of(P);
  for (std::size_t k = 0; k < 9; ++k) J[k] += plan.inertia[k];
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b <= a; ++b) {
      const double coupled = inverse_mass * dot_lanes(w.C.data() + a * n, w.C.data() + b * n, moving);
      J[3 * a + b] -= coupled;
      if (a != b) J[3 * b + a] -= coupled;
    }
  const Mat3 matrix = spin_matrix(plan, J);
  Vec3 H_B = stage.H_B;
  if (!w.wheels.empty()) {
    H_B = sub(H_B, rotated_wheel_momentum(plan, stage.wheels, stage.q));
    std::fill(w.wheel_share.begin(), w.wheel_share.end(), 0.0);
    add_wheel_momenta(plan, stage.wheels, stage.q, 1.0, w.wheel_share.data());
    std::fill(w.wheel_share.begin() + static_cast<std::ptrdiff_t>(moving), w.wheel_share.end(), 0.0);
    H_B = sub(H_B, times_C(w, w.wheel_share.data(), n));
  }
  rate.w_B = solve_for_spin(plan, matrix, sub(H_B, times_C(w, stage.p, n)));
  combine_rows(w.C.data(), scale(-inverse_mass, rate.w_B), false, n, rate.rate_q);
  for (std::size_t l = 0; l < w.wheel_share.size(); ++l) rate.rate_q[l] += w.wheel_share[l];
  std::fill(rate.rate_q + moving, rate.rate_q + n, 0.0);
  for (std::size_t l = 0; l < n; ++l) w.q_dot[l] = stage.p[l] + rate.rate_q[l];
  const Symmetric P_dot = has_tables(plan.coupled.kinetics) ? rates_by_tables(plan, rate.w_B, {}, w)
                                                            : rates_by_points(plan, rate.w_B, w);
  if (!w.wheels.empty()) add_wheel_forces(step_loads, stage, rate.w_B, w.q_dot.data(), w.load.data());
  for (std::size_t l = 0; l < n; ++l)
    rate.rate_p[l] = inverse_mass * (w.inertial[l] + w.load[l]) - 2.0 * plan.decay[l] * rate.rate_q[l];
  if (rate.Q != nullptr) std::copy_n(w.load.data(), n, rate.Q);
  add_modal_loads(step_loads, stage, workspace, rate);
  add_offset_loads(plan, stage, rate);
  std::fill(rate.rate_p + moving, rate.rate_p + n, 0.0);
  if (rate.Q != nullptr) accelerate(step_loads, stage, matrix, P_dot, w, rate);
}

// H_B = I(q) w + C q'   (THEORY 12.34),   p = q' + C^T w / M   (THEORY 12.33)
Vec3 momenta_by_tables(const StepPlan& plan, const Vec3& w_B, const double* q, const double* q_dot,
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
