#include "service/output.hpp"

#include <algorithm>
#include <utility>

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

namespace {

template <std::size_t... I>
std::array<Box<Snapshot>, sizeof...(I)> make_boxes(const Snapshot& prototype, std::index_sequence<I...>) {
  return {(static_cast<void>(I), Box<Snapshot>(prototype))...};
}

}  // namespace

Output::Output(const Plan& plan)
    : motion(make_boxes(make_snapshot(plan), std::make_index_sequence<io::kNumMotionChannels>{})),
      status(make_snapshot(plan)) {}

}  // namespace freeflex::service
