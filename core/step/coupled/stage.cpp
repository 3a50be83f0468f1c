#include "core/step/coupled/stage.hpp"

#include <algorithm>
#include <cassert>

#include "core/step/coupled/coupled.hpp"
#include "core/step/coupled/strain_damping.hpp"
#include "core/step/linear/modal_coupling.hpp"
#include "core/step/links/bar.hpp"
#include "core/step/loads/field.hpp"
#include "core/step/loads/history.hpp"
#include "core/step/readout.hpp"

namespace freeflex {
namespace {

/// Returns x minus its component along the unit vector `line`. Returns x if `line` is zero.
Vec3 across(const Vec3& line, const Vec3& x) noexcept { return add_scaled(x, -dot(line, x), line); }

/// Returns the angular velocity w of the frame, and sets alpha. Both follow from the angular momentum, the
/// displacements V_i, and W_i = sum_l b_il p_l:
///   J = I + sum_i m_i ((r_i . V_i) 1 - r_i V_i^T),   pi = sum_i m_i V_i x W_i   (THEORY 12.5, 12.6)
///   alpha = J^-1 (H_B - pi),   w = J^-1 I alpha   (THEORY 12.7, 12.8)
Vec3 angular_velocity(const StepPlan& plan, const Vec3& H_B, CoupledWorkspace& w, Vec3& alpha) noexcept {
  alpha = {};
  if (plan.rigid_freedoms == 3) return {};
  Mat3 J = plan.inertia;
  Vec3 pi{};
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const double m = plan.points[i].mass;
    const Vec3 &r = plan.points[i].r, mV = scale(m, w.V[i]);
    pi = add(pi, cross(mV, w.W[i]));
    const double arm = dot(r, mV);
    // J is symmetric except for rounding errors (THEORY 2.15). The mean of J and J^T is used, which is
    // symmetric to the bit.
    const double xy = 0.5 * (r[0] * mV[1] + r[1] * mV[0]), xz = 0.5 * (r[0] * mV[2] + r[2] * mV[0]),
                 yz = 0.5 * (r[1] * mV[2] + r[2] * mV[1]);
    J[0] += arm - r[0] * mV[0], J[4] += arm - r[1] * mV[1], J[8] += arm - r[2] * mV[2];
    J[1] -= xy, J[3] -= xy, J[2] -= xz, J[6] -= xz, J[5] -= yz, J[7] -= yz;
  }
  w.spin = spin_matrix(plan, J);
  alpha = solve_for_spin(plan, w.spin, sub(H_B, pi));
  return solve_for_spin(plan, w.spin, multiply(plan.inertia, alpha));
}

/// Adds to the forces on points the difference between the force of each bar at true length and that of the
/// linear bar, from bar_force and damper_force   (THEORY 12.18, 12.19). The rate of d = V_j - V_i is
///   d' = W_j - W_i + (alpha - w) x L u - w x d   (THEORY 12.20)
void add_bars(const StepPlan& plan, const Vec3& alpha, const Vec3& w_B, CoupledWorkspace& w) noexcept {
  const Vec3 slip = sub(alpha, w_B);  // the rest vector L u of a bar rotates with alpha, its elastic part d
                                      // with w
  for (const PlanBar& bar : plan.coupled.bars) {
    const std::size_t i = index(bar.first), j = index(bar.second);
    const Vec3 d = sub(w.V[j], w.V[i]);
    Vec3 excess = bar_force(bar, d).excess;
    if (w.joints.massless.holds(bar))
      excess = sub(elastic_force(bar, d), linear_elastic_force(bar, sub(w.linear_V[j], w.linear_V[i])));
    if (bar.damping > 0.0) {
      const Vec3 d_dot =
          sub(add(sub(w.W[j], w.W[i]), cross(slip, scale(bar.length, bar.direction))), cross(w_B, d));
      excess = add(excess, damper_force(bar, d, d_dot).excess);
    }
    w.force[i] = add(w.force[i], excess);
    w.force[j] = sub(w.force[j], excess);
  }
}

bool has_true_links(const StepPlan& plan) noexcept {
  const PlanTrueLinks& links = plan.coupled.links;
  return !links.angles.empty() || !links.matrices.empty() || links.joints.num_rotations > 0 ||
         links.has_joints();
}

/// Returns the point that owns a block of rows. On coupled rungs every point has one block, in the order of
/// the points (checked by find_rung_inconsistency), so point and block have the same index.
std::size_t point_of_row([[maybe_unused]] const StepPlan& plan, std::int32_t row) noexcept {
  assert(plan.points[index(row)].row == row);
  return index(row);
}

/// Sets the resultant and the moments of the loads on the points. With deformed arms, the moment is sum_i
/// (r_i + V_i) x F_i (THEORY 12.12).
void sum_forces(const StepPlan& plan, const StageState& stage, const CoupledWorkspace& w,
                StageRate& rate) noexcept {
  Vec3 force_B{};
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    if (is_zero(w.force[i])) continue;
    force_B = add(force_B, w.force[i]);
    rate.rest_moment_B = add(rate.rest_moment_B, cross(plan.points[i].r, w.force[i]));
    rate.moment_B = add(rate.moment_B, cross(add(plan.points[i].r, w.V[i]), w.force[i]));
  }
  rate.force_W = multiply(stage.R_WB, force_B);
}

/// Adds to the force on each point the attraction at the point minus the attraction at the centre of mass:
///   F_i += m_i (g(rho + x_i) - g(rho)),   x_i = r_i + V_i   (THEORY 8.21)
void add_field_of_points(const StepPlan& plan, const StageState& stage, CoupledWorkspace& w) noexcept {
  const Vec3 rho = multiply_transposed(stage.R_WB, sub(stage.p_WB, plan.attractor_W));
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const Vec3 pull = tidal_acceleration(plan.attractor_mu, rho, add(plan.points[i].r, w.V[i]));
    w.force[i] = add_scaled(w.force[i], plan.points[i].mass, pull);
  }
}

/// Returns sum r x F of the forces on points, those of links beyond the linear ones included. With the linear
/// ones, which have no such moment, it gives the accelerations of points   (THEORY 12.21).
Vec3 moment_of_forces(const StepPlan& plan, const CoupledWorkspace& w) noexcept {
  Vec3 moment{};
  for (std::size_t i = 0; i < plan.points.size(); ++i)
    moment = add(moment, cross(plan.points[i].r, w.force[i]));
  return moment;
}

/// Sets rate.rate_q_dot: the rate of sum m b_l . (V x w) / M as the points move, with w' = J^-1 (H_B x w +
/// L_B) (THEORY 12.83).
void set_drift_rate(const StepPlan& plan, const StageState& stage, const Vec3& alpha, CoupledWorkspace& w,
                    StageRate& rate) noexcept {
  Vec3 w_dot{};
  if (plan.rigid_freedoms != 3)
    w_dot = solve_for_spin(plan, w.spin, add(cross(stage.H_B, rate.w_B), rate.moment_B));
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const Vec3& r = plan.points[i].r;
    const Vec3 V_dot = sub(add(w.W[i], cross(alpha, r)), cross(rate.w_B, add(r, w.V[i])));
    w.drift[i] = scale(plan.points[i].mass / plan.mass, add(cross(V_dot, rate.w_B), cross(w.V[i], w_dot)));
  }
  project_points(plan, w.drift, w.drift, rate.rate_q_dot, w.Q.data());
}

/// Computes the rate at a stage for a complete set of modes of point masses, without the linear motion of
/// each mode (THEORY 12.13). With z_i = W_i + alpha x r_i   (THEORY 12.9):
///   rate_q_l = sum_i m_i b_il . (V_i x w) / M   (THEORY 12.10)
///   rate_p_l = -2 decay_l rate_q_l + (sum_i m_i b_il . (z_i x w) + Q_l) / M   (THEORY 12.11)
///   L_B = sum_i (r_i + V_i) x F_i, the moment in H_B' = H_B x w + L_B   (THEORY 12.12)
void evaluate_complete(const StepLoads& step_loads, const StageState& stage, Workspace& workspace,
                       StageRate& rate) noexcept {
  const StepPlan& plan = step_loads.plan;
  CoupledWorkspace& w = workspace.coupled;
  contract_points(plan, stage.q, stage.p, w.V, w.W);
  if (has_massless(w)) std::copy(w.V.begin(), w.V.end(), w.linear_V.begin());
  Vec3 alpha;
  rate.w_B = angular_velocity(plan, stage.H_B, w, alpha);
  const bool has_links = has_true_links(plan);
  load_massless(step_loads, stage, w);
  if (has_links) relax_links(plan, stage.q, w);
  gather_forces(step_loads, stage, w);
  if (plan.attractor_mu > 0.0) add_field_of_points(plan, stage, w);
  sum_forces(plan, stage, w, rate);
  add_bars(plan, alpha, rate.w_B, w);
  if (has_links) {
    std::fill(w.linear.begin(), w.linear.end(), Vec3{});
    add_links(plan, w);
    for (std::size_t i = 0; i < plan.points.size(); ++i) w.force[i] = sub(w.force[i], w.linear[i]);
  }
  if (rate.Q != nullptr) {
    project_points(plan, w.force, w.force, rate.Q, rate.rate_p);
    rate.balance_B = rate.rest_moment_B;
    if (traits_of(plan.fidelity).has_true_geometry) rate.balance_B = moment_of_forces(plan, w);
  }
  const double inverse_mass = 1.0 / plan.mass;
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const double share = plan.points[i].mass * inverse_mass;
    const Vec3 z = add(w.W[i], cross(alpha, plan.points[i].r));
    w.drift[i] = scale(share, cross(w.V[i], rate.w_B));
    w.force[i] = add_scaled(scale(inverse_mass, w.force[i]), share, cross(z, rate.w_B));
  }
  project_points(plan, w.drift, w.force, rate.rate_q, rate.rate_p);
  const double* decay = plan.decay.data();
  for (std::size_t l = 0; l < index(plan.num_moving); ++l) rate.rate_p[l] -= 2.0 * decay[l] * rate.rate_q[l];
  if (has_links) add_link_moments(plan, w, rate);
  if (rate.rate_q_dot != nullptr) set_drift_rate(plan, stage, alpha, w, rate);
  add_modal_loads(step_loads, stage, workspace, rate);
  add_strain_damping(plan, stage, w, rate);
}

/// Returns the rotation of the points around a force in local axes, from a first guess   (THEORY 8.53):
///   phi = sum_k turn_k R^T (r_k + V_k - r - V),   R <- R exp(phi)
Mat3 rotation_of_neighbours(const StepPlan& plan, const PlanFollower& follower, std::size_t point, Mat3 R,
                            const CoupledWorkspace& w) noexcept {
  constexpr int kMostSweeps = 30;
  constexpr double kFound = 1e-28;  // [-] square of the last phi
  const Vec3 centre = add(follower.r, w.V[point]);
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    Vec3 phi{};
    for (const PlanFollower::Neighbour& each : follower.neighbours) {
      const std::size_t k = index(each.point);
      const Vec3 arm = sub(add(plan.points[k].r, w.V[k]), centre);
      phi = add(phi, multiply(each.turn, multiply_transposed(R, arm)));
    }
    R = multiply(R, matrix_of(rotation_of(phi).q));
    if (!(dot(phi, phi) > kFound)) break;
  }
  return R;
}

/// Sets w.x to the present positions of points and particles.
void set_positions(const StepPlan& plan, const StageState& stage, CoupledWorkspace& w) noexcept {
  const std::size_t num_points = plan.points.size();
  for (std::size_t i = 0; i < num_points; ++i) w.x[i] = add(plan.points[i].r, w.V[i]);
  for (std::size_t k = 0; k < plan.particles.all.size(); ++k) {
    const PlanPoint& particle = plan.particles.all[k];
    const std::int32_t b = plan.coupled.turning.of_carriers[k];
    w.x[num_points + k] =
        b < 0
            ? add(particle.r, contract_rows(point_rows(plan, particle.row), stage.q, index(plan.num_padded)))
            : position_on_body(plan.coupled.turning.bodies[index(b)], w.bodies[index(b)], particle.r);
  }
}

}  // namespace

Mat3 spin_matrix(const StepPlan& plan, const Mat3& J) noexcept {
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

Vec3 solve_for_spin(const StepPlan& plan, const Mat3& matrix, const Vec3& b) noexcept {
  if (plan.rigid_freedoms != 5) return solve_by_adjugate(matrix, b);
  return across(plan.line, solve_by_adjugate(matrix, across(plan.line, b)));
}

void gather_forces(const StepLoads& step_loads, const StageState& stage, CoupledWorkspace& w) noexcept {
  const StepPlan& plan = step_loads.plan;
  const bool is_true = traits_of(plan.fidelity).has_true_geometry;
  const bool needs_positions = is_true && step_loads.turn_groups();
  if (needs_positions) set_positions(plan, stage, w);
  step_loads.on_points(stage.stage_time, stage.R_WB,
                       needs_positions ? std::span<const Vec3>(w.x) : std::span<const Vec3>(), w.force);
  for (const PlanHistory& history : plan.histories)
    for (const PlanFollower& follower : history.followers) {
      const Vec3 theta = contract_rows(follower.rotation_rows.data(), stage.q, index(plan.num_padded));
      const std::size_t point = point_of_row(plan, follower.row);
      Vec3& force = w.force[point];
      if (is_true) {
        const PlanJoints& joints = plan.coupled.links.joints;
        const bool has_joint = !joints.of_points.empty() && joints.of_points[point] >= 0;
        const Mat3 R =
            has_joint ? w.joints.R[index(joints.of_points[point])]
                      : rotation_of_neighbours(plan, follower, point, matrix_of(rotation_of(theta).q), w);
        force = add_scaled(force, step_loads.amplitude(history, stage.stage_time),
                           sub(multiply(R, follower.force_B), follower.force_B));
        continue;
      }
      force =
          add_scaled(force, step_loads.amplitude(history, stage.stage_time), cross(theta, follower.force_B));
    }
}

void add_modal_loads(const StepLoads& step_loads, const StageState& stage, Workspace& workspace,
                     StageRate& rate) noexcept {
  const StepPlan& plan = step_loads.plan;
  const bool has_modal_coupling = plan.modal_coupling.num_damping > 0 || !plan.feedbacks.empty();
  // if the modes are a complete set for point masses, add_field_of_points has already added the attractor
  // (THEORY 8.21)
  const PlanKinetics& kinetics = plan.coupled.kinetics;
  const bool has_gradient =
      has_field(plan) && !is_complete(kinetics) && kinetics.form != PlanKinetics::Form::kSpread;
  const bool has_stiffening =
      !plan.field_stiffening.modes.empty() || !plan.command_stiffening.modes.empty() ||
      std::any_of(plan.histories.begin(), plan.histories.end(),
                  [](const PlanHistory& each) { return !each.stiffening.modes.empty(); });
  if (!has_gradient && !has_modal_coupling && !has_stiffening) return;
  CoupledWorkspace& w = workspace.coupled;
  const std::size_t n = index(plan.num_padded);
  std::fill(w.Q.begin(), w.Q.end(), 0.0);
  if (has_gradient) {
    add_field(plan, stage.R_WB, {}, stage.p_WB, w.Q.data());
    const Vec3 torque =
        gradient_torque(plan, multiply_transposed(stage.R_WB, sub(stage.p_WB, plan.attractor_W)));
    rate.moment_B = add(rate.moment_B, torque);
    rate.rest_moment_B = add(rate.rest_moment_B, torque);
  }
  if (has_stiffening) {
    w.stiffened_w =
        stiffen_by_fields(plan, stage.R_WB, stage.H_B, stage.wheels, stage.p_WB, stage.q, w.Q.data()).w_B;
    for (const PlanHistory& history : plan.histories)
      stiffen(history, step_loads.amplitude(history, stage.stage_time), stage.R_WB, stage.q, w.Q.data());
    stiffen_by_commands(plan, step_loads.commands(stage.stage_time), stage.R_WB, stage.q, w.Q.data());
  }
  if (has_modal_coupling) {
    for (std::size_t l = 0; l < n; ++l) w.q_dot[l] = stage.p[l] + rate.rate_q[l];
    add_modal_coupling_forces(plan, stage.q, w.q_dot.data(), workspace.scratch, w.Q.data());
    const DependentLoad feedback = feed_back(plan, stage.q, w.q_dot.data(), w.Q.data());
    rate.moment_B = add(rate.moment_B, feedback.torque_B);
    rate.moment_B =
        add(rate.moment_B, feedback_on_displaced_points(plan, stage.q, w.q_dot.data(), w.Q.data()));
    rate.rest_moment_B = add(rate.rest_moment_B, feedback.torque_B);
    rate.balance_B = add(rate.balance_B, feedback.torque_B);
    rate.force_W = add(rate.force_W, multiply(stage.R_WB, feedback.force_B));
  }
  for (std::size_t l = 0; l < n; ++l) rate.rate_p[l] += w.Q[l] / plan.mass;
  if (rate.Q == nullptr) return;
  for (std::size_t l = 0; l < n; ++l) rate.Q[l] += w.Q[l];
}

void relax_links(const StepPlan& plan, const double* q, CoupledWorkspace& w) noexcept {
  const PlanTrueLinks& links = plan.coupled.links;
  for (std::size_t b = 0; b < w.bodies.size(); ++b) {
    w.joints.R[index(links.joints.num_joints) + b] = w.bodies[b].R;
    w.joints.body_theta[b] = w.bodies[b].theta;
    // that of the linear structure, to which coordinates of ball joints do not belong   (THEORY 12.123)
    const double* rows = plan.coupled.turning.bodies[b].rows.data() + 3 * index(plan.num_padded);
    for (std::size_t l = index(plan.num_moving); l < index(plan.num_padded); ++l)
      for (std::size_t a = 0; a < 3; ++a)
        w.joints.body_theta[b][a] -= rows[a * index(plan.num_padded) + l] * q[l];
  }
  w.last_turn = relax_joints(links, plan.coupled.bars, w.rest, index(plan.num_padded), q, w.V, w.stage_joints,
                             w.joints);
}

void load_massless(const StepLoads& step_loads, const StageState& stage, CoupledWorkspace& w) noexcept {
  if (!has_massless(w)) return;
  // no load on a massless point depends on its displacement
  gather_forces(step_loads, stage, w);
  MasslessPoints& massless = w.joints.massless;
  for (std::size_t k = 0; k < massless.points.size(); ++k)
    massless.load[k] = w.force[index(massless.points[k].point)];
}

void add_links(const StepPlan& plan, CoupledWorkspace& w) noexcept {
  std::fill(w.Q.begin(), w.Q.end(), 0.0);
  const std::span<const Vec3> linear_V = linear_displacements(w);
  add_true_links(plan.coupled.links, index(plan.num_padded), w.V, linear_V, w.rest, w.stage_joints, w.joints,
                 w.force, w.linear, w.Q.data());
  for (double& Q : w.Q) Q += w.last_turn - w.last_turn;  // NaN if a joint has no equilibrium
}

void add_link_moments(const StepPlan& plan, const CoupledWorkspace& w, StageRate& rate) noexcept {
  for (std::size_t l = 0; l < index(plan.num_padded); ++l) rate.rate_p[l] += w.Q[l] / plan.mass;
  if (rate.Q == nullptr) return;
  for (std::size_t l = 0; l < index(plan.num_padded); ++l) rate.Q[l] += w.Q[l];
}

void evaluate(const StepLoads& step_loads, const StageState& stage, Workspace& workspace,
              StageRate& rate) noexcept {
  rate.moment_B = rate.rest_moment_B = rate.balance_B = {};  // they are summed
  workspace.coupled.stiffened_w = {};
  switch (step_loads.plan.coupled.kinetics.form) {
    case PlanKinetics::Form::kComplete:
      evaluate_complete(step_loads, stage, workspace, rate);
      break;
    case PlanKinetics::Form::kTurning:
    case PlanKinetics::Form::kSpread:
      return evaluate_turning(step_loads, stage, workspace, rate);
    case PlanKinetics::Form::kPoints:
    case PlanKinetics::Form::kTables:
      evaluate_incomplete(step_loads, stage, workspace, rate);
      break;
  }
  rate.w_B = add(rate.w_B, workspace.coupled.stiffened_w);  // (THEORY 8.52)
}

}  // namespace freeflex
