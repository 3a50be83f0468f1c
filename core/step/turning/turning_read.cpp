// What is read of bodies that turn: displacements, velocities, momenta and energy.
#include <algorithm>

#include "core/step/coupled/stage.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/turning/turning.hpp"

namespace freeflex {

void place_body(const StepPlan& plan, const PlanTurningBody& body, const double* q,
                TurningMotion& at) noexcept {
  const std::size_t n = index(plan.num_padded);
  at.V = contract_rows(body.rows.data(), q, n);
  at.theta = contract_rows(body.rows.data() + 3 * n, q, n);
  const FiniteRotation turn = rotation_of(at.theta);
  at.R = matrix_of(turn.q);
  at.inverse_tangent = inverse_tangent_coefficient(at.theta, turn);
  at.line = line_of(plan, body);
  if (!is_zero(at.line)) at.roll_rate = dot(at.line, rate_with_roll(at, at.line));
}

namespace {

/// Sets v and s from q'.
void set_velocity(const StepPlan& plan, const PlanTurningBody& body, const double* q_dot, const Vec3& w,
                  TurningMotion& at) noexcept {
  const std::size_t n = index(plan.num_padded);
  at.v = add(cross(w, add(body.centre, at.V)), contract_rows(body.rows.data(), q_dot, n));
  // s = N^-1 theta' + R^T w, N^-1 = T(theta)^T   (THEORY 12.86)
  const Vec3 theta_dot = contract_rows(body.rows.data() + 3 * n, q_dot, n);
  const Vec3 relative = transposed_tangent(at.theta, tangent_of(at.theta, rotation_of(at.theta)), theta_dot);
  at.s = add(relative, multiply_transposed(at.R, w));
}

}  // namespace

// (THEORY 12.118)
Vec3 line_of(const StepPlan& plan, const PlanTurningBody& body) noexcept {
  const std::vector<std::int32_t>& points = plan.coupled.turning.points;
  // in scenes with spread mass there are no rods, but bodies without points
  if (has_spread_mass(plan)) return {};
  const Vec3 along = sub(plan.points[index(points[index(body.first + body.count - 1)])].r,
                         plan.points[index(points[index(body.first)])].r);
  return is_rod(body, along) ? scale(1.0 / length(along), along) : Vec3{};
}

Vec3 position_on_body(const PlanTurningBody& plan, const TurningMotion& body, const Vec3& r) noexcept {
  return add(add(plan.centre, body.V), multiply(body.R, sub(r, plan.centre)));
}

std::int32_t body_turned_too_far(const StepPlan& plan, std::span<const TurningMotion> bodies) noexcept {
  const double most = has_spread_mass(plan) ? kMostRotationWithSpreadMass : kMostRotationOfBody;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const double limit = is_zero(bodies[b].line) ? most : kMostRotationOfRod;
    if (dot(bodies[b].theta, bodies[b].theta) > limit * limit) return static_cast<std::int32_t>(b);
  }
  return -1;
}

bool has_frame(const StepPlan& plan, const Mat3& A) noexcept {
  constexpr double kFastest = 10.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Vec3 unit{};
    unit[axis] = 1.0;
    const Vec3 alpha = solve_for_spin(plan, A, multiply(plan.inertia, unit));
    if (!(dot(alpha, alpha) <= kFastest * kFastest)) return false;
  }
  return true;
}

TurningMotion read_turning(const StepPlan& plan, const PlanTurningBody& body, const double* q,
                           const double* q_dot, const Vec3& w) noexcept {
  TurningMotion at;
  place_body(plan, body, q, at);
  set_velocity(plan, body, q_dot, w, at);
  return at;
}

void place_bodies(const StepPlan& plan, const double* q, std::span<Vec3> V,
                  std::span<TurningMotion> bodies) noexcept {
  const PlanTurning& turning = plan.coupled.turning;
  for (std::size_t b = 0; b < turning.bodies.size(); ++b) {
    const PlanTurningBody& body = turning.bodies[b];
    TurningMotion& at = bodies[b];
    place_body(plan, body, q, at);
    for (std::int32_t k = body.first; k < body.first + body.count; ++k) {
      const std::size_t i = index(turning.points[index(k)]);
      if (index(turning.of_points[i]) != b) continue;  // a ball joint, whose point is on another body
      V[i] = sub(position_on_body(body, at, plan.points[i].r), plan.points[i].r);
    }
  }
}

Vec3 momenta_of_turning(const StepPlan& plan, std::span<const double> wheels, const Vec3& w_B,
                        const double* q, const double* q_dot, double* p) noexcept {
  const std::size_t n = index(plan.num_padded);
  const PlanTurning& turning = plan.coupled.turning;
  Vec3 H{};
  std::copy_n(q_dot, n, p);
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    if (!is_free(plan, i)) continue;
    const double m = plan.points[i].mass;
    const double* rows = point_rows(plan, plan.points[i].row);
    const Vec3 V = contract_rows(rows, q, n), x = add(plan.points[i].r, V);
    H = add_scaled(H, m, cross(x, add(cross(w_B, x), contract_rows(rows, q_dot, n))));
    combine_rows(rows, scale(m / plan.mass, cross(w_B, V)), true, n, p);
  }
  for (const PlanTurningBody& body : turning.bodies) {
    const TurningMotion at = read_turning(plan, body, q, q_dot, w_B);
    const double *of_centre = body.rows.data(), *of_rotation = of_centre + 3 * n;
    const Vec3 theta_dot = contract_rows(of_rotation, q_dot, n), Js = multiply(body.inertia, at.s);
    H = add_scaled(H, body.mass, cross(add(body.centre, at.V), at.v));
    H = add(H, multiply(at.R, Js));
    const Vec3 beyond = sub(Js, multiply(body.inertia, add(w_B, theta_dot)));
    combine_rows(of_centre, scale(body.mass / plan.mass, cross(w_B, at.V)), true, n, p);
    combine_rows(of_rotation, scale(1.0 / plan.mass, beyond), true, n, p);
  }
  return add(H, wheel_momentum_in_frame(plan, wheels, q));
}

Vec3 wheel_momentum_in_frame(const StepPlan& plan, std::span<const double> momentum,
                             const double* q) noexcept {
  Vec3 sum{};
  for (std::size_t k = 0; k < plan.wheels.size(); ++k) {
    const PlanWheel& wheel = plan.wheels[k];
    const PlanTurning& turning = plan.coupled.turning;
    TurningMotion at;
    place_body(plan, turning.bodies[index(turning.of_attitudes[index(wheel.attitude_index)])], q, at);
    sum = add_scaled(sum, momentum[k], multiply(at.R, wheel.axis));
  }
  return sum;
}

double kinetic_energy_of_turning(const StepPlan& plan, const Vec3& w_B, const double* q,
                                 const double* q_dot) noexcept {
  const std::size_t n = index(plan.num_padded);
  double twice = 0.0;
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    if (!is_free(plan, i)) continue;
    const double* rows = point_rows(plan, plan.points[i].row);
    const Vec3 x = add(plan.points[i].r, contract_rows(rows, q, n));
    const Vec3 v = add(cross(w_B, x), contract_rows(rows, q_dot, n));
    twice += plan.points[i].mass * dot(v, v);
  }
  for (const PlanTurningBody& body : plan.coupled.turning.bodies) {
    const TurningMotion at = read_turning(plan, body, q, q_dot, w_B);
    twice += body.mass * dot(at.v, at.v) + dot(at.s, multiply(body.inertia, at.s));
  }
  return 0.5 * twice;
}

}  // namespace freeflex
