#include "service/output.hpp"

#include <algorithm>

namespace freeflex::service {

Snapshot make_snapshot(const Plan& plan) {
  Snapshot snapshot;
  snapshot.state = make_state(plan);
  snapshot.state.slots = {};
  snapshot.state.commands_pattern = {};
  // copies have room for what they hold, so they hold as much as the wide plan has
  State& state = snapshot.state;
  for (const Plan& wide : plan.wide)
    for (Array* array : {&state.q, &state.q_low, &state.q_dot, &state.q_dot_low, &state.Q})
      array->resize(std::max(array->size(), static_cast<std::size_t>(wide.num_padded)));
  return snapshot;
}

Output::Output(const Plan& plan)
    : state(make_snapshot(plan)),
      points(make_snapshot(plan)),
      loads(make_snapshot(plan)),
      status(make_snapshot(plan)) {}

}  // namespace freeflex::service
