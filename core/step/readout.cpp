#include "core/step/readout.hpp"

#include <algorithm>
#include <cassert>

#include "core/step/coupled/coupled.hpp"
#include "core/step/coupled/stage.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/loads/field.hpp"
#include "core/step/vector.hpp"

namespace freeflex {
namespace {

const double* rows_of(const StepPlan& plan, std::int32_t point) noexcept {
  return point_rows(plan, plan.points[index(point)].row);
}

/// Returns the product of rows (3 x num_padded) with x.
Vec3 contract(const StepPlan& plan, const double* rows, const Array& x) noexcept {
  return contract_rows(rows, x.data(), index(plan.num_padded));
}

/// Returns V_second - V_first of a bar. If q' is passed instead of q, returns the rate of this difference.
Vec3 difference(const StepPlan& plan, const PlanBar& bar, const Array& q) noexcept {
  return sub(contract(plan, rows_of(plan, bar.second), q), contract(plan, rows_of(plan, bar.first), q));
}

/// Returns the bar at true length that belongs to a link, or nullptr if there is none.
const PlanBar* find_bar(const StepPlan& plan, std::int32_t link) noexcept {
  const auto& bars = plan.coupled.bars;
  const auto found =
      std::lower_bound(bars.begin(), bars.end(), link,
                       [](const PlanBar& bar, std::int32_t wanted) { return bar.link < wanted; });
  return found != bars.end() && found->link == link ? &*found : nullptr;
}

}  // namespace

Mat3 rotation_matrix(const Quat& q) noexcept {
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  const double xx = x * x, yy = y * y, zz = z * z;
  const double xy = x * y, xz = x * z, yz = y * z, wx = w * x, wy = w * y, wz = w * z;
  return {1.0 - 2.0 * (yy + zz), 2.0 * (xy - wz),       2.0 * (xz + wy),
          2.0 * (xy + wz),       1.0 - 2.0 * (xx + zz), 2.0 * (yz - wx),
          2.0 * (xz - wy),       2.0 * (yz + wx),       1.0 - 2.0 * (xx + yy)};
}

Vec3 wheel_momentum_B(const StepPlan& plan, const MotionState& state) noexcept {
  if (is_coupled(plan)) return rotated_wheel_momentum(plan, state.wheel_momentum, state.q.data());
  Vec3 h{};
  for (std::size_t k = 0; k < plan.wheels.size(); ++k)
    h = add_scaled(h, state.wheel_momentum[k], plan.wheels[k].axis);
  return h;
}

Vec3 angular_velocity(const StepPlan& plan, const MotionState& state) noexcept {
  if (is_coupled(plan)) return state.coupled.w_B;
  Vec3 H_B = multiply_transposed(rotation_matrix(state.q_WB), state.H_W);
  if (!plan.wheels.empty()) H_B = sub(H_B, wheel_momentum_B(plan, state));
  return multiply(plan.inverse_inertia, H_B);
}

PointState read_point(const StepPlan& given, const MotionState& state, int point) noexcept {
  assert(given.points[index(point)].row >= 0);
  const StepPlan& plan = active_plan(given, state);
  const Mat3 R = rotation_matrix(state.q_WB);
  const Vec3 w = angular_velocity(plan, state);
  const auto [V, V_dot, V_ddot] =
      contract_motion(rows_of(plan, point), plan, state.q.data(), state.q_dot.data(), state.Q.data());
  const Vec3 x = add(plan.points[index(point)].r, V);
  const Vec3 wx = cross(w, x);
  // x = r + V (THEORY 2.13, 9.1). v_B and a_B are components in the rotating body axes   (THEORY 9.2).
  const Vec3 v_B = add(wx, V_dot);
  Vec3 a_B;
  const bool is_complete = plan.coupled.kinetics.form == PlanKinetics::Form::kComplete;
  if (is_coupled(plan) && is_complete) {
    // the acceleration is the force on the point divided by its mass; its first term, sum_j F_j / M, is added
    // below   (THEORY 12.21):
    // a = sum_j F_j / M + (I^-1 sum_j r_j x F_j) x r + sum_l b_l q_l'',
    // q_l'' = Q_l / M - omega^2 q_l - 2 decay q_l'
    a_B = add(cross(multiply(plan.inverse_inertia, state.moment_B), plan.points[index(point)].r), V_ddot);
  } else if (is_coupled(plan)) {
    // a = w' x x + w x (w x x) + 2 w x V' + V'', where w' and q'' were computed in the step   (THEORY 12.43)
    const Vec3 V_ddot_of_step = contract(plan, rows_of(plan, point), state.coupled.q_ddot);
    a_B = add(add(cross(state.coupled.w_dot_B, x), cross(w, wx)),
              add_scaled(V_ddot_of_step, 2.0, cross(w, V_dot)));
  } else {
    // w' = I^-1 (L_B - w x R_WB^T H_W) (THEORY 9.4), from which a follows (THEORY 9.3)
    const Vec3 H_B = multiply_transposed(R, state.H_W);
    const Vec3 w_dot = multiply(plan.inverse_inertia, sub(state.moment_B, cross(w, H_B)));
    a_B = add(add(cross(w_dot, x), cross(w, wx)), add_scaled(V_ddot, 2.0, cross(w, V_dot)));
  }
  const Vec3 a_WB = add_scaled(gravity_at(plan, state.p_WB), 1.0 / plan.mass, state.force_W);
  return {add(state.p_WB, multiply(R, x)), add(state.v_WB, multiply(R, v_B)), add(a_WB, multiply(R, a_B)), V};
}

BodyState read_body(const StepPlan& given, const MotionState& state, int point) noexcept {
  assert(attitude_index_of(given, point) >= 0);
  const StepPlan& plan = active_plan(given, state);
  const double* rows = rotation_rows(plan, attitude_index_of(plan, point));
  const Vec3 g = scale(0.5, contract(plan, rows, state.q)),
             g_dot = scale(0.5, contract(plan, rows, state.q_dot));
  const double square = 1.0 + dot(g, g), norm = __builtin_sqrt(square);
  const Vec3 own = scale(2.0 / square, sub(g_dot, cross(g, g_dot)));
  const Vec3 of_frame = multiply_transposed(rotation_of_gibbs(g), angular_velocity(plan, state));
  return {multiply(state.q_WB, {1.0 / norm, g[0] / norm, g[1] / norm, g[2] / norm}), add(of_frame, own)};
}

GroupPose read_group(const StepPlan& given, const MotionState& state, int group_index) noexcept {
  const StepPlan& plan = active_plan(given, state);
  const PlanGroup& group = plan.groups[index(group_index)];
  // mean elastic displacement and mean elastic rotation theta of the group, in body axes, and their rates
  // (THEORY 9.5, 9.6)
  Vec3 shift{}, shift_dot{}, theta{}, theta_dot{};
  for (const std::int32_t i : carriers_of_group(plan, index(group_index))) {
    const PlanPoint& point = mass_point(plan, i);
    const Vec3 d = sub(point.r, group.centre);
    const Vec3 V = contract(plan, point_rows(plan, point.row), state.q);
    const Vec3 V_dot = contract(plan, point_rows(plan, point.row), state.q_dot);
    shift = add_scaled(shift, point.mass / group.mass, V);
    shift_dot = add_scaled(shift_dot, point.mass / group.mass, V_dot);
    theta = add_scaled(theta, point.mass, cross(d, V));
    theta_dot = add_scaled(theta_dot, point.mass, cross(d, V_dot));
  }
  theta = multiply(group.inverse_inertia, theta);
  theta_dot = multiply(group.inverse_inertia, theta_dot);
  const Mat3 R = rotation_matrix(state.q_WB);
  const Vec3 w = angular_velocity(plan, state);
  const Vec3 x = add(group.centre, shift);
  const Vec3 half = scale(0.5, theta);
  const double norm = __builtin_sqrt(1.0 + dot(half, half));
  const Quat q_WG = multiply(state.q_WB, {1.0 / norm, half[0] / norm, half[1] / norm, half[2] / norm});
  return {add(state.p_WB, multiply(R, x)), q_WG, add(state.v_WB, multiply(R, add(cross(w, x), shift_dot))),
          add(w, theta_dot)};
}

void read_link(const StepPlan& given, const MotionState& state, int output, std::span<double> out) noexcept {
  const StepPlan& plan = active_plan(given, state);
  const PlanLinkOutput& link = plan.link_outputs[index(output)];
  const std::size_t n = index(plan.num_padded);
  for (std::int32_t k = 0; k < link.num_rows; ++k)
    out[index(k)] = dot_lanes(plan.link_rows.data() + index(link.first_row + k) * n, state.q.data(), n);
  const auto add = [&](std::int32_t first, const Array& x) {
    for (std::int32_t k = 0; first >= 0 && k < link.num_rows; ++k)
      out[index(k)] += dot_lanes(plan.link_rows.data() + index(first + k) * n, x.data(), n);
  };
  const PlanBar* bar = find_bar(plan, link.link);
  if (bar != nullptr) {
    const Vec3 d = difference(plan, *bar, state.q);
    out[0] = bar_force(*bar, d).tension;
    if (bar->damping > 0.0) out[0] += damper_force(*bar, d, difference(plan, *bar, state.q_dot)).tension;
  } else {
    add(link.first_rate_row, state.q_dot);
  }
  add(link.first_load_row, state.Q);
}

Invariants read_invariants(const StepPlan& given, const MotionState& state) noexcept {
  const StepPlan& plan = active_plan(given, state);
  const std::size_t n = index(plan.num_padded);
  Invariants invariants;
  Vec3 H_B = multiply_transposed(rotation_matrix(state.q_WB), state.H_W);
  if (!plan.wheels.empty()) H_B = sub(H_B, wheel_momentum_B(plan, state));
  invariants.kinetic_rigid =
      0.5 * (plan.mass * dot(state.v_WB, state.v_WB) + dot(H_B, angular_velocity(plan, state)));
  invariants.kinetic_elastic = 0.5 * plan.mass * dot_lanes(state.q_dot.data(), state.q_dot.data(), n);
  invariants.potential = 0.5 * plan.mass * dot_squares(plan.omega.data(), state.q.data(), n);
  if (is_coupled(plan)) {
    // 2 E = w . H_B + M sum_l q_l' p_l, in which H_B does not contain the momenta of wheels
    // (THEORY 12.4, 16.32). The energy of a bar at true length is s^2 / (2 D). The sum over modes already
    // contains its linear energy, so only the difference is added   (THEORY 12.17)
    invariants.kinetic_elastic =
        0.5 * (plan.mass * dot_lanes(state.q_dot.data(), state.coupled.momentum.data(), n) +
               wheel_energy(plan, state.wheel_momentum, state.q.data(), state.q_dot.data()));
    for (const PlanBar& bar : plan.coupled.bars) {
      if (bar.stiffness == 0.0) continue;
      const Vec3 d = difference(plan, bar, state.q);
      const double tension = bar_force(bar, d).tension, linear = bar.stiffness * dot(bar.direction, d);
      invariants.potential += 0.5 * (tension - linear) * ((tension + linear) / bar.stiffness);
    }
  }
  invariants.linear_momentum_W = scale(plan.mass, state.v_WB);
  invariants.angular_momentum_W = state.H_W;
  invariants.eckart_translation = contract(plan, plan.eckart_rows.data(), state.q);
  invariants.eckart_rotation = contract(plan, plan.eckart_rows.data() + 3 * n, state.q);
  const Quat& q = state.q_WB;
  // |q| - 1 = (|q|^2 - 1) / (1 + |q|), which keeps the digits
  const double excess = (q[0] * q[0] - 1.0) + (q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  invariants.quaternion_norm_error = excess / (1.0 + __builtin_sqrt(1.0 + excess));
  return invariants;
}

}  // namespace freeflex
