#include "core/step/readout.hpp"

#include <algorithm>
#include <cassert>

#include "core/step/coupled/coupled.hpp"
#include "core/step/coupled/link_readout.hpp"
#include "core/step/coupled/stage.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/linear/modal_coupling.hpp"
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
  if (turns(plan)) return wheel_momentum_in_frame(plan, state.wheel_momentum, state.q.data());
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

namespace {

/// Returns the number of the turning body that holds a point; -1: none.
std::int32_t body_of(const StepPlan& plan, int point) noexcept {
  return turns(plan) ? plan.coupled.turning.of_points[index(point)] : -1;
}

/// Returns sum_l rows_l q_l''.
Vec3 second_rates(const StepPlan& plan, const MotionState& state, const double* rows) noexcept {
  Vec3 sum = contract_motion(rows, plan, state.q.data(), state.q_dot.data(), state.Q.data()).V_ddot;
  // coordinates of ball joints   (THEORY 12.123)
  const std::size_t n = index(plan.num_padded);
  for (std::size_t l = index(plan.num_moving); l < n; ++l)
    sum = add_scaled(sum, state.Q[l] / plan.mass, {rows[l], rows[n + l], rows[2 * n + l]});
  return sum;
}

/// A point at the arm d of a body has v = v_c + R (s x d) and a = a_c + R (s' x d + s x (s x d)). With
/// gamma = I^-1 sum r x F, a_c = gamma x r_c + sum_l b_cl q_l'' and s' = gamma + sum_l theta_l q_l''
/// + J^-1 ((J s + h) x s)   (THEORY 12.93).
FrameMotion read_turning_point(const StepPlan& plan, const MotionState& state, std::int32_t number,
                               const Vec3& r) noexcept {
  const PlanTurningBody& body = plan.coupled.turning.bodies[index(number)];
  const TurningMotion at =
      read_turning(plan, body, state.q.data(), state.q_dot.data(), angular_velocity(plan, state));
  if (has_spread_mass(plan)) {
    const auto [a_c, s_dot] = read_spread_rates(plan, state, body, at);
    const Vec3 d = sub(r, body.centre), sd = cross(at.s, d);
    const Vec3 x = position_on_body(body, at, r);
    return {x, add(at.v, multiply(at.R, sd)), add(a_c, multiply(at.R, add(cross(s_dot, d), cross(at.s, sd)))),
            sub(x, r)};
  }
  const Vec3 gamma = multiply(plan.inverse_inertia, state.coupled.balance_B);
  const Vec3 a_c = add(cross(gamma, body.centre), second_rates(plan, state, body.rows.data()));
  const Vec3 s_dot = read_body_rates(plan, state, number).s_dot;
  const Vec3 d = sub(r, body.centre), sd = cross(at.s, d);
  const Vec3 x = position_on_body(body, at, r);
  return {x, add(at.v, multiply(at.R, sd)), add(a_c, multiply(at.R, add(cross(s_dot, d), cross(at.s, sd)))),
          sub(x, r)};
}

}  // namespace

BodyRates read_body_rates(const StepPlan& plan, const MotionState& state, std::int32_t number) noexcept {
  const PlanTurningBody& body = plan.coupled.turning.bodies[index(number)];
  const Vec3 s =
      read_turning(plan, body, state.q.data(), state.q_dot.data(), angular_velocity(plan, state)).s;
  const Vec3 gamma = multiply(plan.inverse_inertia, state.coupled.balance_B);
  Vec3 momentum = multiply(body.inertia, s);
  for (std::size_t k = 0; k < plan.wheels.size(); ++k)
    if (plan.coupled.turning.of_attitudes[index(plan.wheels[k].attitude_index)] == number)
      momentum = add_scaled(momentum, state.wheel_momentum[k], plan.wheels[k].axis);
  // the roll of a rod has no equation, and moves nothing
  Mat3 inertia = body.inertia;
  const Vec3 line = line_of(plan, body);
  const double trace = inertia[0] + inertia[4] + inertia[8];
  for (std::size_t a = 0; a < 9 && !is_zero(line); ++a) inertia[a] += trace * line[a / 3] * line[a % 3];
  const Vec3 free = solve_by_adjugate(inertia, cross(momentum, s));
  return {s, add(add(gamma, free), second_rates(plan, state, body.rows.data() + 3 * index(plan.num_padded)))};
}

namespace {

/// Returns whether accelerations follow from the rates w' and q'' that the step computed.
bool has_rates_of_step(const StepPlan& plan) noexcept {
  return is_coupled(plan) && !is_complete(plan.coupled.kinetics);
}

/// Returns the elastic displacement V of a point, V', and the V'' of which its acceleration consists.
PointMotion elastic_motion(const StepPlan& plan, const MotionState& state, int point) noexcept {
  const double* const rows = rows_of(plan, point);
  PointMotion at = contract_motion(rows, plan, state.q.data(), state.q_dot.data(), state.Q.data());
  if (has_rates_of_step(plan)) at.V_ddot = contract(plan, rows, state.coupled.q_ddot);
  return at;
}

/// Returns whether elastic_motion() gives the motion of a point.
bool is_on_modes(const StepPlan& plan, const MotionState& state, int point) noexcept {
  return body_of(plan, point) < 0 && find_massless(state.coupled.massless, point) == nullptr;
}

/// Returns the motion of a point from its elastic motion.
FrameMotion in_frame(const StepPlan& plan, const MotionState& state, int point,
                     const PointMotion& elastic) noexcept {
  const Vec3 w = angular_velocity(plan, state);
  const auto& [V, V_dot, V_ddot] = elastic;
  const Vec3 x = add(plan.points[index(point)].r, V);
  const Vec3 wx = cross(w, x);
  // x = r + V (THEORY 2.13, 9.1). v_B and a_B are components in the rotating body axes   (THEORY 9.2).
  const Vec3 v_B = add(wx, V_dot);
  Vec3 a_B;
  if (has_rates_of_step(plan)) {
    // a = w' x x + w x (w x x) + 2 w x V' + V'', where w' and q'' were computed in the step   (THEORY 12.43)
    a_B = add(add(cross(state.coupled.w_dot_B, x), cross(w, wx)), add_scaled(V_ddot, 2.0, cross(w, V_dot)));
  } else if (is_coupled(plan)) {
    // the acceleration is the force on the point divided by its mass; its first term, sum_j F_j / M, is added
    // later   (THEORY 12.21):
    // a = sum_j F_j / M + (I^-1 sum_j r_j x F_j) x r + sum_l b_l q_l'',
    // q_l'' = Q_l / M - omega^2 q_l - 2 decay q_l'
    a_B = add(cross(multiply(plan.inverse_inertia, state.coupled.balance_B), plan.points[index(point)].r),
              V_ddot);
  } else {
    // w' = I^-1 (L_B - w x R_WB^T H_W) (THEORY 9.4), from which a follows (THEORY 9.3)
    const Vec3 H_B = multiply_transposed(rotation_matrix(state.q_WB), state.H_W);
    const Vec3 w_dot = multiply(plan.inverse_inertia, sub(state.moment_B, cross(w, H_B)));
    a_B = add(add(cross(w_dot, x), cross(w, wx)), add_scaled(V_ddot, 2.0, cross(w, V_dot)));
  }
  return {x, v_B, a_B, V};
}

/// Returns the motion of a point in world axes from that in the frame.
PointState in_world(const StepPlan& plan, const MotionState& state, const FrameMotion& at) noexcept {
  const Mat3 R = rotation_matrix(state.q_WB);
  const Vec3 a_WB = add_scaled(gravity_at(plan, state.p_WB), 1.0 / plan.mass, state.force_W);
  return {add(state.p_WB, multiply(R, at.x)), add(state.v_WB, multiply(R, at.v)),
          add(a_WB, multiply(R, at.a)), at.V};
}

}  // namespace

FrameMotion read_in_frame(const StepPlan& plan, const MotionState& state, int point) noexcept {
  if (const std::int32_t body = body_of(plan, point); body >= 0)
    return read_turning_point(plan, state, body, plan.points[index(point)].r);
  if (const MasslessMotion* at = find_massless(state.coupled.massless, point))
    return {add(plan.points[index(point)].r, at->V), at->v, at->a, at->V};
  return in_frame(plan, state, point, elastic_motion(plan, state, point));
}

PointState read_point(const StepPlan& given, const MotionState& state, int point) noexcept {
  assert(given.points[index(point)].row >= 0);
  const StepPlan& plan = active_plan(given, state);
  if (state.points.is_set) {
    const auto of = [&](const Array& all) {
      return std::array{of_point(all.data(), index(point)), of_point(all.data(), plan.points.size())};
    };
    const auto x = of(state.points.x), v = of(state.points.v), a = of(state.points.a);
    return {add(x[1], x[0]), add(v[1], v[0]), add(a[1], a[0]),
            sub(multiply_transposed(rotation_matrix(state.q_WB), x[0]), plan.points[index(point)].r)};
  }
  return in_world(plan, state, read_in_frame(plan, state, point));
}

PointsReader::PointsReader(const StepPlan& plan)
    : given_(plan),
      vectors_(3 * kMostStates *
               index(plan.fallback.empty() ? plan.num_padded : plan.fallback.front().num_padded)) {}

void PointsReader::read(std::span<const MotionState* const> states, std::span<const std::int32_t> points,
                        PointState* to) noexcept {
  assert(!states.empty() && states.size() <= kMostStates);
  if (states.front()->points.is_set) {
    for (const std::int32_t point : points)
      for (const MotionState* state : states) *to++ = read_point(given_, *state, point);
    return;
  }
  const StepPlan& plan = active_plan(given_, *states.front());
  const std::size_t n = index(plan.num_padded), num_moving = index(plan.num_moving);
  std::fill(vectors_.begin(), vectors_.end(), 0.0);
  for (std::size_t k = 0; k < states.size(); ++k) {
    const MotionState& state = *states[k];
    double* const x = vectors_.data() + 3 * k * n;
    std::copy_n(state.q.begin(), num_moving, x);
    std::copy_n(state.q_dot.begin(), num_moving, x + n);
    if (has_rates_of_step(plan))
      std::copy_n(state.coupled.q_ddot.begin(), n, x + 2 * n);
    else
      modal_accelerations(plan, state.q.data(), state.q_dot.data(), state.Q.data(), x + 2 * n);
  }
  std::array<Vec3, 3 * kMostStates> products;
  for (const std::int32_t point : points) {
    contract_vectors(rows_of(plan, point), n, n, vectors_.data(), 3 * states.size(), products.data());
    for (std::size_t k = 0; k < states.size(); ++k, ++to) {
      const MotionState& state = *states[k];
      *to = is_on_modes(plan, state, point)
                ? in_world(plan, state,
                           in_frame(plan, state, point,
                                    {products[3 * k], products[3 * k + 1], products[3 * k + 2]}))
                : read_point(given_, state, point);
    }
  }
}

BodyState read_body(const StepPlan& given, const MotionState& state, int point) noexcept {
  assert(attitude_index_of(given, point) >= 0);
  const StepPlan& plan = active_plan(given, state);
  if (const std::int32_t number = body_of(plan, point); number >= 0) {
    const TurningMotion at = read_turning(plan, plan.coupled.turning.bodies[index(number)], state.q.data(),
                                          state.q_dot.data(), angular_velocity(plan, state));
    return {multiply(state.q_WB, rotation_of(at.theta).q), at.s};
  }
  const double* rows = rotation_rows(plan, attitude_index_of(plan, point));
  const Vec3 g = scale(0.5, contract(plan, rows, state.q)),
             g_dot = scale(0.5, contract(plan, rows, state.q_dot));
  const double square = 1.0 + dot(g, g), norm = __builtin_sqrt(square);
  const Vec3 own = scale(2.0 / square, sub(g_dot, cross(g, g_dot)));
  const Vec3 of_frame = multiply_transposed(rotation_of_gibbs(g), angular_velocity(plan, state));
  return {multiply(state.q_WB, {1.0 / norm, g[0] / norm, g[1] / norm, g[2] / norm}), add(of_frame, own)};
}

namespace {

/// Holds the elastic displacement of a carrier of mass and its rate, body axes.
struct CarrierMotion {
  Vec3 V, V_dot;
};
CarrierMotion read_carrier(const StepPlan& plan, const MotionState& state, std::int32_t carrier) noexcept {
  const PlanPoint& point = mass_point(plan, carrier);
  std::int32_t body = -1;
  if (turns(plan)) {
    const std::size_t i = index(carrier), num_points = plan.points.size();
    body =
        i < num_points ? plan.coupled.turning.of_points[i] : plan.coupled.turning.of_carriers[i - num_points];
  }
  if (body < 0) {
    const double* rows = point_rows(plan, point.row);
    return {contract(plan, rows, state.q), contract(plan, rows, state.q_dot)};
  }
  const PlanTurningBody& given = plan.coupled.turning.bodies[index(body)];
  const Vec3 w = angular_velocity(plan, state);
  const TurningMotion at = read_turning(plan, given, state.q.data(), state.q_dot.data(), w);
  const Vec3 x = position_on_body(given, at, point.r);
  const Vec3 v = add(at.v, multiply(at.R, cross(at.s, sub(point.r, given.centre))));
  return {sub(x, point.r), sub(v, cross(w, x))};
}

/// Holds the rotation of a group relative to the frame, and its rate in body axes.
struct GroupRotation {
  Quat q;
  Vec3 w;
};
/// Returns the rotation that fits the points of a group best, sum_i m_i d_i x R^T y_i = 0 with y_i the
/// present arms, and its rate R ((tr S) 1 - S)^-1 sum_i m_i d_i x R^T y_i', S = sum_i m_i R^T y_i d_i^T
/// (THEORY 9.10).
GroupRotation fit_group(const StepPlan& plan, const MotionState& state, std::size_t number, const Vec3& shift,
                        const Vec3& shift_dot) noexcept {
  constexpr int kSweeps = 16;
  const PlanGroup& group = plan.groups[number];
  Quat q{1.0, 0.0, 0.0, 0.0};
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    const Mat3 R = matrix_of(q);
    Vec3 sum{}, rate{};
    Mat3 of_rate{};
    for (const std::int32_t i : carriers_of_group(plan, number)) {
      const PlanPoint& point = mass_point(plan, i);
      const CarrierMotion motion = read_carrier(plan, state, i);
      const Vec3 d = sub(point.r, group.centre);
      const Vec3 y = multiply_transposed(R, add(d, sub(motion.V, shift)));
      sum = add_scaled(sum, point.mass, cross(d, y));
      if (sweep + 1 < kSweeps) continue;
      rate = add_scaled(rate, point.mass, cross(d, multiply_transposed(R, sub(motion.V_dot, shift_dot))));
      const double both = dot(d, y);
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t b = 0; b < 3; ++b)
          of_rate[3 * a + b] += point.mass * ((a == b ? both : 0.0) - y[a] * d[b]);
    }
    if (sweep + 1 == kSweeps)
      return {q, multiply(R, group.torque_rank == 3 ? solve_by_adjugate(of_rate, rate)
                                                    : multiply(group.inverse_inertia, rate))};
    q = multiply(q, rotation_of(multiply(group.inverse_inertia, sum)).q);
  }
  return {q, {}};
}

}  // namespace

GroupPose read_group(const StepPlan& given, const MotionState& state, int group_index) noexcept {
  const StepPlan& plan = active_plan(given, state);
  const PlanGroup& group = plan.groups[index(group_index)];
  // mean elastic displacement and mean elastic rotation theta of the group, in body axes, and their rates
  // (THEORY 9.5, 9.6)
  Vec3 shift{}, shift_dot{}, theta{}, theta_dot{};
  for (const std::int32_t i : carriers_of_group(plan, index(group_index))) {
    const PlanPoint& point = mass_point(plan, i);
    const Vec3 d = sub(point.r, group.centre);
    const auto [V, V_dot] = read_carrier(plan, state, i);
    shift = add_scaled(shift, point.mass / group.mass, V);
    shift_dot = add_scaled(shift_dot, point.mass / group.mass, V_dot);
    theta = add_scaled(theta, point.mass, cross(d, V));
    theta_dot = add_scaled(theta_dot, point.mass, cross(d, V_dot));
  }
  const Mat3 R = rotation_matrix(state.q_WB);
  const Vec3 w = angular_velocity(plan, state);
  const Vec3 x = add(group.centre, shift);
  const Vec3 p_W = add(state.p_WB, multiply(R, x)),
             v_W = add(state.v_WB, multiply(R, add(cross(w, x), shift_dot)));
  if (traits_of(plan.fidelity).has_true_geometry && group.torque_rank > 0) {
    const GroupRotation fit = fit_group(plan, state, index(group_index), shift, shift_dot);
    return {p_W, multiply(state.q_WB, fit.q), v_W, add(w, fit.w)};
  }
  theta = multiply(group.inverse_inertia, theta);
  theta_dot = multiply(group.inverse_inertia, theta_dot);
  const Vec3 half = scale(0.5, theta);
  const double norm = __builtin_sqrt(1.0 + dot(half, half));
  const Quat q_WG = multiply(state.q_WB, {1.0 / norm, half[0] / norm, half[1] / norm, half[2] / norm});
  return {p_W, q_WG, v_W, add(w, theta_dot)};
}

Invariants read_invariants(const StepPlan& given, const MotionState& state) noexcept {
  const StepPlan& plan = active_plan(given, state);
  const std::size_t n = index(plan.num_padded);
  Invariants invariants;
  const Mat3 R_WB = rotation_matrix(state.q_WB);
  Vec3 H_B = multiply_transposed(R_WB, state.H_W);
  const FieldStiffness field =
      stiffen_by_fields(plan, R_WB, H_B, state.wheel_momentum, state.p_WB, state.q.data(), nullptr);
  if (!plan.wheels.empty()) H_B = sub(H_B, wheel_momentum_B(plan, state));
  const Vec3 w = sub(angular_velocity(plan, state), field.w_B);
  invariants.kinetic_rigid = 0.5 * (plan.mass * dot(state.v_WB, state.v_WB) + dot(H_B, w));
  invariants.kinetic_elastic = 0.5 * plan.mass * dot_lanes(state.q_dot.data(), state.q_dot.data(), n);
  invariants.potential = 0.5 * plan.mass * dot_squares(plan.omega.data(), state.q.data(), n) + field.energy;
  if (is_coupled(plan)) {
    // 2 E = w . H_B + M sum_l q_l' p_l, in which H_B does not contain the momenta of wheels
    // (THEORY 12.4, 16.32). The energy of a bar at true length is s^2 / (2 D). The sum over modes already
    // contains its linear energy, so only the difference is added   (THEORY 12.17). With turning bodies, the
    // sum over points and bodies replaces the first equation   (THEORY 12.94)
    if (turns(plan) && !has_spread_mass(plan))
      invariants.kinetic_elastic =
          kinetic_energy_of_turning(plan, angular_velocity(plan, state), state.q.data(), state.q_dot.data()) -
          0.5 * dot(H_B, angular_velocity(plan, state));
    else
      invariants.kinetic_elastic =
          0.5 *
          (plan.mass * dot_lanes(state.q_dot.data(), state.coupled.momentum.data(), n) +
           (turns(plan) ? 0.0
                        : wheel_energy(plan, state.wheel_momentum, state.q.data(), state.q_dot.data())));
    if (traits_of(plan.fidelity).has_true_geometry)
      invariants.potential += strain_energy_beyond_linear(plan, state);
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
