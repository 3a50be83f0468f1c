#include "core/step/scope.hpp"

#include <cassert>
#include <utility>

#include "core/step/linear/modal_coupling.hpp"

namespace freeflex {
namespace {

void resize(LoadPattern& pattern, std::size_t n) noexcept {
  pattern.table.resize(9 * n);
  pattern.Q_B.resize(n);
}

/// Resizes `values` to n and moves the value of each mode l to the index positions[l], in place. Sets the
/// other values to zero.
/// \pre positions are ascending, so positions[l] >= l
void spread_modes(const std::vector<std::int32_t>& positions, std::size_t n, Array& values) noexcept {
  assert(std::ranges::is_sorted(positions));
  values.resize(n, 0.0);
  for (std::size_t l = n; l-- > positions.size();) values[l] = 0.0;
  for (std::size_t l = positions.size(); l-- > 0;) {
    const double value = values[l];
    values[l] = 0.0;
    values[index(positions[l])] = value;
  }
}

/// Moves the value at the index positions[l] to each mode l, in place. Resizes `values` to n, and sets the
/// padding to zero.
void gather_modes(const std::vector<std::int32_t>& positions, std::size_t n, Array& values) noexcept {
  for (std::size_t l = 0; l < positions.size(); ++l) values[l] = values[index(positions[l])];
  values.resize(n);
  for (std::size_t l = positions.size(); l < n; ++l) values[l] = 0.0;
}

}  // namespace

Need find_need(const StepPlan& plan, const ForceCommand& command) noexcept {
  return find_need(
      plan.scope, command, [&](std::int32_t point) { return plan.points[index(point)].r; },
      [&](std::int32_t group) { return plan.groups[index(group)].centre; });
}

// q_u = q_l if mode u of the fallback plan is mode l of the reduced plan, otherwise q_u = 0. The other modal
// arrays are converted in the same way (THEORY 14.16)
void switch_to_fallback(const StepPlan& plan, Need need, State& state) noexcept {
  assert(!plan.fallback.empty() && !state.uses_fallback);
  const std::size_t n = index(plan.fallback.front().num_padded);
  for (Array* v : modal_arrays(state)) spread_modes(plan.fallback_modes, n, *v);
  resize(state.commands_pattern, n);
  state.slots_changed = true;
  state.uses_fallback = true;
  state.fallback_tick = state.tick;
  state.fallback_need = static_cast<std::int32_t>(need);
}

void switch_back(const StepPlan& plan, State& state) noexcept {
  assert(state.uses_fallback);
  const std::size_t n = index(plan.num_padded);
  for (Array* v : modal_arrays(state)) gather_modes(plan.fallback_modes, n, *v);
  resize(state.commands_pattern, n);
  state.slots_changed = true;
  state.uses_fallback = false;
  state.fallback_tick = -1;
  state.fallback_need = 0;
}

void fit(const StepPlan& plan, const State& state, Workspace& workspace) noexcept {
  if (workspace.uses_fallback == state.uses_fallback) return;
  const StepPlan& active = active_plan(plan, state);
  const std::size_t n = index(active.num_padded);
  for (Array* v : modal_arrays(workspace)) v->resize(n);
  if (active.modal_coupling.path == PlanModalCoupling::Path::kSplit) workspace.q_dot_after_impulse.resize(n);
  if (has_dependent_loads(active)) workspace.predicted_q.resize(n);
  workspace.scratch.resize(modal_coupling_scratch_size(active));
  resize(workspace.next_pattern, n);
  std::swap(workspace.group_rows, workspace.other_group_rows);
  workspace.uses_fallback = state.uses_fallback;
}

}  // namespace freeflex
