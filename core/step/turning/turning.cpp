#include "core/step/turning/turning.hpp"

#include <algorithm>

#include "core/step/coupled/coupled.hpp"
#include "core/step/coupled/stage.hpp"
#include "core/step/coupled/strain_damping.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/links/bar.hpp"
#include "core/step/loads/field.hpp"

namespace freeflex {
namespace {

/// Returns J N s, with N of (THEORY 12.86).
Vec3 rate_times_inertia(const PlanTurningBody& plan, const TurningMotion& body, const Vec3& s) noexcept {
  return multiply(plan.inertia, rate_of_rotation(body, s));
}

/// Adds m ((a . b) 1 - a b^T) to J.
void add_arms(double m, const Vec3& a, const Vec3& b, Mat3& J) noexcept {
  const double both = dot(a, b);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) J[3 * i + j] += m * ((i == j ? both : 0.0) - a[i] * b[j]);
}
void add_to(Mat3& J, const Mat3& K) noexcept {
  for (std::size_t k = 0; k < 9; ++k) J[k] += K[k];
}

/// Returns J N R^T.
Mat3 turned_inertia(const PlanTurningBody& plan, const TurningMotion& body) noexcept {
  Mat3 result{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 column = rate_times_inertia(plan, body, {body.R[3 * k], body.R[3 * k + 1], body.R[3 * k + 2]});
    for (std::size_t i = 0; i < 3; ++i) result[3 * i + k] = column[i];
  }
  return result;
}

/// Sets the momenta of wheels, in the axes of their bodies.
void set_wheels(const StepPlan& plan, std::span<const double> momentum,
                std::span<TurningMotion> bodies) noexcept {
  for (TurningMotion& body : bodies) body.wheels = {};
  for (std::size_t k = 0; k < plan.wheels.size(); ++k) {
    const PlanWheel& wheel = plan.wheels[k];
    TurningMotion& body = bodies[index(plan.coupled.turning.of_attitudes[index(wheel.attitude_index)])];
    body.wheels = add_scaled(body.wheels, momentum[k], wheel.axis);
  }
}

/// Returns the angular velocity w of the frame, and sets alpha:
///   H_B = (sum m ((x . r) 1 - r x^T) + sum R J) alpha + sum m V x W + sum ((R - 1) J S + R h)
///   (sum m ((r . x) 1 - x r^T) + sum J N R^T) w = I alpha + sum J (N - 1) s   (THEORY 12.87, 12.88)
/// Sets the spins of bodies, those of rods with their roll   (THEORY 12.118).
Vec3 frame_velocity(const StepPlan& plan, const Vec3& H_B, CoupledWorkspace& w, Vec3& alpha) noexcept {
  const PlanTurning& turning = plan.coupled.turning;
  Mat3 of_alpha{}, of_w{};
  Vec3 rest = H_B;
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    if (!is_free(plan, i)) continue;
    const double m = plan.points[i].mass;
    const Vec3 &r = plan.points[i].r, x = add(r, w.V[i]);
    add_arms(m, r, x, of_alpha);
    add_arms(m, x, r, of_w);
    rest = sub(rest, scale(m, cross(w.V[i], w.W[i])));
  }
  for (std::size_t b = 0; b < turning.bodies.size(); ++b) {
    const PlanTurningBody& body = turning.bodies[b];
    const TurningMotion& at = w.bodies[b];
    const Vec3 x = add(body.centre, at.V), JS = multiply(body.inertia, at.S);
    add_arms(body.mass, body.centre, x, of_alpha);
    add_arms(body.mass, x, body.centre, of_w);
    add_to(of_alpha, multiply(at.R, body.inertia));
    add_to(of_w, turned_inertia(body, at));
    rest = sub(rest, scale(body.mass, cross(at.V, at.W)));
    rest = sub(rest, sub(multiply(at.R, add(JS, at.wheels)), JS));
  }
  w.frame = spin_matrix(plan, of_alpha);
  alpha = solve_for_spin(plan, w.frame, rest);
  Vec3 right = multiply(plan.inertia, alpha);
  for (std::size_t b = 0; b < turning.bodies.size(); ++b) {
    TurningMotion& at = w.bodies[b];
    at.s = add(at.S, alpha);
    const Vec3 beyond = sub(rate_of_rotation(at, at.s), at.s);
    right = add(right, multiply(turning.bodies[b].inertia, beyond));
  }
  w.spin = spin_matrix(plan, of_w);
  const Vec3 w_B = solve_for_spin(plan, w.spin, right);
  for (TurningMotion& at : w.bodies) {
    if (is_zero(at.line)) continue;
    const Vec3 rate = rate_with_roll(at, sub(at.s, multiply_transposed(at.R, w_B)));
    at.s = add_scaled(at.s, -dot(at.line, rate) / at.roll_rate, at.line);
  }
  return w_B;
}

/// Sets the velocities of all points and centres of mass, v = W + alpha x r, in w.W and in the bodies
/// (THEORY 12.84).
void set_velocities(const StepPlan& plan, const Vec3& alpha, CoupledWorkspace& w) noexcept {
  const PlanTurning& turning = plan.coupled.turning;
  for (std::size_t b = 0; b < turning.bodies.size(); ++b)
    w.bodies[b].v = add(w.bodies[b].W, cross(alpha, turning.bodies[b].centre));
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    if (is_free(plan, i)) {
      w.W[i] = add(w.W[i], cross(alpha, plan.points[i].r));
      continue;
    }
    const auto b = index(turning.of_points[i]);
    const Vec3 arm = sub(plan.points[i].r, turning.bodies[b].centre);
    w.W[i] = add(w.bodies[b].v, multiply(w.bodies[b].R, cross(w.bodies[b].s, arm)));
  }
}

/// Adds the attraction at each point mass and body minus the attraction at the centre of mass, and the torque
/// of its gradient on each body   (THEORY 8.20, 8.21).
void attract_bodies(const StepPlan& plan, const StageState& stage, CoupledWorkspace& w) noexcept {
  const PlanTurning& turning = plan.coupled.turning;
  const Vec3 rho = multiply_transposed(stage.R_WB, sub(stage.p_WB, plan.attractor_W));
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    if (!is_free(plan, i)) continue;
    const Vec3 pull = tidal_acceleration(plan.attractor_mu, rho, add(plan.points[i].r, w.V[i]));
    w.force[i] = add_scaled(w.force[i], plan.points[i].mass, pull);
  }
  for (std::size_t b = 0; b < turning.bodies.size(); ++b) {
    const PlanTurningBody& body = turning.bodies[b];
    TurningMotion& at = w.bodies[b];
    const Vec3 x = add(body.centre, at.V);
    at.force = add_scaled(at.force, body.mass, tidal_acceleration(plan.attractor_mu, rho, x));
    const Vec3 to_body = add(rho, x), own = multiply_transposed(at.R, to_body);
    const double square = dot(to_body, to_body);
    const double factor = 3.0 * plan.attractor_mu / (square * square * __builtin_sqrt(square));
    at.torque = add_scaled(at.torque, factor, multiply(at.R, cross(own, multiply(body.inertia, own))));
  }
}

/// Adds the forces on the particles of bodies, and the torques on bodies, those in local axes included
/// (THEORY 12.90).
void load_bodies(const StepLoads& step_loads, const StageState& stage, CoupledWorkspace& w) noexcept {
  const StepPlan& plan = step_loads.plan;
  const PlanTurning& turning = plan.coupled.turning;
  for (std::size_t k = 0; k < plan.particles.all.size(); ++k) {
    const Vec3& force = w.force[plan.points.size() + k];
    if (is_zero(force) || turning.of_carriers[k] < 0) continue;
    const std::size_t b = index(turning.of_carriers[k]);
    TurningMotion& at = w.bodies[b];
    const Vec3 arm = multiply(at.R, sub(plan.particles.all[k].r, turning.bodies[b].centre));
    at.force = add(at.force, force);
    at.torque = add(at.torque, cross(arm, force));
  }
  const auto add_all = [&](const LoadSums& sums, double amplitude) {
    for (std::size_t k = 0; k < sums.torque_W.size(); ++k) {
      if (is_zero(sums.torque_W[k]) && is_zero(sums.torque_B[k])) continue;
      TurningMotion& at = w.bodies[index(turning.of_attitudes[k])];
      const Vec3 torque = add(multiply_transposed(stage.R_WB, sums.torque_W[k]), sums.torque_B[k]);
      at.torque = add_scaled(at.torque, amplitude, torque);
    }
  };
  add_all(step_loads.commands(stage.stage_time).sums, 1.0);
  for (const PlanHistory& history : plan.histories) {
    const double amplitude = step_loads.amplitude(history, stage.stage_time);
    add_all(history.pattern.sums, amplitude);
    for (const PlanTorque& each : history.torques) {
      TurningMotion& at = w.bodies[index(turning.of_attitudes[index(each.attitude_index)])];
      at.torque = add_scaled(at.torque, amplitude, sub(multiply(at.R, each.torque_B), each.torque_B));
    }
  }
}

/// Sets the resultant and the moments of the loads on points and bodies   (THEORY 12.12).
void sum_loads_on_bodies(const StepPlan& plan, const StageState& stage, const CoupledWorkspace& w,
                         StageRate& rate) noexcept {
  Vec3 force_B{};
  const auto add_force = [&](const Vec3& r, const Vec3& V, const Vec3& force) {
    force_B = add(force_B, force);
    rate.rest_moment_B = add(rate.rest_moment_B, cross(r, force));
    rate.moment_B = add(rate.moment_B, cross(add(r, V), force));
  };
  for (std::size_t i = 0; i < plan.points.size(); ++i) add_force(plan.points[i].r, w.V[i], w.force[i]);
  for (std::size_t k = 0; k < plan.particles.all.size(); ++k) {  // parts of links
    const PlanPoint& part = plan.particles.all[k];
    const Vec3& force = w.force[plan.points.size() + k];
    if (plan.coupled.turning.of_carriers[k] < 0 && !is_zero(force))
      add_force(part.r, contract_rows(point_rows(plan, part.row), stage.q, index(plan.num_padded)), force);
  }
  for (std::size_t b = 0; b < w.bodies.size(); ++b) {
    const TurningMotion& at = w.bodies[b];
    add_force(plan.coupled.turning.bodies[b].centre, at.V, at.force);
    rate.rest_moment_B = add(rate.rest_moment_B, at.torque);
    rate.moment_B = add(rate.moment_B, at.torque);
  }
  rate.force_W = multiply(stage.R_WB, force_B);
}

/// Returns the rate of the linear displacement of a point, rows q'.
Vec3 linear_rate(const StepPlan& plan, const CoupledWorkspace& w, const Vec3& w_B, std::size_t i) noexcept {
  if (is_free(plan, i)) return sub(w.W[i], cross(w_B, add(plan.points[i].r, w.V[i])));
  const std::size_t b = index(plan.coupled.turning.of_points[i]);
  const PlanTurningBody& body = plan.coupled.turning.bodies[b];
  const TurningMotion& at = w.bodies[b];
  const Vec3 theta_dot = rate_of_rotation(at, sub(at.s, multiply_transposed(at.R, w_B)));
  return add(sub(at.v, cross(w_B, add(body.centre, at.V))),
             cross(theta_dot, sub(plan.points[i].r, body.centre)));
}

/// Adds the forces of springs, bars and dashpots, and of the linear ones   (THEORY 12.17 to 12.19).
void add_true_bars(const StepPlan& plan, const Vec3& w_B, CoupledWorkspace& w) noexcept {
  for (const PlanBar& bar : plan.coupled.bars) {
    const std::size_t i = index(bar.first), j = index(bar.second);
    const auto along = [&](const Vec3& d) { return scale(dot(bar.direction, d), bar.direction); };
    const Vec3 d = sub(w.V[j], w.V[i]);
    Vec3 exact = add(bar_force(bar, d).excess, scale(bar.stiffness, along(d)));
    Vec3 linear = scale(bar.stiffness, along(sub(w.linear_V[j], w.linear_V[i])));
    if (bar.damping > 0.0) {
      const Vec3 x_dot = sub(w.W[j], w.W[i]), x = add_scaled(d, bar.length, bar.direction);
      const Vec3 d_dot = sub(x_dot, cross(w_B, x));
      exact = add(exact, add(damper_force(bar, d, d_dot).excess, scale(bar.damping, along(d_dot))));
      const Vec3 linear_d_dot = sub(linear_rate(plan, w, w_B, j), linear_rate(plan, w, w_B, i));
      linear = add(linear, scale(bar.damping, along(linear_d_dot)));
    }
    w.force[i] = add(w.force[i], exact), w.force[j] = sub(w.force[j], exact);
    w.linear[i] = add(w.linear[i], linear), w.linear[j] = sub(w.linear[j], linear);
  }
}

/// Adds sum r x F over points and bodies, and the torques on bodies. \pre w.drift has the forces on points
void add_balance(const StepPlan& plan, const CoupledWorkspace& w, StageRate& rate) noexcept {
  for (std::size_t i = 0; i < plan.points.size(); ++i)
    rate.balance_B = add(rate.balance_B, cross(plan.points[i].r, w.drift[i]));
  for (std::size_t b = 0; b < w.bodies.size(); ++b) {
    const Vec3& centre = plan.coupled.turning.bodies[b].centre;
    const Vec3 torque = sub(w.bodies[b].torque, w.bodies[b].linear_torque);
    rate.balance_B = add(rate.balance_B, add(cross(centre, w.bodies[b].force), torque));
  }
}

/// Sets the rates from the forces beyond the linear links   (THEORY 12.91, 12.92).
void set_rates(const StepPlan& plan, CoupledWorkspace& w, StageRate& rate) noexcept {
  const std::size_t n = index(plan.num_padded);
  const double inverse_mass = 1.0 / plan.mass;
  const Vec3& w_B = rate.w_B;
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    if (!is_free(plan, i)) {
      w.drift[i] = w.force[i] = {};
      continue;
    }
    const double share = plan.points[i].mass * inverse_mass;
    w.drift[i] = scale(share, cross(w.V[i], w_B));
    w.force[i] = add_scaled(scale(inverse_mass, sub(w.force[i], w.linear[i])), share, cross(w.W[i], w_B));
  }
  project_points(plan, w.drift, w.force, rate.rate_q, rate.rate_p);
  // ball joints are on bodies alone
  for (double* each : {rate.rate_q, rate.rate_p}) std::fill(each + plan.num_moving, each + n, 0.0);
  for (std::size_t b = 0; b < w.bodies.size(); ++b) {
    const PlanTurningBody& body = plan.coupled.turning.bodies[b];
    const TurningMotion& at = w.bodies[b];
    const double *of_centre = body.rows.data(), *of_rotation = of_centre + 3 * n;
    const Vec3 theta_dot = rate_of_rotation(at, sub(at.s, multiply_transposed(at.R, w_B)));
    const Vec3 beyond = multiply(body.inertia, add(sub(theta_dot, at.s), w_B));
    combine_rows(of_centre, scale(body.mass * inverse_mass, cross(at.V, w_B)), true, n, rate.rate_q);
    combine_rows(of_rotation, scale(inverse_mass, beyond), true, n, rate.rate_q);
    const Vec3 momentum = add(multiply(body.inertia, at.s), at.wheels);
    const Vec3 force = add_scaled(at.force, body.mass, cross(at.v, w_B));
    combine_rows(of_centre, scale(inverse_mass, force), true, n, rate.rate_p);
    const Vec3 torque = sub(at.torque, at.linear_torque);
    combine_rows(of_rotation, scale(inverse_mass, add(torque, cross(momentum, at.s))), true, n, rate.rate_p);
  }
  for (std::size_t l = 0; l < index(plan.num_moving); ++l)
    rate.rate_p[l] -= 2.0 * plan.decay[l] * rate.rate_q[l];
}

/// Sets rate.rate_q_dot without the part of rotations, which is small for stiff axial modes   (THEORY 12.83).
void set_drift_rate_of_bodies(const StepPlan& plan, const StageState& stage, CoupledWorkspace& w,
                              StageRate& rate) noexcept {
  const std::size_t n = index(plan.num_padded);
  const Vec3& w_B = rate.w_B;
  const Vec3 w_dot = solve_for_spin(plan, w.spin, add(cross(stage.H_B, w_B), rate.moment_B));
  const auto drift = [&](double m, const Vec3& r, const Vec3& V, const Vec3& v) {
    const Vec3 V_dot = sub(v, cross(w_B, add(r, V)));
    return scale(m / plan.mass, add(cross(V_dot, w_B), cross(V, w_dot)));
  };
  for (std::size_t i = 0; i < plan.points.size(); ++i)
    w.drift[i] = is_free(plan, i) ? drift(plan.points[i].mass, plan.points[i].r, w.V[i], w.W[i]) : Vec3{};
  project_points(plan, w.drift, w.drift, rate.rate_q_dot, w.Q.data());
  for (std::size_t b = 0; b < w.bodies.size(); ++b) {
    const PlanTurningBody& body = plan.coupled.turning.bodies[b];
    combine_rows(body.rows.data(), drift(body.mass, body.centre, w.bodies[b].V, w.bodies[b].v), true, n,
                 rate.rate_q_dot);
  }
}

/// Sets rate.rate_q_dot from the rate of C^T w   (THEORY 12.83, 12.109).
void set_drift_rate_of_spread(const StepPlan& plan, const StageState& stage, const CoupledWorkspace& w,
                              StageRate& rate) noexcept {
  const std::size_t n = index(plan.num_padded);
  const Vec3 w_dot = solve_for_spin(plan, w.spin, add(cross(stage.H_B, rate.w_B), rate.moment_B));
  combine_rows(w.C.data(), scale(-1.0 / plan.mass, w_dot), false, n, rate.rate_q_dot);
  combine_one(w.C_dot_w.data(), -1.0 / plan.mass, true, n, rate.rate_q_dot);
}

}  // namespace

void sum_body_forces(const StepPlan& plan, CoupledWorkspace& w) noexcept {
  const PlanTurning& turning = plan.coupled.turning;
  for (std::size_t b = 0; b < turning.bodies.size(); ++b) {
    const PlanTurningBody& body = turning.bodies[b];
    TurningMotion& at = w.bodies[b];
    Vec3 linear_torque = w.joints.linear_on_body[b];
    for (std::int32_t k = body.first; k < body.first + body.count; ++k) {
      const std::size_t i = index(turning.points[index(k)]);
      if (index(turning.of_points[i]) != b) continue;  // a ball joint, whose point is on another body
      const Vec3 arm = sub(plan.points[i].r, body.centre);
      at.force = add(at.force, sub(w.force[i], w.linear[i]));
      at.torque = add(at.torque, cross(multiply(at.R, arm), w.force[i]));
      linear_torque = add(linear_torque, cross(arm, w.linear[i]));
    }
    at.torque = add(multiply_transposed(at.R, at.torque), w.joints.on_body[b]);
    at.linear_torque = linear_torque;
  }
}

void add_body_forces(const StepPlan& plan, const CoupledWorkspace& w, double* Q) noexcept {
  const std::size_t n = index(plan.num_padded);
  for (std::size_t b = 0; b < w.bodies.size(); ++b) {
    const double* rows = plan.coupled.turning.bodies[b].rows.data();
    combine_rows(rows, w.bodies[b].force, true, n, Q);
    combine_rows(rows + 3 * n, sub(w.bodies[b].torque, w.bodies[b].linear_torque), true, n, Q);
  }
}

void evaluate_turning(const StepLoads& step_loads, const StageState& given, Workspace& workspace,
                      StageRate& rate) noexcept {
  const StepPlan& plan = step_loads.plan;
  CoupledWorkspace& w = workspace.coupled;
  const std::size_t n = index(plan.num_padded);
  const bool has_ball_joints = !w.ball_joints.empty();
  StageState stage = given;
  if (has_ball_joints) close_joints(plan, stage, w);
  contract_points(plan, stage.q, stage.p, w.V, w.W);
  std::copy(w.V.begin(), w.V.end(), w.linear_V.begin());
  place_bodies(plan, stage.q, w.V, w.bodies);
  set_wheels(plan, stage.wheels, w.bodies);
  for (std::size_t b = 0; b < w.bodies.size(); ++b) {
    TurningMotion& at = w.bodies[b];
    const double* rows = plan.coupled.turning.bodies[b].rows.data();
    at.W = contract_rows(rows, stage.p, n), at.S = contract_rows(rows + 3 * n, stage.p, n);
    at.force = at.torque = at.motors = {};
  }
  const bool is_spread = has_spread_mass(plan);
  if (is_spread) {
    set_spread_velocities(plan, stage, w, rate);
  } else {
    Vec3 alpha;
    rate.w_B = frame_velocity(plan, stage.H_B, w, alpha);
    if (has_ball_joints)
      add_joint_momenta(plan, alpha, w), rate.w_B = frame_velocity(plan, stage.H_B, w, alpha);
    set_velocities(plan, alpha, w);
  }
  load_massless(step_loads, stage, w);
  relax_links(plan, stage.q, w);
  gather_forces(step_loads, stage, w);
  load_bodies(step_loads, stage, w);
  if (plan.attractor_mu > 0.0 && !is_spread) attract_bodies(plan, stage, w);
  sum_loads_on_bodies(plan, stage, w, rate);
  std::fill(w.linear.begin(), w.linear.end(), Vec3{});
  add_true_bars(plan, rate.w_B, w);
  add_links(plan, w);
  sum_body_forces(plan, w);
  for (std::size_t k = 0; k < plan.wheels.size(); ++k) {
    const PlanWheel& wheel = plan.wheels[k];
    TurningMotion& at = w.bodies[index(plan.coupled.turning.of_attitudes[index(wheel.attitude_index)])];
    at.motors = add_scaled(at.motors, -step_loads.wheel_torque(k, stage.stage_time), wheel.axis);
  }
  for (TurningMotion& at : w.bodies) at.torque = add(at.torque, at.motors);
  if (is_spread) {
    set_spread_rates(plan, stage, w, rate);
    add_link_moments(plan, w, rate);
    if (rate.rate_q_dot != nullptr) set_drift_rate_of_spread(plan, stage, w, rate);
    add_modal_loads(step_loads, stage, workspace, rate);
    add_strain_damping(plan, stage, w, rate);
    if (rate.Q != nullptr) accelerate_spread(plan, stage, w, rate);
    return;
  }
  if (rate.Q != nullptr) {
    for (std::size_t i = 0; i < plan.points.size(); ++i)
      w.drift[i] = is_free(plan, i) ? sub(w.force[i], w.linear[i]) : Vec3{};
    project_points(plan, w.drift, w.drift, rate.Q, rate.rate_p);
    add_body_forces(plan, w, rate.Q);
    add_balance(plan, w, rate);
  }
  set_rates(plan, w, rate);
  if (has_ball_joints) std::copy_n(rate.rate_p, n, w.ball_joints.mode_rate.begin());
  add_link_moments(plan, w, rate);
  if (rate.rate_q_dot != nullptr) set_drift_rate_of_bodies(plan, stage, w, rate);
  add_modal_loads(step_loads, stage, workspace, rate);
  add_strain_damping(plan, stage, w, rate);
  if (has_ball_joints) add_joint_forces(plan, w, rate);
}

}  // namespace freeflex
