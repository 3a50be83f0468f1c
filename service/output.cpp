#include "service/output.hpp"

#include <algorithm>

namespace freeflex::service {

Snapshot make_snapshot(const Plan& plan) {
  Snapshot snapshot;
  snapshot.motion = make_state(plan);
  // copies have room for what they hold, so they hold as much as the wide plan has
  for (const Plan& wide : plan.wide)
    for (Array* array : modal_arrays(snapshot.motion))
      array->resize(std::max(array->size(), static_cast<std::size_t>(wide.num_padded)));
  return snapshot;
}

Output::Output(const Plan& plan)
    : state(make_snapshot(plan)),
      points(make_snapshot(plan)),
      loads(make_snapshot(plan)),
      status(make_snapshot(plan)) {}

}  // namespace freeflex::service
