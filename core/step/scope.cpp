#include "core/step/scope.hpp"

#include <utility>

#include "core/step/mixing.hpp"

namespace freeflex {
namespace {

void resize(LoadPattern& pattern, std::size_t n) noexcept {
  pattern.table.resize(9 * n);
  pattern.Q_B.resize(n);
}

/// Values of modes from narrow to wide, in place: places are ascending and no lower than where values stand.
void spread(const std::vector<std::int32_t>& places, std::size_t n, Array& values) noexcept {
  values.resize(n, 0.0);
  for (std::size_t l = n; l-- > places.size();) values[l] = 0.0;
  for (std::size_t l = places.size(); l-- > 0;) {
    const double value = values[l];
    values[l] = 0.0;
    values[index(places[l])] = value;
  }
}

void gather(const std::vector<std::int32_t>& places, std::size_t n, Array& values) noexcept {
  for (std::size_t l = 0; l < places.size(); ++l) values[l] = values[index(places[l])];
  values.resize(n);
  for (std::size_t l = places.size(); l < n; ++l) values[l] = 0.0;
}

}  // namespace

Need find_need(const Plan& plan, const ForceCommand& command) noexcept {
  return find_need(
      plan.scope, command, [&](std::int32_t point) { return plan.points[index(point)].r; },
      [&](std::int32_t group) { return plan.groups[index(group)].centre; });
}

void widen(const Plan& plan, Need need, State& state) noexcept {
  const std::size_t n = index(plan.wide.front().num_padded);
  for (Array* v : modal_arrays(state)) spread(plan.wide_modes, n, *v);
  resize(state.commands_pattern, n);
  state.slots_changed = true;
  state.is_wide = true;
  state.wide_tick = state.tick;
  state.wide_need = static_cast<std::int32_t>(need);
}

void narrow(const Plan& plan, State& state) noexcept {
  const std::size_t n = index(plan.num_padded);
  for (Array* v : modal_arrays(state)) gather(plan.wide_modes, n, *v);
  resize(state.commands_pattern, n);
  state.slots_changed = true;
  state.is_wide = false;
}

void fit(const Plan& plan, const State& state, Workspace& workspace) noexcept {
  if (workspace.is_wide == state.is_wide) return;
  const Plan& active = active_plan(plan, state);
  const std::size_t n = index(active.num_padded);
  for (Array* v : modal_arrays(workspace)) v->resize(n);
  if (active.mixing.path == PlanMixing::Path::kSplit) workspace.kicked.resize(n);
  if (has_dependent_loads(active)) workspace.predicted_q.resize(n);
  workspace.scratch.resize(mixing_scratch_size(active));
  resize(workspace.next_pattern, n);
  std::swap(workspace.group_rows, workspace.other_group_rows);
  workspace.is_wide = state.is_wide;
}

}  // namespace freeflex
