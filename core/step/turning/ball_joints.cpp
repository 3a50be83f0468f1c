#include "core/step/turning/ball_joints.hpp"

#include <algorithm>
#include <limits>

#include "core/step/coupled/stage.hpp"
#include "core/step/linear/dense_lu.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/turning/turning.hpp"

namespace freeflex {
namespace {

constexpr int kMostClosings = 20;
constexpr double kClosed = 1e-15;   // [-] gap over the size, at which the iteration ends
constexpr double kMostGap = 1e-12;  // [-] largest gap over the size that rounding may leave
// [-] smallest pivot over the largest, which leaves 6 digits of a solution
constexpr double kNoPivot = 1e-10;
// [-] largest momenta of joints over those of the shape at rest. The rates of momenta grow with the square of
// this ratio, and the error of the step grows with the rates. With the limit 10, a four-bar linkage that
// reached it had an energy error of 1.5e-5 before it stopped.
constexpr double kFastest = 10.0;
constexpr double kAtStart = 1e-13;  // [-] gap over the size that needs no iteration at the start

/// Factors the matrix. Returns false if a pivot is too small.
bool factor_of_joints(BallJoints& s) noexcept { return factor_dense(s.matrix.data(), s.pivots) > kNoPivot; }
/// Replaces s.right by the solution.
void solve_of_joints(BallJoints& s) noexcept { solve_dense(s.matrix.data(), s.pivots, s.right.data()); }

const PlanTurningBody& body_at(const StepPlan& plan, std::int32_t b) noexcept {
  return plan.coupled.turning.bodies[index(b)];
}
Vec3 arm_of(const StepPlan& plan, const BallJoint& joint, std::size_t side) noexcept {
  return sub(plan.points[index(joint.point)].r, body_at(plan, joint.bodies[side]).centre);
}
/// Returns column l of three rows.
Vec3 column_of(const double* rows, std::size_t n, std::size_t l) noexcept {
  return {rows[l], rows[n + l], rows[2 * n + l]};
}

/// Sets s.right to the difference of a vector on both sides of each joint, and returns the largest one, that
/// of the joint s.widest. \param of_side  returns the vector for a joint and its side
template <typename OfSide>
double set_differences(BallJoints& s, const OfSide& of_side) noexcept {
  double square = 0.0;
  for (std::size_t j = 0; j < s.all.size(); ++j) {
    const Vec3 gap = sub(of_side(s.all[j], 0), of_side(s.all[j], 1));
    for (std::size_t a = 0; a < 3; ++a) s.right[3 * j + a] = gap[a];
    const double own_square = dot(gap, gap);
    if (own_square <= square) continue;  // false if the gap is NaN, so that NaN is returned
    square = own_square, s.widest = static_cast<std::int32_t>(j);
  }
  return __builtin_sqrt(square);
}
/// Sets the matrix to the derivatives of the gaps by the coordinates of the joints:
///   b_c + R ((A theta) x d) on each side
void set_gap_rates(const StepPlan& plan, std::span<const TurningMotion> bodies, BallJoints& s) noexcept {
  const std::size_t n = index(plan.num_padded), count = s.right.size();
  for (std::size_t j = 0; j < s.all.size(); ++j)
    for (std::size_t k = 0; k < count; ++k) {
      Vec3 gap{};
      for (std::size_t side = 0; side < 2; ++side) {
        const TurningMotion& at = bodies[index(s.all[j].bodies[side])];
        const double* rows = body_at(plan, s.all[j].bodies[side]).rows.data();
        const std::size_t l = index(plan.num_moving) + k;
        const Vec3 theta = column_of(rows + 3 * n, n, l);
        const Vec3 spin = transposed_tangent(at.theta, tangent_of(at.theta, rotation_of(at.theta)), theta);
        const Vec3 change =
            add(column_of(rows, n, l), multiply(at.R, cross(spin, arm_of(plan, s.all[j], side))));
        gap = add_scaled(gap, side == 0 ? 1.0 : -1.0, change);
      }
      for (std::size_t a = 0; a < 3; ++a) s.matrix[(3 * j + a) * count + k] = gap[a];
    }
}
bool factor_gaps(const StepPlan& plan, std::span<const TurningMotion> bodies, BallJoints& s) noexcept {
  set_gap_rates(plan, bodies, s);
  return factor_of_joints(s);
}

std::vector<TurningMotion> bodies_at_rest(const StepPlan& plan) {
  std::vector<TurningMotion> bodies(plan.coupled.turning.bodies.size());
  for (TurningMotion& at : bodies) at.R = matrix_of({1.0, 0.0, 0.0, 0.0});
  return bodies;
}

void set_places(const StepPlan& plan, const double* q, std::span<TurningMotion> bodies) noexcept {
  for (std::size_t b = 0; b < bodies.size(); ++b)
    place_body(plan, plan.coupled.turning.bodies[b], q, bodies[b]);
}
double set_gaps(const StepPlan& plan, std::span<const TurningMotion> bodies, BallJoints& s) noexcept {
  return set_differences(s, [&](const BallJoint& joint, std::size_t side) {
    const std::int32_t b = joint.bodies[side];
    return position_on_body(body_at(plan, b), bodies[index(b)], plan.points[index(joint.point)].r);
  });
}

/// Closes the joints by Newton's method. Returns false if they stay open. The bodies are those of the result.
bool close_all(const StepPlan& plan, double* q, std::span<TurningMotion> bodies, BallJoints& s) noexcept {
  double last = std::numeric_limits<double>::infinity();
  for (int k = 0; k <= kMostClosings; ++k) {
    set_places(plan, q, bodies);
    const double gap = set_gaps(plan, bodies, s);
    if (gap <= kClosed * s.size || (gap <= kMostGap * s.size && gap >= 0.5 * last)) return true;
    if (!(gap < std::numeric_limits<double>::infinity()) || !factor_gaps(plan, bodies, s)) return false;
    solve_of_joints(s);
    for (std::size_t i = 0; i < s.right.size(); ++i) q[index(plan.num_moving) + i] -= s.right[i];
    last = gap;
  }
  return false;
}

/// Returns the velocity of a joint on one side, relative to the axes of the frame at rest.
Vec3 side_velocity(const TurningMotion& at, const Vec3& v, const Vec3& s, const Vec3& arm) noexcept {
  return add(v, multiply(at.R, cross(s, arm)));
}

/// Returns whether the factored matrix defines the momenta of the joints: no gap rate of the shape at rest
/// needs momenta that are more than kFastest times as large.
bool has_momenta(BallJoints& s) noexcept {
  const std::size_t count = s.right.size();
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t i = 0; i < count; ++i) s.right[i] = s.at_rest[i * count + k];
    solve_of_joints(s);
    for (std::size_t i = 0; i < count; ++i)
      if (!(magnitude(s.right[i]) <= kFastest)) return false;
  }
  return true;
}

/// Returns J^-1 x. A rod has no part along its line.
Vec3 solve_inertia(const PlanTurningBody& body, const TurningMotion& at, const Vec3& x) noexcept {
  Mat3 J = body.inertia;
  const double trace = J[0] + J[4] + J[8];
  for (std::size_t a = 0; a < 9 && !is_zero(at.line); ++a) J[a] += trace * at.line[a / 3] * at.line[a % 3];
  const Vec3 across = is_zero(at.line) ? x : add_scaled(x, -dot(at.line, x), at.line);
  return solve_by_adjugate(J, across);
}

/// Returns the acceleration of a joint on one side without the forces of joints.
Vec3 side_acceleration(const StepPlan& plan, std::int32_t b, const Vec3& arm,
                       const CoupledWorkspace& w) noexcept {
  const PlanTurning& turning = plan.coupled.turning;
  const PlanTurningBody& body = body_at(plan, b);
  const TurningMotion& at = w.bodies[index(b)];
  const std::size_t n = index(plan.num_padded);
  Vec3 force = at.force;
  for (std::int32_t k = body.first; k < body.first + body.count; ++k)
    if (const std::size_t i = index(turning.points[index(k)]); turning.of_points[i] == b)
      force = add(force, w.linear[i]);
  const double* extra = w.ball_joints.mode_rate.data();
  const Vec3 a = add(scale(1.0 / body.mass, force), contract_rows(body.rows.data(), extra, n));
  const Vec3 momentum = add(multiply(body.inertia, at.s), at.wheels);
  const Vec3 free = solve_inertia(body, at, add(at.torque, cross(momentum, at.s)));
  const Vec3 s_dot = add(free, contract_rows(body.rows.data() + 3 * n, extra, n));
  return add(a, multiply(at.R, add(cross(s_dot, arm), cross(at.s, cross(at.s, arm)))));
}

/// Sets the matrix to the accelerations of the gaps by unit forces of the joints, and factors it.
bool factor_forces(const StepPlan& plan, CoupledWorkspace& w) noexcept {
  BallJoints& s = w.ball_joints;
  const std::size_t count = s.right.size();
  std::fill(s.matrix.begin(), s.matrix.end(), 0.0);
  for (std::size_t j = 0; j < s.all.size(); ++j)
    for (std::size_t k = 0; k < s.all.size(); ++k)
      for (std::size_t side = 0; side < 2; ++side)
        for (std::size_t other = 0; other < 2; ++other) {
          const std::int32_t b = s.all[j].bodies[side];
          if (s.all[k].bodies[other] != b) continue;
          const PlanTurningBody& body = body_at(plan, b);
          const TurningMotion& at = w.bodies[index(b)];
          for (std::size_t c = 0; c < 3; ++c) {
            Vec3 unit{};
            unit[c] = side == other ? 1.0 : -1.0;
            const Vec3 torque = cross(arm_of(plan, s.all[k], other), multiply_transposed(at.R, unit));
            const Vec3 spin = solve_inertia(body, at, torque);
            const Vec3 a =
                add(scale(1.0 / body.mass, unit), multiply(at.R, cross(spin, arm_of(plan, s.all[j], side))));
            for (std::size_t e = 0; e < 3; ++e) s.matrix[(3 * j + e) * count + 3 * k + c] += a[e];
          }
        }
  return factor_of_joints(s);
}

/// Sets Q of the joints to the generalized forces of all forces and torques on bodies, those of linear links
/// included. \pre add_joint_forces() has added the forces of joints to those of the bodies
void set_joint_loads(const StepPlan& plan, const CoupledWorkspace& w, double* Q) noexcept {
  const PlanTurning& turning = plan.coupled.turning;
  const std::size_t n = index(plan.num_padded), moving = index(plan.num_moving);
  std::fill(Q + moving, Q + n, 0.0);
  for (std::size_t b = 0; b < w.bodies.size(); ++b) {
    const PlanTurningBody& body = turning.bodies[b];
    Vec3 force = w.bodies[b].force;
    for (std::int32_t k = body.first; k < body.first + body.count; ++k)
      if (const std::size_t i = index(turning.points[index(k)]);
          turning.of_points[i] == static_cast<std::int32_t>(b))
        force = add(force, w.linear[i]);
    for (std::size_t l = moving; l < n; ++l)
      Q[l] += dot(column_of(body.rows.data(), n, l), force) +
              dot(column_of(body.rows.data() + 3 * n, n, l), w.bodies[b].torque);
  }
}

void set_not_a_number(double* from, double* to) noexcept {
  std::fill(from, to, std::numeric_limits<double>::quiet_NaN());
}

}  // namespace

std::vector<BallJoint> find_ball_joints(const StepPlan& plan) {
  std::vector<BallJoint> joints;
  const PlanTurning& turning = plan.coupled.turning;
  for (std::size_t b = 0; b < turning.bodies.size(); ++b)
    for (std::int32_t k = 0; k < turning.bodies[b].count; ++k) {
      const std::int32_t point = turning.points[index(turning.bodies[b].first + k)];
      const std::int32_t home = turning.of_points[index(point)], own = static_cast<std::int32_t>(b);
      if (home != own) joints.push_back({{home, own}, point});
    }
  return joints;
}

BallJoints make_ball_joints(const StepPlan& plan) {
  BallJoints s;
  s.all = find_ball_joints(plan);
  if (s.empty()) return s;
  for (const PlanPoint& point : plan.points) s.size = std::max(s.size, length(point.r));
  for (Array* each : {&s.q, &s.p, &s.mode_rate}) each->resize(index(plan.num_padded));
  const std::size_t count = 3 * s.all.size();
  s.matrix.resize(count * count);
  s.right.resize(count);
  s.pivots.resize(count);
  const std::vector<TurningMotion> at_rest = bodies_at_rest(plan);
  set_gap_rates(plan, at_rest, s);
  s.at_rest = s.matrix;
  return s;
}

void close_at_start(const StepPlan& plan, double* q, double* q_dot) {
  if (plan.num_padded == plan.num_moving || plan.coupled.turning.bodies.empty()) return;
  BallJoints s = make_ball_joints(plan);
  if (s.empty()) return;
  const std::size_t n = index(plan.num_padded), moving = index(plan.num_moving);
  std::vector<TurningMotion> bodies(plan.coupled.turning.bodies.size());
  set_places(plan, q, bodies);
  const bool is_closed = set_gaps(plan, bodies, s) <= kAtStart * s.size || close_all(plan, q, bodies, s);
  if (!is_closed || !factor_gaps(plan, bodies, s)) return set_not_a_number(q + moving, q + n);
  std::fill(q_dot + moving, q_dot + n, 0.0);
  set_differences(s, [&](const BallJoint& joint, std::size_t side) {
    const TurningMotion& at = bodies[index(joint.bodies[side])];
    const double* rows = body_at(plan, joint.bodies[side]).rows.data();
    const Vec3 rate = contract_rows(rows + 3 * n, q_dot, n);
    const Vec3 spin = transposed_tangent(at.theta, tangent_of(at.theta, rotation_of(at.theta)), rate);
    return side_velocity(at, contract_rows(rows, q_dot, n), spin, arm_of(plan, joint, side));
  });
  solve_of_joints(s);
  for (std::size_t i = 0; i < s.right.size(); ++i) q_dot[moving + i] = -s.right[i];
}

void close_joints(const StepPlan& plan, StageState& stage, CoupledWorkspace& w) noexcept {
  BallJoints& s = w.ball_joints;
  std::copy_n(stage.q, plan.num_moving, s.q.begin());
  std::copy_n(stage.p, plan.num_moving, s.p.begin());
  std::fill(s.p.begin() + plan.num_moving, s.p.end(), 0.0);
  stage.q = s.q.data(), stage.p = s.p.data();
  if (close_all(plan, s.q.data(), w.bodies, s)) return;
  s.is_open = true;
  set_not_a_number(s.p.data(), s.p.data() + s.p.size());
}

void add_joint_momenta(const StepPlan& plan, const Vec3& alpha, CoupledWorkspace& w) noexcept {
  BallJoints& s = w.ball_joints;
  const PlanTurning& turning = plan.coupled.turning;
  const std::size_t n = index(plan.num_padded), moving = index(plan.num_moving), count = s.right.size();
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t l = moving + k;
    // the rotation alpha that a unit momentum of a joint causes   (THEORY 12.87)
    Vec3 rest{};
    for (std::size_t b = 0; b < w.bodies.size(); ++b) {
      const PlanTurningBody& body = turning.bodies[b];
      const Vec3 JS = multiply(body.inertia, column_of(body.rows.data() + 3 * n, n, l));
      rest = sub(rest, scale(body.mass, cross(w.bodies[b].V, column_of(body.rows.data(), n, l))));
      rest = sub(rest, sub(multiply(w.bodies[b].R, JS), JS));
    }
    const Vec3 turn = solve_for_spin(plan, w.frame, rest);
    set_differences(s, [&](const BallJoint& joint, std::size_t side) {
      const PlanTurningBody& body = body_at(plan, joint.bodies[side]);
      const Vec3 v = add(column_of(body.rows.data(), n, l), cross(turn, body.centre));
      return side_velocity(w.bodies[index(joint.bodies[side])], v,
                           add(column_of(body.rows.data() + 3 * n, n, l), turn), arm_of(plan, joint, side));
    });
    for (std::size_t i = 0; i < count; ++i) s.matrix[i * count + k] = s.right[i];
  }
  const bool is_regular = factor_of_joints(s) && has_momenta(s);
  set_differences(s, [&](const BallJoint& joint, std::size_t side) {
    const TurningMotion& at = w.bodies[index(joint.bodies[side])];
    const Vec3 v = add(at.W, cross(alpha, body_at(plan, joint.bodies[side]).centre));
    return side_velocity(at, v, add(at.S, alpha), arm_of(plan, joint, side));
  });
  solve_of_joints(s);
  for (std::size_t i = 0; i < count; ++i) s.p[moving + i] = -s.right[i];
  if (!is_regular) {
    s.is_open = true;
    set_not_a_number(s.p.data() + moving, s.p.data() + n);
  }
  for (std::size_t b = 0; b < w.bodies.size(); ++b) {
    const double* rows = turning.bodies[b].rows.data();
    w.bodies[b].W = contract_rows(rows, s.p.data(), n);
    w.bodies[b].S = contract_rows(rows + 3 * n, s.p.data(), n);
  }
}

void add_joint_forces(const StepPlan& plan, CoupledWorkspace& w, StageRate& rate) noexcept {
  BallJoints& s = w.ball_joints;
  const std::size_t n = index(plan.num_padded), moving = index(plan.num_moving);
  // Subtract from the rate the part that forces on points and bodies cause. The rest comes from moments of
  // links on rotations (add_link_moments) and from loads that are given in modes (add_modal_loads).
  for (std::size_t l = 0; l < n; ++l) s.mode_rate[l] = l < moving ? rate.rate_p[l] - s.mode_rate[l] : 0.0;
  if (!factor_forces(plan, w)) {
    s.is_open = true;
    return set_not_a_number(rate.rate_p, rate.rate_p + n);
  }
  set_differences(s, [&](const BallJoint& joint, std::size_t side) {
    return side_acceleration(plan, joint.bodies[side], arm_of(plan, joint, side), w);
  });
  solve_of_joints(s);
  for (std::size_t j = 0; j < s.all.size(); ++j)
    for (std::size_t side = 0; side < 2; ++side) {
      const double sign = side == 0 ? -1.0 : 1.0;
      const Vec3 force{sign * s.right[3 * j], sign * s.right[3 * j + 1], sign * s.right[3 * j + 2]};
      const PlanTurningBody& body = body_at(plan, s.all[j].bodies[side]);
      TurningMotion& at = w.bodies[index(s.all[j].bodies[side])];
      const Vec3 torque = cross(arm_of(plan, s.all[j], side), multiply_transposed(at.R, force));
      at.force = add(at.force, force), at.torque = add(at.torque, torque);
      combine_rows(body.rows.data(), scale(1.0 / plan.mass, force), true, n, rate.rate_p);
      combine_rows(body.rows.data() + 3 * n, scale(1.0 / plan.mass, torque), true, n, rate.rate_p);
      if (rate.Q == nullptr) continue;
      combine_rows(body.rows.data(), force, true, n, rate.Q);
      combine_rows(body.rows.data() + 3 * n, torque, true, n, rate.Q);
      rate.balance_B = add(rate.balance_B, add(cross(body.centre, force), torque));
    }
  std::fill(rate.rate_p + moving, rate.rate_p + n, 0.0);
  if (rate.Q != nullptr) set_joint_loads(plan, w, rate.Q);
}

}  // namespace freeflex
