#include "service/output.hpp"

namespace freeflex::service {

Snapshot make_snapshot(const Plan& plan) {
  Snapshot snapshot;
  snapshot.state = make_state(plan);
  snapshot.state.slots = {};
  snapshot.state.commands_pattern = {};
  return snapshot;
}

Output::Output(const Plan& plan)
    : state(make_snapshot(plan)),
      points(make_snapshot(plan)),
      loads(make_snapshot(plan)),
      status(make_snapshot(plan)) {}

}  // namespace freeflex::service
