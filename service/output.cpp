#include "service/output.hpp"

#include <algorithm>
#include <utility>

namespace freeflex::service {

Snapshot make_snapshot(const Plan& plan) {
  Snapshot snapshot;
  snapshot.motion = make_state(plan);
  // a copied array has memory only for its contents, so the arrays get the size of the fallback plan
  for (const StepPlan& wide : plan.fallback)
    for (Array* array : modal_arrays(snapshot.motion))
      array->resize(std::max(array->size(), index(wide.num_padded)));
  return snapshot;
}

namespace {

/// Returns the size of a snapshot with its arrays [bytes].
std::size_t bytes_of(Snapshot& snapshot) {
  std::size_t numbers = 0;
  for (const Array* array : modal_arrays(snapshot.motion)) numbers += array->size();
  const CoupledState& coupled = snapshot.motion.coupled;
  numbers += coupled.momentum.size() + coupled.rate_q.size() + coupled.rate_p.size() + coupled.q_ddot.size();
  return sizeof(Snapshot) + numbers * sizeof(double);
}

/// Makes a queue for each motion channel. A channel that is off gets a queue with one place.
template <std::size_t... I>
std::array<Queue<Snapshot>, sizeof...(I)> make_queues(const Plan& plan, Snapshot prototype,
                                                      std::size_t most_waiting, std::index_sequence<I...>) {
  const std::size_t num_places =
      std::min(most_waiting, std::max(Output::kLeastWaiting, Output::kMotionBytes / bytes_of(prototype)));
  return {Queue<Snapshot>(prototype, plan.rates[I] > 0.0 ? num_places : 1)...};
}

}  // namespace

Output::Output(const Plan& plan, std::size_t most_waiting)
    : motion(make_queues(plan, make_snapshot(plan), most_waiting,
                         std::make_index_sequence<kNumMotionChannels>{})),
      status(make_snapshot(plan)) {}

}  // namespace freeflex::service
