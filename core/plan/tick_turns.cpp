#include "core/plan/tick_turns.hpp"

#include <algorithm>
#include <cmath>

#include "core/scene/faults.hpp"
#include "core/step/readout.hpp"
#include "core/step/tick_turn.hpp"

namespace freeflex {
namespace {

// The motion of the start, as the step sees it.
struct Start {
  Frame frame;
  StepLoads loads;  // wheels alone
};

Start start_of(const Plan& plan) {
  Start start;
  start.frame.p_WB = plan.initial.p_WB;
  start.frame.v_WB = plan.initial.v_WB;
  start.frame.q_WB = plan.initial.q_WB;
  Vec3& h = start.loads.wheels.h[0];
  for (const PlanWheel& wheel : plan.wheels.all) h = add_scaled(h, wheel.momentum, wheel.axis);
  start.frame.H_W =
      multiply(rotation_matrix(plan.initial.q_WB), add(multiply(plan.inertia, plan.initial.w_WB_B), h));
  return start;
}

bool has_loads_in_world(const Plan& plan) {
  return plan.attractor_mu > 0.0 || std::ranges::any_of(plan.histories, [](const PlanHistory& history) {
           return history.pattern.has_world;
         });
}

}  // namespace

void warn_of_tick_turns(const Scene& scene, const Plan& plan, Faults& faults) {
  if (is_coupled(plan)) return;  // these divide the tick by the turn   (X100)
  const auto [frame, loads] = start_of(plan);
  const TickTurn turn = turn_in_tick(plan, frame, rotation_matrix(frame.q_WB), loads);
  const double most = 0.5 * kUnevenTurn * kMostSubsteps, rate = 1.0 / plan.period;
  if (!std::isfinite(turn.uneven) || !std::isfinite(turn.orbit)) {
    add_warning(faults, scene.initial.origin,
                "the body falls through its attractor in the first tick, where its pull has no bound");
    return;
  }
  if (turn.uneven > most)
    add_warning(faults, scene.initial.origin,
                join_text("the body turns or nutates by ", turn.uneven, " rad a tick at ", rate, " Hz, and ",
                          kMostSubsteps, " substeps resolve ", 2.0 * most,
                          ": the word will not be good; raise the rate to ", rate * turn.uneven / most,
                          " Hz or more"));
  // 2 % of what these loads displace   (X144)
  constexpr double kStraight = 0.28;
  const double spin = length(plan.initial.w_WB_B) * plan.period, angle = std::max(spin, turn.orbit);
  if (plan.num_elastic > 0 && angle > kStraight && has_loads_in_world(plan))
    add_warning(faults, scene.initial.origin,
                join_text("loads that are fixed in the world, or the pull of the attractor, turn by ", angle,
                          " rad in the body within a tick at ", rate,
                          " Hz, and the elastic modes take them as straight over it: raise the rate to ",
                          rate * angle / kStraight, " Hz or more"));
}

}  // namespace freeflex
