#include "core/validity/responsible.hpp"

#include <algorithm>
#include <cmath>

#include "core/step/history.hpp"
#include "core/step/readout.hpp"
#include "core/step/vector.hpp"

namespace freeflex {
namespace {

using Agent = Responsible::Agent;

double squared(double x) { return x * x; }

/// [m] size of the static answer of the modes to a load at amplitude 1, whatever the attitude.
double answer_to(const Plan& plan, const LoadPattern& pattern) noexcept {
  const auto n = static_cast<std::size_t>(plan.num_elastic),
             padded = static_cast<std::size_t>(plan.num_padded);
  double sum = 0.0;
  for (std::size_t l = 0; l < n; ++l) {
    if (plan.omega[l] == 0.0) continue;
    double Q = 0.0;  // square of the generalized force
    if (pattern.has_body && l < pattern.Q_B.size()) Q += squared(pattern.Q_B[l]);
    if (pattern.uses_table)
      for (std::size_t ab = 0; ab < 9; ++ab) Q += squared(pattern.table[ab * padded + l]);
    else
      for (std::size_t k = 0; k < static_cast<std::size_t>(pattern.num_direct); ++k) {
        const double force = dot(pattern.direct_force_W[k], pattern.direct_force_W[k]);
        for (std::size_t axis = 0; axis < 3; ++axis)
          Q += force * squared(plan.rows[(3 * index(pattern.direct_row[k]) + axis) * padded + l]);
      }
    for (std::size_t k = 0; k < pattern.wheels.torque.size(); ++k) {
      const PlanWheel& wheel = plan.wheels.all[k];
      const double* const rows = turn_rows(plan, wheel.turning);
      Q += squared(pattern.wheels.torque[k] *
                   dot(wheel.axis, Vec3{rows[l], rows[padded + l], rows[2 * padded + l]}));
    }
    sum += Q / squared(plan.mass * squared(plan.omega[l]));
  }
  return std::sqrt(sum);
}

std::int32_t largest_wheel(const State& state) noexcept {
  std::size_t largest = 0;
  for (std::size_t k = 1; k < state.wheel_momentum.size(); ++k)
    if (std::abs(state.wheel_momentum[k]) > std::abs(state.wheel_momentum[largest])) largest = k;
  return static_cast<std::int32_t>(largest);
}

}  // namespace

void ResponsibleFinder::name_mode(std::int32_t mode, const State& state, Responsible& named) const noexcept {
  if (mode < 0) return;
  const Plan& plan = active_plan(plan_, state);
  const auto l = static_cast<std::size_t>(mode);
  named.mode = plan.mode_numbers.empty() ? mode + 1 : plan.mode_numbers[l];
  named.frequency = plan.omega[l] / (2.0 * M_PI);
}

/// The load that bends most at the moment; of those that bend nothing, none.
Responsible ResponsibleFinder::acting_load(const State& state) const noexcept {
  const Plan& plan = active_plan(plan_, state);
  Responsible found;
  double most = 0.0;
  // before the first step no load has acted
  const std::int64_t age = state.tick - state.epoch_start_tick;
  for (std::size_t k = 0; k < plan.histories.size() && age > 0; ++k) {
    const double amplitude = std::abs(amplitude_left(plan.histories[k], plan.period, age));
    if (amplitude == 0.0) continue;
    const double size = amplitude * answer_to(plan, plan.histories[k].pattern);
    if (size > most) most = size, found = {Agent::kLoad, static_cast<std::int32_t>(k), 0, 0.0};
  }
  if (state.num_slots > 0 && answer_to(plan, state.commands_pattern) > most)
    found = {Agent::kCommands, -1, 0, 0.0};
  return found;
}

Responsible ResponsibleFinder::of_buckling(const ModalErrors& errors, const State& state) const noexcept {
  const ModalLeaders& leaders = errors.leaders();
  if (!leaders.is_left_out) return of_stiffness(errors, leaders.softest, state);
  Responsible found = of_stiffness(errors, -1, state);
  const PlanNamed& names = active_plan(plan_, state).neglect.named;
  if (const auto l = static_cast<std::size_t>(leaders.softest); l < names.left_out.size()) {
    found.mode = names.left_out[l];
    found.frequency = names.left_out_frequency[l];
  }
  return found;
}

Responsible ResponsibleFinder::of_stiffness(const ModalErrors& errors, std::int32_t mode,
                                            const State& state) const noexcept {
  const StiffnessShares shares = errors.shares_of(mode, state);
  const Vec3 w = angular_velocity(active_plan(plan_, state), state);
  const bool spins = dot(w, w) > 0.0;
  Responsible found = acting_load(state);
  const bool loads = found.agent != Agent::kNone;
  if (!loads || (mode >= 0 && shares.loads < std::max(shares.spin, shares.vibration))) {
    // without a load, what stands is bent by the spin or by the gradient of a field
    const double standing = loads ? 0.0 : shares.loads;
    found = {};
    if (spins && shares.spin + standing >= shares.vibration)
      found.agent = Agent::kSpin;
    else if (!spins && plan_.attractor_mu > 0.0 && standing > shares.vibration)
      found.agent = Agent::kOrbit;
    else
      found.agent = Agent::kVibration;
  }
  name_mode(mode, state, found);
  return found;
}

Responsible ResponsibleFinder::of_displacement(std::int32_t mode, const State& state) const noexcept {
  Responsible found;
  if (mode >= 0) {
    const Plan& plan = active_plan(plan_, state);
    const auto l = static_cast<std::size_t>(mode);
    const double stiffness = plan.mass * squared(plan.omega[l]),
                 still = stiffness > 0.0 ? state.Q[l] / stiffness : 0.0;
    if (std::abs(still) > std::abs(state.q[l] - still)) found = acting_load(state);
  }
  if (found.agent == Agent::kNone) found.agent = Agent::kVibration;
  name_mode(mode, state, found);
  return found;
}

Responsible ResponsibleFinder::of_vibration(std::int32_t mode, const State& state) const noexcept {
  Responsible found{Agent::kVibration, -1, 0, 0.0};
  name_mode(mode, state, found);
  return found;
}

Responsible ResponsibleFinder::of_hidden(const ModalLeaders& leaders, const State& state) const noexcept {
  const Plan& plan = active_plan(plan_, state);
  const PlanNeglect& neglect = plan.neglect;
  Responsible found;
  if (leaders.wheel >= 0)
    found = {Agent::kWheel, leaders.wheel, 0, 0.0};
  else if (!neglect.has_unseen)
    found.agent = Agent::kModes;
  if (found.agent == Agent::kNone) {
    // a mode that hides nothing: the links as in the lowest one
    std::size_t l = 0;
    while (l < index(neglect.num_judged) && neglect.pairs[l][0] != leaders.hidden) ++l;
    if (l == index(neglect.num_judged)) l = 0;
    if (l < neglect.named.links.size() && neglect.named.links[l] >= 0)
      found = {Agent::kLink, neglect.named.links[l], 0, 0.0};
    else if (!plan.wheels.all.empty())
      found = {Agent::kWheel, largest_wheel(state), 0, 0.0};
  }
  if (found.agent == Agent::kNone) {
    // of a plan file that does not say which: the first link of a kind that hides its inside
    const auto hides = [](const PlanLink& link) {
      return link.kind == "matrix" || link.kind == "rigid" || link.kind == "plate";
    };
    const auto link = std::find_if(plan.links.begin(), plan.links.end(), hides);
    found.agent = Agent::kLink;
    if (link != plan.links.end()) found.item = static_cast<std::int32_t>(link - plan.links.begin());
  }
  name_mode(leaders.hidden, state, found);
  return found;
}

}  // namespace freeflex
