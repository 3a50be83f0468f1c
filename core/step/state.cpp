#include "core/step/state.hpp"

#include <algorithm>

#include "core/step/coupled/coupled.hpp"
#include "core/step/linear/modal_coupling.hpp"
#include "core/step/massless/massless_motion.hpp"
#include "core/step/readout.hpp"
#include "core/step/vector.hpp"

namespace freeflex {
namespace {

/// Returns the larger num_padded of a plan and its fallback plan. Arrays that are swapped have room for both
/// plans.
std::size_t most_padded(const StepPlan& plan) {
  const std::int32_t fallback = plan.fallback.empty() ? 0 : plan.fallback.front().num_padded;
  return index(std::max(plan.num_padded, fallback));
}

LoadPattern make_roomy_pattern(const StepPlan& plan) {
  LoadPattern pattern = make_pattern(plan);
  pattern.table.reserve(9 * most_padded(plan));
  pattern.Q_B.reserve(most_padded(plan));
  return pattern;
}

void set_initial(const StepPlan& plan, State& state) {
  const PlanInitial& initial = plan.initial;
  state.epoch_start_tick = state.tick;
  static_cast<Frame&>(state) = {
      .p_WB = initial.p_WB,
      .v_WB = initial.v_WB,
      .q_WB = initial.q_WB,
      .H_W = multiply(rotation_matrix(initial.q_WB), multiply(plan.inertia, initial.w_B))};
  for (std::size_t k = 0; k < plan.wheels.size(); ++k) {
    state.wheel_momentum[k] = plan.wheels[k].momentum;
    state.wheel_momentum_low[k] = 0.0;
  }
  if (!plan.wheels.empty() && !is_coupled(plan))
    state.H_W = add(state.H_W, multiply(rotation_matrix(initial.q_WB), wheel_momentum_B(plan, state)));
  // without slots, the pattern of commands stays that of none
  state.slots_changed = state.slots_changed || state.num_slots > 0 || state.uses_fallback;
  // A reset returns the state from the fallback plan to the plan. The arrays have room for both plans, so
  // nothing is allocated.
  const auto n = index(plan.num_padded);
  for (Array* v : modal_arrays(state)) v->resize(n);
  state.commands_pattern.table.resize(9 * n);
  state.commands_pattern.Q_B.resize(n);
  state.uses_fallback = false;
  state.fallback_tick = -1;
  state.fallback_need = 0;
  std::copy(initial.q.begin(), initial.q.end(), state.q.begin());
  std::copy(initial.q_dot.begin(), initial.q_dot.end(), state.q_dot.begin());
  std::fill(state.q_low.begin(), state.q_low.end(), 0.0);
  std::fill(state.q_dot_low.begin(), state.q_dot_low.end(), 0.0);
  state.force_W = state.moment_B = {};
  std::fill(state.Q.begin(), state.Q.end(), 0.0);
  state.num_slots = 0;
  if (is_coupled(plan)) set_coupled_motion(plan, initial.w_B, state);
  state.has_frame = state.has_modes = true;
  state.points.is_set = state.point_history.is_multistep = false;
  state.point_history.num_nodes = 0;
}

}  // namespace

State make_state(const StepPlan& plan) {
  State state;
  const auto n = index(plan.num_padded);
  for (Array* v : modal_arrays(state)) {
    v->reserve(most_padded(plan));
    v->resize(n);
  }
  if (is_coupled(plan)) {
    for (auto* v : {&state.coupled.momentum, &state.coupled.rate_q, &state.coupled.rate_p}) v->resize(n);
    state.coupled.joints = make_joint_state(plan.coupled.links.joints);
    state.coupled.massless = make_massless_motion(plan);
    for (auto* v : {&state.coupled.slow_q, &state.coupled.slow_p, &state.coupled.slow_change})
      v->resize(plan.coupled.curve.modes.size());
    for (auto* v : {&state.coupled.curved_q, &state.coupled.curved_p, &state.coupled.curved_rate_q,
                    &state.coupled.curved_rate_p, &state.coupled.left_out_q, &state.coupled.left_out_p})
      v->resize(plan.coupled.curve.modes.empty() ? 0 : n);
  }
  for (auto* v : {&state.wheel_momentum, &state.wheel_momentum_low}) v->resize(plan.wheels.size());
  if (!is_complete(plan.coupled.kinetics)) state.coupled.q_ddot.resize(n);
  state.slots.resize(kMaxSlots);
  state.commands_pattern = make_roomy_pattern(plan);
  if (integrates_points(plan)) {
    state.points = make_points_at_tick(plan.points_method);
    state.point_history = make_point_history(plan.points_method);
  }
  set_initial(plan, state);
  return state;
}

Workspace make_workspace(const StepPlan& plan) {
  Workspace workspace;
  const auto n = index(plan.num_padded);
  for (Array* v : modal_arrays(workspace)) {
    v->reserve(most_padded(plan));
    v->resize(n);
  }
  if (plan.modal_coupling.path == PlanModalCoupling::Path::kSplit) workspace.q_dot_after_impulse.resize(n);
  if (has_dependent_loads(plan)) workspace.predicted_q.resize(n);
  workspace.scratch.resize(modal_coupling_scratch_size(plan));
  if (is_coupled(plan)) workspace.coupled = make_coupled_workspace(plan);
  if (integrates_points(plan)) workspace.points = make_points_workspace(plan.points_method);
  if (plan.coupled.num_substeps > 1) workspace.substep = make_state(plan);
  for (auto* v : {&workspace.next_wheel, &workspace.next_wheel_low}) v->resize(plan.wheels.size());
  workspace.next_slots.resize(kMaxSlots);
  workspace.next_pattern = make_roomy_pattern(plan);
  workspace.sums = make_load_sums(plan);
  workspace.group_rows = make_group_rows(plan);
  if (!plan.fallback.empty()) {
    const StepPlan& fallback = plan.fallback.front();
    workspace.other_group_rows = make_group_rows(fallback);
    workspace.q_dot_after_impulse.reserve(most_padded(plan));
    workspace.predicted_q.reserve(most_padded(plan));
    workspace.scratch.reserve(
        std::max(modal_coupling_scratch_size(plan), modal_coupling_scratch_size(fallback)));
  }
  return workspace;
}

void reset_state(const StepPlan& plan, State& state) {
  ++state.epoch;
  set_initial(plan, state);
}

}  // namespace freeflex
