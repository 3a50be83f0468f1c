#include "core/plan/tick_turns.hpp"

#include <algorithm>
#include <cmath>

#include "core/scene/faults.hpp"
#include "core/step/readout.hpp"
#include "core/step/tick_turn.hpp"

namespace freeflex {
namespace {

bool has_loads_in_world(const Plan& plan) {
  return plan.attractor_mu > 0.0 || std::ranges::any_of(plan.histories, [](const PlanHistory& history) {
           return history.pattern.has_world;
         });
}

}  // namespace

void warn_of_tick_turns(const Scene& scene, const Plan& plan, Faults& faults) {
  if (is_coupled(plan)) return;  // these divide the tick by the turn   (X100)
  const State start = make_state(plan);
  StepLoads loads;
  loads.wheels.h[0] = wheel_momentum_B(plan, start);
  const TickTurn turn = turn_in_tick(plan, start, rotation_matrix(start.q_WB), loads);
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
    add_warning(
        faults, scene.initial.origin,
        join_text("the body turns by ", angle, " rad a tick at ", rate,
                  " Hz beside loads fixed in the world or an attractor; the elastic modes take loads as "
                  "changing linearly over a tick: raise the rate to ",
                  rate * angle / kStraight, " Hz or more"));
}

}  // namespace freeflex
