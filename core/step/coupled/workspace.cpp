// Allocates what a step of the coupled rungs needs, and finds the joints of a shape.
#include <limits>

#include "core/step/coupled/coupled.hpp"
#include "core/step/coupled/curve.hpp"
#include "core/step/coupled/stage.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/massless/massless_motion.hpp"
#include "core/step/turning/turning.hpp"

namespace freeflex {

namespace {

// [-] A vibration at the lowest frequency by this share of the size is too small to matter.
constexpr double kLeastVibration = 1e-9;

CoupledWorkspace make_workspace_without_probe(const StepPlan& plan) {
  CoupledWorkspace w;
  const std::size_t n = index(plan.num_padded);
  for (auto* v : {&w.V, &w.W, &w.drift}) v->resize(plan.points.size());
  w.force.resize(plan.points.size() + plan.particles.all.size());
  for (auto* v : {&w.q, &w.p, &w.q_dot, &w.Q}) v->resize(n);
  for (auto& stage : w.rates)
    for (Array& rate : stage) rate.resize(n);
  for (auto* v : {&w.next.momentum, &w.next.rate_q, &w.next.rate_p}) v->resize(n);
  const PlanTrueLinks& links = plan.coupled.links;
  w.bodies.resize(plan.coupled.turning.bodies.size());
  w.joints = make_joint_workspace(links, w.bodies.size(), make_massless_points(plan));
  w.next.massless = make_massless_motion(plan);
  w.ball_joints = make_ball_joints(plan);
  for (auto* v : {&w.linear_V, &w.linear})
    v->resize(traits_of(plan.fidelity).has_true_geometry ? plan.points.size() : 0);
  w.x.resize(traits_of(plan.fidelity).has_true_geometry ? w.force.size() : 0);
  w.curve = make_curve_workspace(plan);
  for (auto* v : {&w.start_q, &w.start_p, &w.filtered_q, &w.filtered_p, &w.rate_q_dot, &w.next.curved_q,
                  &w.next.curved_p, &w.next.curved_rate_q, &w.next.curved_rate_p, &w.next.left_out_q,
                  &w.next.left_out_p})
    v->resize(plan.coupled.curve.modes.empty() ? 0 : n);
  if (plan.coupled.curve.is_filtered) {
    w.slow_start.resize(plan.coupled.curve.modes.size());
    const double omega = plan.omega[index(plan.coupled.curve.modes.front())],
                 phase = omega * plan.period / plan.coupled.num_substeps;
    for (const PlanPoint& point : plan.points)
      w.least_pace =
          std::max(w.least_pace, kLeastVibration * length(point.r) * omega * omega * std::min(1.0, phase));
  }
  for (auto* v : {&w.next.slow_q, &w.next.slow_p, &w.next.slow_change})
    v->resize(plan.coupled.curve.modes.size());
  w.stage_joints = w.next.joints = make_joint_state(links.joints);
  if (traits_of(plan.fidelity).has_true_geometry)
    for (const PlanPoint& point : plan.points) w.rest.push_back(point.r);
  const PlanKinetics& kinetics = plan.coupled.kinetics;
  w.wheels.resize(plan.wheels.size());
  if (is_complete(kinetics)) return w;
  w.spread = make_spread_workspace(plan);
  w.C.resize(3 * n);
  if (!w.wheels.empty()) w.wheel_share.resize(n);
  for (auto* v : {&w.load, &w.inertial, &w.C_dot_w, &w.spare, &w.next.q_ddot}) v->resize(n);
  if (kinetics.form == PlanKinetics::Form::kPoints) w.arms.resize(plan.points.size());
  w.sums.resize(index(kinetics.num_tables) * n);
  w.sums_dot.resize(kinetics.num_tables > 0 ? 6 * n : 0);
  return w;
}

}  // namespace

CoupledWorkspace make_coupled_workspace(const StepPlan& plan) {
  CoupledWorkspace w = make_workspace_without_probe(plan);
  if (!plan.coupled.damps_true_strains) return w;
  w.probe.push_back(make_workspace_without_probe(plan));
  w.probe_turn = w.stage_joints;
  for (Array& each : w.excess_rate) each.resize(index(plan.num_padded));
  return w;
}

JointState relaxed_joints(const StepPlan& plan, const Array& q) {
  if (plan.coupled.links.joints.num_rotations == 0) return make_joint_state(plan.coupled.links.joints);
  CoupledWorkspace w = make_coupled_workspace(plan);
  contract_points(plan, q.data(), q.data(), w.V, w.W);
  if (turns(plan)) place_bodies(plan, q.data(), w.V, w.bodies);
  relax_links(plan, q.data(), w);
  if (!(w.last_turn < 1.0)) {
    for (Quat& rotation : w.stage_joints.rotation) rotation[0] = std::numeric_limits<double>::quiet_NaN();
    for (double& angle : w.stage_joints.angle) angle = std::numeric_limits<double>::quiet_NaN();
  }
  return w.stage_joints;
}

}  // namespace freeflex
