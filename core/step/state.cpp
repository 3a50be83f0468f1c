#include "core/step/state.hpp"

#include <algorithm>

#include "core/step/coupling.hpp"
#include "core/step/readout.hpp"
#include "core/step/vector.hpp"

namespace freeflex {
namespace {

void set_initial(const Plan& plan, State& state) {
  const PlanInitial& initial = plan.initial;
  state.epoch_start_tick = state.tick;
  state.p_WB = initial.p_WB;
  state.v_WB = initial.v_WB;
  state.q_WB = initial.q_WB;
  state.H_W = multiply(rotation_matrix(initial.q_WB), multiply(plan.inertia, initial.w_WB_B));
  state.p_WB_low = state.v_WB_low = state.H_W_low = {};
  state.q_WB_low = {};
  std::copy(initial.q.begin(), initial.q.end(), state.q.begin());
  std::copy(initial.q_dot.begin(), initial.q_dot.end(), state.q_dot.begin());
  std::fill(state.q_low.begin(), state.q_low.end(), 0.0);
  std::fill(state.q_dot_low.begin(), state.q_dot_low.end(), 0.0);
  state.force_W = state.moment_B = {};
  std::fill(state.Q.begin(), state.Q.end(), 0.0);
  state.num_slots = 0;
  state.slots_changed = true;
}

}  // namespace

State make_state(const Plan& plan) {
  State state;
  const auto n = static_cast<std::size_t>(plan.num_padded);
  for (auto* v : {&state.q, &state.q_low, &state.q_dot, &state.q_dot_low, &state.Q}) v->resize(n);
  state.slots.resize(kMaxSlots);
  state.commands_pattern = make_pattern(plan);
  set_initial(plan, state);
  return state;
}

Workspace make_workspace(const Plan& plan) {
  Workspace workspace;
  const auto n = static_cast<std::size_t>(plan.num_padded);
  for (auto* v : {&workspace.Q_right, &workspace.Q_left, &workspace.next_q, &workspace.next_q_low,
                  &workspace.next_q_dot, &workspace.next_q_dot_low})
    v->resize(n);
  if (plan.coupling.path == PlanCoupling::Path::kSplit) workspace.kicked.resize(n);
  if (has_dependent_loads(plan)) workspace.predicted_q.resize(n);
  workspace.scratch.resize(coupling_scratch_size(plan));
  workspace.next_slots.resize(kMaxSlots);
  workspace.next_pattern = make_pattern(plan);
  workspace.sums = make_load_sums(plan);
  workspace.group_rows = make_group_rows(plan);
  return workspace;
}

void reset_state(const Plan& plan, State& state) {
  ++state.epoch;
  set_initial(plan, state);
}

}  // namespace freeflex
