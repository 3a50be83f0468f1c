#include "core/step/stage.hpp"

#include <algorithm>
#include <cassert>

#include "core/step/coupled.hpp"
#include "core/step/field.hpp"
#include "core/step/history.hpp"
#include "core/step/mixing.hpp"
#include "core/step/readout.hpp"

namespace freeflex {
namespace {

/// Solves A x = b for a symmetric 3x3 matrix by its adjugate.
Vec3 solve(const Mat3& A, const Vec3& b) noexcept {
  const Vec3 x{A[0], A[1], A[2]}, y{A[3], A[4], A[5]}, z{A[6], A[7], A[8]};
  const Vec3 yz = cross(y, z), zx = cross(z, x), xy = cross(x, y);
  const double determinant = dot(x, yz);
  return scale(1.0 / determinant, add_scaled(add_scaled(scale(b[0], yz), b[1], zx), b[2], xy));
}

/// x less its part along a unit vector, or x when that is zero.
Vec3 across(const Vec3& line, const Vec3& x) noexcept { return add_scaled(x, -dot(line, x), line); }

/// The frame's angular velocity from angular momentum, displacements V and W = b p   (X92a, X92b):
///   J = I + sum m ((r.V) 1 - r V^T),   pi = sum m V x W,   alpha = J^-1 (H - pi),   w = J^-1 I alpha
Vec3 angular_velocity(const Plan& plan, const Vec3& H_B, const CoupledWorkspace& w, Vec3& alpha) noexcept {
  alpha = {};
  if (plan.rigid_freedoms == 3) return {};
  Mat3 J = plan.inertia;
  Vec3 pi{};
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const double m = plan.points[i].mass;
    const Vec3 &r = plan.points[i].r, mV = scale(m, w.V[i]);
    pi = add(pi, cross(mV, w.W[i]));
    const double arm = dot(r, mV);
    // symmetric by (2.6); the mean of both halves keeps it so in rounding
    const double xy = 0.5 * (r[0] * mV[1] + r[1] * mV[0]), xz = 0.5 * (r[0] * mV[2] + r[2] * mV[0]),
                 yz = 0.5 * (r[1] * mV[2] + r[2] * mV[1]);
    J[0] += arm - r[0] * mV[0], J[4] += arm - r[1] * mV[1], J[8] += arm - r[2] * mV[2];
    J[1] -= xy, J[3] -= xy, J[2] -= xz, J[6] -= xz, J[5] -= yz, J[7] -= yz;
  }
  const Mat3 matrix = turning_matrix(plan, J);
  alpha = solve_turning(plan, matrix, sub(H_B, pi));
  return solve_turning(plan, matrix, multiply(plan.inertia, alpha));
}

/// Adds what true lengths and directions change of the bars' forces   (X94), with
///   d' = W_j - W_i + (alpha - w) x l_0 e - w x d
void add_bars(const Plan& plan, const Vec3& alpha, const Vec3& w_B, CoupledWorkspace& w) noexcept {
  const Vec3 slip = sub(alpha, w_B);
  for (const PlanBar& bar : plan.coupled.bars) {
    const std::size_t i = index(bar.first), j = index(bar.second);
    const Vec3 d = sub(w.V[j], w.V[i]);
    Vec3 excess = bar_force(bar, d).excess;
    if (bar.damping > 0.0) {
      // z_j - z_i less what the body's spin gives it: rest arms turn with alpha, the deformed ones with w
      const Vec3 d_dot =
          sub(add(sub(w.W[j], w.W[i]), cross(slip, scale(bar.length, bar.direction))), cross(w_B, d));
      excess = add(excess, damper_force(bar, d, d_dot).excess);
    }
    w.force[i] = add(w.force[i], excess);
    w.force[j] = sub(w.force[j], excess);
  }
}

/// The point that has a block of rows. On coupled rungs every point has one, in the order of the points
/// (find_rung_inconsistency): the index of either is that of the other.
std::size_t point_of_row([[maybe_unused]] const Plan& plan, std::int32_t row) noexcept {
  assert(plan.points[index(row)].row == row);
  return index(row);
}

/// Resultant and moments of the loads on the points.
void sum_forces(const Plan& plan, const Place& place, const CoupledWorkspace& w, Gain& gain) noexcept {
  Vec3 force_B{};
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    if (is_zero(w.force[i])) continue;
    force_B = add(force_B, w.force[i]);
    gain.rest_moment_B = add(gain.rest_moment_B, cross(plan.points[i].r, w.force[i]));
    gain.moment_B = add(gain.moment_B, cross(add(plan.points[i].r, w.V[i]), w.force[i]));
  }
  gain.force_W = multiply(place.R_WB, force_B);
}

/// Adds the attractor's pull on each point where it is, less what it would be at the centre of mass   (X205):
///   m_i (g(rho + x) - g(rho)),   x = r + V
void add_field_of_points(const Plan& plan, const Place& place, CoupledWorkspace& w) noexcept {
  const Vec3 rho = multiply_transposed(place.R_WB, sub(place.p_WB, plan.attractor_W));
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const Vec3 pull = tide(plan.attractor_mu, rho, add(plan.points[i].r, w.V[i]));
    w.force[i] = add_scaled(w.force[i], plan.points[i].mass, pull);
  }
}

/// What the motion gains beside the modes' own linear motion   (X92c to X92f), z = W + alpha x r, u below:
///   rate_q = sum m b . (V x w) / M,   rate_p = -2 decay rate_q + (sum m b . (z x w) + Q) / M,
///   moment = sum (r + V) x F
void evaluate_complete(const External& external, const Place& place, Workspace& workspace,
                       Gain& gain) noexcept {
  const Plan& plan = external.plan;
  CoupledWorkspace& w = workspace.coupled;
  contract_points(plan, place.q, place.p, w.V, w.W);
  Vec3 alpha;
  gain.w_B = angular_velocity(plan, place.H_B, w, alpha);
  gather_forces(external, place, w);
  if (plan.attractor_mu > 0.0) add_field_of_points(plan, place, w);
  sum_forces(plan, place, w, gain);
  add_bars(plan, alpha, gain.w_B, w);
  if (gain.Q != nullptr) project_points(plan, w.force, w.force, gain.Q, gain.rate_p);
  const double inverse_mass = 1.0 / plan.mass;
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const double share = plan.points[i].mass * inverse_mass;
    const Vec3 u = add(w.W[i], cross(alpha, plan.points[i].r));
    w.drift[i] = scale(share, cross(w.V[i], gain.w_B));
    w.force[i] = add_scaled(scale(inverse_mass, w.force[i]), share, cross(u, gain.w_B));
  }
  project_points(plan, w.drift, w.force, gain.rate_q, gain.rate_p);
  const double* decay = plan.decay.data();
  for (std::size_t l = 0; l < index(plan.num_moving); ++l) gain.rate_p[l] -= 2.0 * decay[l] * gain.rate_q[l];
  add_modal_loads(external, place, workspace, gain);
}

}  // namespace

Mat3 turning_matrix(const Plan& plan, const Mat3& J) noexcept {
  if (plan.rigid_freedoms != 5) return J;
  const double trace = J[0] + J[4] + J[8];
  Mat3 P{};
  for (std::size_t a = 0; a < 3; ++a) {
    Vec3 unit{};
    unit[a] = 1.0;
    const Vec3 column = across(plan.line, multiply(J, across(plan.line, unit)));
    for (std::size_t b = 0; b < 3; ++b) P[3 * b + a] = column[b] + trace * plan.line[b] * plan.line[a];
  }
  return P;
}

Vec3 solve_turning(const Plan& plan, const Mat3& matrix, const Vec3& b) noexcept {
  if (plan.rigid_freedoms != 5) return solve(matrix, b);
  return across(plan.line, solve(matrix, across(plan.line, b)));
}

void gather_forces(const External& external, const Place& place, CoupledWorkspace& w) noexcept {
  const Plan& plan = external.plan;
  external.on_points(place.instant, place.R_WB, w.force);
  for (const PlanHistory& history : plan.histories)
    for (const PlanFollower& follower : history.followers) {
      const Vec3 theta = contract_rows(follower.turn_rows.data(), place.q, index(plan.num_padded));
      Vec3& force = w.force[point_of_row(plan, follower.row)];
      force = add_scaled(force, external.amplitude(history, place.instant), cross(theta, follower.force_B));
    }
}

void add_modal_loads(const External& external, const Place& place, Workspace& workspace,
                     Gain& gain) noexcept {
  const Plan& plan = external.plan;
  const bool has_mixing = plan.mixing.num_damping > 0 || !plan.feedbacks.empty();
  // of a complete set of point masses each has felt it where it is
  const bool has_gradient = has_field(plan) && plan.coupled.kinetics.form != PlanKinetics::Form::kComplete;
  const bool has_followers =
      std::any_of(plan.histories.begin(), plan.histories.end(),
                  [](const PlanHistory& each) { return !each.stiffening.modes.empty(); });
  if (!has_gradient && !has_mixing && !has_followers) return;
  CoupledWorkspace& w = workspace.coupled;
  const std::size_t n = index(plan.num_padded);
  std::fill(w.Q.begin(), w.Q.end(), 0.0);
  if (has_gradient) {
    add_field(plan, place.R_WB, {}, place.p_WB, w.Q.data());
    const Vec3 torque =
        gradient_torque(plan, multiply_transposed(place.R_WB, sub(place.p_WB, plan.attractor_W)));
    gain.moment_B = add(gain.moment_B, torque);
    gain.rest_moment_B = add(gain.rest_moment_B, torque);
  }
  if (has_followers)
    for (const PlanHistory& history : plan.histories)
      stiffen(history, external.amplitude(history, place.instant), place.q, w.Q.data());
  if (has_mixing) {
    for (std::size_t l = 0; l < n; ++l) w.q_dot[l] = place.p[l] + gain.rate_q[l];
    add_mixing_forces(plan, place.q, w.q_dot.data(), workspace.scratch, w.Q.data());
    const DependentLoad feedback = feed_back(plan, place.q, w.q_dot.data(), w.Q.data());
    gain.moment_B = add(gain.moment_B, feedback.torque_B);
    gain.rest_moment_B = add(gain.rest_moment_B, feedback.torque_B);
    gain.force_W = add(gain.force_W, multiply(place.R_WB, feedback.force_B));
  }
  for (std::size_t l = 0; l < n; ++l) gain.rate_p[l] += w.Q[l] / plan.mass;
  if (gain.Q == nullptr) return;
  for (std::size_t l = 0; l < n; ++l) gain.Q[l] += w.Q[l];
}

void evaluate(const External& external, const Place& place, Workspace& workspace, Gain& gain) noexcept {
  if (external.plan.coupled.kinetics.form == PlanKinetics::Form::kComplete)
    evaluate_complete(external, place, workspace, gain);
  else
    evaluate_incomplete(external, place, workspace, gain);
}

}  // namespace freeflex
