#include "core/plan/loads/tick_rotations.hpp"

#include <algorithm>
#include <cmath>

#include "core/faults.hpp"
#include "core/step/readout.hpp"
#include "core/step/rigid/tick_rotation.hpp"

namespace freeflex {
namespace {

bool has_loads_in_world(const StepPlan& plan) {
  return plan.attractor_mu > 0.0 || std::ranges::any_of(plan.histories, [](const PlanHistory& history) {
           return history.pattern.has_world;
         });
}

}  // namespace

void warn_of_tick_rotations(const Scene& scene, const StepPlan& plan, Faults& faults) {
  if (is_coupled(plan)) return;  // on the coupled rungs, the rotation sets the substeps   (THEORY 12.30)
  const State start = make_state(plan);
  RigidLoads loads;
  loads.wheels.h[0] = wheel_momentum_B(plan, start);
  const TickRotation rotation = rotation_in_tick(plan, start, rotation_matrix(start.q_WB), loads);
  const double most = 0.5 * kSubstepRotation * kMaxRotationSubsteps, rate = 1.0 / plan.period;
  if (!std::isfinite(rotation.substep_angle) || !std::isfinite(rotation.orbit)) {
    add_warning(faults, scene.initial.origin,
                "the body falls through the attractor in the first tick, and the pull of the attractor has "
                "no bound there; change the initial position or velocity");
    return;
  }
  if (rotation.substep_angle > most)
    add_warning(faults, scene.initial.origin,
                join_text("the body rotates or nutates by ", rotation.substep_angle, " rad a tick at ", rate,
                          " Hz, but ", kMaxRotationSubsteps, " substeps per tick resolve at most ",
                          2.0 * most, " rad, so the attitude becomes wrong; raise the rate to ",
                          rate * rotation.substep_angle / most, " Hz or more"));
  // [rad] rotation theta at which the error theta^2 / 4 of the displacement due to loads fixed in the world
  // is 2 % (THEORY 15.8)
  constexpr double kStraight = 0.28;
  const double spin = length(plan.initial.w_B) * plan.period, angle = std::max(spin, rotation.orbit);
  if (plan.num_elastic > 0 && angle > kStraight && has_loads_in_world(plan))
    add_warning(
        faults, scene.initial.origin,
        join_text(
            "the body rotates by ", angle, " rad a tick at ", rate,
            " Hz under loads fixed in the world or an attractor, but the step treats the modal loads as "
            "linear over a tick; raise the rate to ",
            rate * angle / kStraight, " Hz or more"));
}

}  // namespace freeflex
