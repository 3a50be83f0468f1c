#include "core/error/responsible.hpp"

#include <algorithm>
#include <cmath>

#include "core/error/validity.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/loads/history.hpp"
#include "core/step/loads/loads.hpp"
#include "core/step/readout.hpp"
#include "core/step/vector.hpp"

namespace freeflex {
namespace {

using Agent = Responsible::Agent;

double squared(double x) { return x * x; }

std::int32_t largest_wheel(const State& state) noexcept {
  std::size_t largest = 0;
  for (std::size_t k = 1; k < state.wheel_momentum.size(); ++k)
    if (std::abs(state.wheel_momentum[k]) > std::abs(state.wheel_momentum[largest])) largest = k;
  return static_cast<std::int32_t>(largest);
}

/// Returns the tables of the plan on which a state is stepped.
const PlanUnmodelled& unmodelled_of(const Plan& plan, const MotionState& state) noexcept {
  return state.uses_fallback ? plan.fallback_unmodelled.front() : plan.unmodelled;
}

}  // namespace

bool hides_forces(const PlanLink& link) { return traits_of(link.type).hides_forces; }

ResponsibleFinder::ResponsibleFinder(const Plan& plan) : plan_(plan) {
  const std::size_t num_masses = plan.points.size() + plan.particles.all.size();
  std::size_t padded = index(plan.num_padded);
  for (const StepPlan& fallback : plan.fallback) padded = std::max(padded, index(fallback.num_padded));
  Q_.resize(padded);
  rest_.resize(padded);  // large enough for the state on either plan
  if (is_coupled(plan)) forces_.resize(num_masses);
}

void ResponsibleFinder::name_mode(std::int32_t mode, const State& state, Responsible& named) const noexcept {
  if (mode < 0) return;
  const StepPlan& plan = active_plan(plan_, state);
  const auto l = index(mode);
  named.mode = plan.mode_numbers.empty() ? mode + 1 : plan.mode_numbers[l];
  named.frequency = plan.omega[l] / (2.0 * M_PI);
}

void ResponsibleFinder::name_mode(const JudgedMode& mode, const State& state,
                                  Responsible& named) const noexcept {
  if (!mode.is_left_out) return name_mode(mode.mode, state, named);
  const PlanNamed& names = unmodelled_of(plan_, state).named;
  if (const auto l = index(mode.mode); l < names.left_out.size()) {
    named.mode = names.left_out[l];
    named.frequency = names.left_out_frequency[l];
  }
}

/// Overwrites Q_ with the generalized forces of a load at amplitude 1.
void ResponsibleFinder::project_load(const StepPlan& plan, const LoadPattern& pattern,
                                     const Mat3& R_WB) noexcept {
  const std::size_t padded = index(plan.num_padded);
  std::fill(Q_.begin(), Q_.end(), 0.0);
  if (is_coupled(plan)) {
    std::fill(forces_.begin(), forces_.end(), Vec3{});
    add_point_forces(plan, pattern, R_WB, 1.0, {}, forces_);
    for (std::size_t i = 0; i < forces_.size(); ++i)
      if (!is_zero(forces_[i]))
        combine_rows(point_rows(plan, mass_point(plan, static_cast<std::int32_t>(i)).row), forces_[i], true,
                     padded, Q_.data());
    for (std::size_t k = 0; k < pattern.sums.torque_W.size(); ++k)
      combine_rows(rotation_rows(plan, static_cast<std::int32_t>(k)),
                   add(multiply_transposed(R_WB, pattern.sums.torque_W[k]), pattern.sums.torque_B[k]), true,
                   padded, Q_.data());
  } else {
    project(plan, pattern, R_WB, 1.0, false, Q_.data());
  }
  for (std::size_t k = 0; k < pattern.wheel_torques.size(); ++k)
    if (const double torque = pattern.wheel_torques[k]; torque != 0.0) {
      const PlanWheel& wheel = plan.wheels[k];
      combine_rows(rotation_rows(plan, wheel.attitude_index), scale(-torque, wheel.axis), true, padded,
                   Q_.data());
    }
}

/// Calls visit(load, history, now, largest) for each load that acts, while Q_ holds the generalized forces of
/// this load at amplitude 1. `now` is the amplitude of the load at this tick, and `largest` is the amplitude
/// to judge. For a sine, `largest` is the peak. For commands, `history` is nullptr.
template <typename Visit>
void ResponsibleFinder::for_each_load(const State& state, const Visit& visit) noexcept {
  const StepPlan& plan = active_plan(plan_, state);
  const Mat3 R_WB = rotation_matrix(state.q_WB);
  // no load has acted before the first step
  const std::int64_t age = state.tick - state.epoch_start_tick;
  for (std::size_t k = 0; k < plan.histories.size() && age > 0; ++k) {
    const PlanHistory& history = plan.histories[k];
    const double now = amplitude_left(history, plan.period, age);
    const bool is_sine = history.kind == PlanHistory::Kind::kSine;
    if (now == 0.0 && !is_sine) continue;
    project_load(plan, history.pattern, R_WB);
    visit(Responsible{Agent::kLoad, static_cast<std::int32_t>(k), 0, 0.0}, &history, now,
          is_sine ? 1.0 : now);
  }
  if (state.num_slots == 0) return;
  project_load(plan, state.commands_pattern, R_WB);
  visit(Responsible{Agent::kCommands, -1, 0, 0.0}, nullptr, 1.0, 1.0);
}

Responsible ResponsibleFinder::of_buckling(const ModalErrors& errors, const State& state) noexcept {
  const ModalLeaders& leaders = errors.leaders();
  return most_of_stiffness(errors, {leaders.softest, leaders.is_left_out}, true, state);
}

Responsible ResponsibleFinder::of_stiffness(const ModalErrors& errors, std::int32_t mode,
                                            const State& state) noexcept {
  return most_of_stiffness(errors, {mode, false}, false, state);
}

Responsible ResponsibleFinder::most_of_stiffness(const ModalErrors& errors, const JudgedMode& mode,
                                                 bool is_softened, const State& state) noexcept {
  const StepPlan& plan = active_plan(plan_, state);
  const std::vector<double>& flexibility = errors.flexibility();
  Responsible found;
  double most = 0.0;
  std::copy(state.Q.begin(), state.Q.end(), rest_.begin());
  for_each_load(state, [&](const Responsible& load, const PlanHistory* history, double now, double largest) {
    for (std::size_t u = 0; u < rest_.size(); ++u) rest_[u] -= now * Q_[u];
    double change = 0.0;
    if (mode.mode < 0) {  // if no mode is given: the load with the largest quasi-static displacement
      for (std::size_t u = 0; u < flexibility.size(); ++u) change += squared(Q_[u] * flexibility[u]);
      change = std::abs(largest) * std::sqrt(change);
    } else {
      const double of_plan =
          history != nullptr ? errors.stiffened_by(mode, *history) : errors.stiffened_by_commands(mode);
      change = largest * (errors.stiffness_by(mode, Q_.data()) - of_plan);
      // A load that stiffens the mode does not soften it, but a sine stiffens and softens it alternately.
      const bool pulsates = history != nullptr && history->kind == PlanHistory::Kind::kSine;
      change = is_softened && !pulsates ? -change : std::abs(change);
    }
    if (change > most) most = change, found = load;
  });
  StiffnessChanges changes = errors.stiffness_changes(mode, state);
  if (is_softened) changes.vibration = changes.wheel = 0.0;  // only quasi-static terms reduce the stiffness
  // the quasi-static displacement that no load causes comes from the spin or from the gradient of a field
  const double quasi_static_change = std::abs(errors.stiffness_by(mode, rest_.data()));
  const Vec3 w = angular_velocity(plan, state), rho = sub(state.p_WB, plan.attractor_W);
  const double distance = std::sqrt(dot(rho, rho));
  const bool has_attractor = plan.attractor_mu > 0.0,
             spins = dot(w, w) > 0.0 &&
                     (!has_attractor || dot(w, w) * distance * distance * distance >= plan.attractor_mu);
  const double by_spin = changes.spin + (spins ? quasi_static_change : 0.0),
               by_orbit = has_attractor && !spins ? quasi_static_change : 0.0;
  const auto propose = [&](Agent agent, std::int32_t item, double change) {
    if (change > most) most = change, found = {agent, item, 0, 0.0};
  };
  propose(Agent::kWheel, changes.largest_wheel, changes.wheel);
  propose(Agent::kSpin, -1, by_spin);
  propose(Agent::kOrbit, -1, by_orbit);
  propose(Agent::kVibration, -1, changes.vibration);
  if (found.agent == Agent::kNone) found.agent = Agent::kVibration;
  name_mode(mode, state, found);
  return found;
}

Responsible ResponsibleFinder::of_steady(const ModalErrors& errors, const JudgedMode& mode,
                                         const State& state) noexcept {
  const StepPlan& plan = active_plan(plan_, state);
  std::copy(state.Q.begin(), state.Q.end(), rest_.begin());
  std::fill(Q_.begin(), Q_.end(), 0.0);
  if (plan.has_spin_load && !is_zero(state.H_W)) {
    const Vec3 w = angular_velocity(plan, state);
    const double square = dot(w, w);
    const std::size_t padded = index(plan.num_padded);
    combine_rows(plan.field_rows.data(), {square - w[0] * w[0], square - w[1] * w[1], square - w[2] * w[2]},
                 true, padded, Q_.data());
    combine_rows(plan.field_rows.data() + 3 * padded,
                 {-2.0 * w[0] * w[1], -2.0 * w[0] * w[2], -2.0 * w[1] * w[2]}, true, padded, Q_.data());
    for (std::size_t u = 0; u < rest_.size(); ++u) rest_[u] -= Q_[u];
  }
  const double by_load = std::abs(errors.stiffness_by(mode, rest_.data())),
               by_spin = std::abs(errors.stiffness_by(mode, Q_.data())) +
                         errors.stiffness_changes(mode, state).spin;
  Responsible found{by_spin > by_load ? Agent::kSpin : Agent::kCommands, -1, 0, 0.0};
  name_mode(mode, state, found);
  return found;
}

Responsible ResponsibleFinder::of_displacement(std::int32_t mode, const State& state) noexcept {
  Responsible found;
  if (mode >= 0) {
    const StepPlan& plan = active_plan(plan_, state);
    const auto l = index(mode);
    const double stiffness = plan.mass * squared(plan.omega[l]),
                 quasi_static = stiffness > 0.0 ? state.Q[l] / stiffness : 0.0;
    double most = 0.0;
    if (std::abs(quasi_static) > std::abs(state.q[l] - quasi_static))
      for_each_load(state, [&](const Responsible& load, const PlanHistory*, double now, double) {
        if (const double force = std::abs(now * Q_[l]); force > most) most = force, found = load;
      });
  }
  if (found.agent == Agent::kNone) found.agent = Agent::kVibration;
  name_mode(mode, state, found);
  return found;
}

Responsible ResponsibleFinder::of_fast_load(const State& state) noexcept {
  const StepPlan& plan = active_plan(plan_, state);
  const Mat3 R_WB = rotation_matrix(state.q_WB);
  Responsible found;
  double most = -1.0;
  for (const std::int32_t load : unmodelled_of(plan_, state).fast_loads) {
    const PlanHistory& history = plan.histories[index(load)];
    project_load(plan, history.pattern, R_WB);
    double size = norm(history.pattern.force_W) + norm(history.pattern.force_B);
    for (std::size_t l = 0; l < index(plan.num_elastic); ++l) size = std::hypot(size, Q_[l]);
    double amplitude = history.values.empty() ? 1.0 : 0.0;
    for (const double value : history.values) amplitude = std::max(amplitude, std::abs(value));
    size *= amplitude;
    if (size > most) most = size, found = {Agent::kLoad, load, 0, 0.0};
  }
  return found;
}

Responsible ResponsibleFinder::of_vibration(std::int32_t mode, const State& state) const noexcept {
  Responsible found{Agent::kVibration, -1, 0, 0.0};
  name_mode(mode, state, found);
  return found;
}

Responsible ResponsibleFinder::of_unquantified(const ModalLeaders& leaders,
                                               const State& state) const noexcept {
  const StepPlan& plan = active_plan(plan_, state);
  const PlanUnmodelled& unmodelled = unmodelled_of(plan_, state);
  Responsible found;
  if (leaders.wheel >= 0)
    found = {Agent::kWheel, leaders.wheel, 0, 0.0};
  else if (!unmodelled.has_unquantified)
    found.agent = unmodelled.lacks_modes != LacksModes::kNone ? Agent::kModes : Agent::kRate;
  if (found.agent == Agent::kNone) {
    // If no judged mode has an unquantified error, use the link of the lowest mode.
    std::size_t l = 0;
    while (l < index(unmodelled.num_judged) && unmodelled.pairs[l][0] != leaders.unquantified) ++l;
    if (l == index(unmodelled.num_judged)) l = 0;
    if (l < unmodelled.named.links.size() && unmodelled.named.links[l] >= 0)
      found = {Agent::kLink, unmodelled.named.links[l], 0, 0.0};
    else if (!plan.wheels.empty())
      found = {Agent::kWheel, largest_wheel(state), 0, 0.0};
  }
  if (found.agent == Agent::kNone) {
    // If the plan file does not contain the link, use the first link whose internal forces are unknown.
    const auto link = std::find_if(plan.links.begin(), plan.links.end(), hides_forces);
    found.agent = Agent::kLink;
    if (link != plan.links.end()) found.item = static_cast<std::int32_t>(link - plan.links.begin());
  }
  name_mode(leaders.unquantified, state, found);
  return found;
}

}  // namespace freeflex
