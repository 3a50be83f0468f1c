#include "core/error/judgement.hpp"

#include <algorithm>
#include <cmath>

#include "core/error/validity.hpp"
#include "core/step/loads/field.hpp"
#include "core/step/readout.hpp"
#include "core/step/rigid/tick_rotation.hpp"
#include "core/step/vector.hpp"

namespace freeflex {
namespace {

using Level = Verdict::Level;
using Cause = Verdict::Cause;

// The peak of the displacement decays to 1 / e in this number of periods of the lowest elastic mode.
constexpr double kFadingPeriods = 30.0;
// [-] A ratio of displacement to size that is as small as this is a rounding error. Smaller displacements are
// therefore judged as if the ratio had this value.
constexpr double kRoundingDisplacement = 1e-12;
// [-] factor on the allowed displacement if every link has its true geometry
constexpr double kRoomOfTrueGeometry = 20.0;
// [-] The relative stiffness that a mode loses to internal forces and spin. The mode buckles if this value
// reaches 1.
constexpr double kGoodSoftening = 0.5, kMostSoftening = 1.0;
constexpr std::int64_t kReadsInHorizon = 8;
// [-] The error over the estimates of the steps (THEORY 12.95) and of the filter (THEORY 12.97) was at
// most 1.3 in tests/reference/corotational_test, and 2.8 in a chaotic motion of angle springs that had lost
// half of its displacement.
constexpr double kIntegrationMargin = 3.0;
// [rad] Error of the attitude due to the step of the body. At the first value, displacements had an error of
// 4 % in a measurement. At the second, the attitude is lost.
constexpr double kGoodAttitudeError = 1e-3, kLostAttitudeError = 0.1;
// [-] Rotation in a tick, over the rotation that the largest number of substeps resolves. Above a ratio of
// one half, loads may speed up the body within the tick so that the rotation is no longer resolved.
constexpr double kGoodRotation = 0.5, kMostRotation = 1.0;
// [-] Size of the body over its distance from an attractor. The first neglected term of the attractor's field
// is to the gradient term as this ratio.
constexpr double kNearAttractor = 0.02;

Verdict::Level grade(double value, double good, double most) {
  if (value <= good) return Verdict::Level::kGood;
  return value <= most ? Verdict::Level::kWatch : Verdict::Level::kOutside;
}

}  // namespace

Judgement::Judgement(const Plan& plan) : plan_(plan), responsible_(plan) {
  errors_.reserve(2);
  errors_.emplace_back(plan, plan.unmodelled);
  for (std::size_t k = 0; k < plan.fallback.size(); ++k)
    errors_.emplace_back(plan.fallback[k], plan.fallback_unmodelled[k]);
  for (const PlanPoint& point : plan.points) size_ = std::max(size_, norm(point.r));
  const Vec3& inverse = plan.principal.inverse_moment;
  if (inverse[2] > 0.0)
    uneven_inertia_ = 1.0 / inverse[2] - 1.0 / inverse[0];
  else if (inverse[1] > 0.0)
    uneven_inertia_ = 1.0 / inverse[1];
  mass_extent_ = std::max(size_, std::sqrt(uneven_inertia_ / plan.mass));
  const double lowest = lowest_omega(plan);
  if (lowest > 0.0) fade_ = std::exp(-errors_.front().round() * lowest / (2.0 * M_PI * kFadingPeriods));
  // errors of past horizons decay at the rate of the mode that decays most slowly
  const auto end = plan.decay.begin() + plan.num_elastic;
  const double slowest = plan.num_elastic > 0 ? *std::min_element(plan.decay.begin(), end) : 0.0;
  horizon_fade_ = std::exp(-slowest * plan.budget.horizon);
  if (traits_of(plan.fidelity).has_true_geometry && !plan.unmodelled.has_unquantified)
    displacement_room_ = kRoomOfTrueGeometry;
  error_per_force_ = plan.unmodelled.error_per_force;
  command_fade_ = std::exp(-slowest * plan.period);
  read_every_ = std::max<std::int64_t>(1, plan.budget.horizon_ticks / kReadsInHorizon);
}

void Judgement::begin(const State& state) noexcept {
  epoch_ = state.epoch;
  uses_fallback_ = false;
  commanded_ = 0.0;
  for (ModalErrors& errors : errors_) errors.clear();
  integration_error_ = filter_error_ = 0.0;
  steps_before_ = state.coupled.integration_error;
  peak_ = velocity_error_ = position_error_ = attractor_ratio_ = 0.0;
  attitude_error_ = rotation_ratio_ = rate_for_rotation_ = rotating_load_error_ = unresolved_ =
      unresolved_rotation_ = 0.0;
  spin_curvature_ = {};
  unresolved_mode_ = -1;
  past_ = current_ = {};
  reading_ = {};
  now_ = worst_ = {};
  worst_.tick = -1;
}

void Judgement::evaluate(const State& state, Budget* budget) noexcept {
  if (state.epoch != epoch_) begin(state);
  if (state.uses_fallback && !uses_fallback_) {
    errors_.back().join(errors_.front(), plan_.fallback_modes);
    uses_fallback_ = true;
  }
  if (error_per_force_ > 0.0) take_commands(state);
  ModalErrors& errors = errors_[uses_fallback_ ? 1 : 0];
  errors.take(state);
  if (budget != nullptr) read_error_budget(state, *budget);
  integrate_position_error(state);
  check_rotation(state);
  integration_error_ = integration_error_ * command_fade_ +
                       kIntegrationMargin * (state.coupled.integration_error - steps_before_);
  steps_before_ = state.coupled.integration_error;
  filter_error_ = kIntegrationMargin * state.coupled.filter_error;
  if (!errors.is_round_over()) return;
  peak_ = std::max(errors.size().envelope, peak_ * fade_);
  judge(state);
  if (now_.level > worst_.level) worst_ = now_;
}

void Judgement::take_steady(const State& state) noexcept {
  begin(state);
  is_steady_ = true;
  errors_.front().settle(state);
  judge(state);
}

/// Reads the error budget. The errors of successive horizons are added.
void Judgement::read_error_budget(const State& state, Budget& budget) noexcept {
  if (budget.shadows.empty() || budget.tick != state.tick || budget.epoch != state.epoch) return;
  const std::int64_t age = state.tick - budget.sync_tick;
  const bool is_over = age >= plan_.budget.horizon_ticks;
  // Reads also at ages of 1, 2, 4, ... ticks, so that readings are more frequent early in the horizon.
  const bool is_young = (age & (age - 1)) == 0;
  if (!is_over && !is_young && age % read_every_ != 0) return;
  reading_ = read_budget(plan_, state, budget);
  current_ = {reading_.total.displacement, reading_.total.position};
  if (!is_over) return;
  past_.elastic = past_.elastic * horizon_fade_ + current_.elastic;
  past_.position += current_.position;
  current_ = {};
}

/// Integrates the position error that the first neglected term of an attractor's field causes, the term after
/// the gradient (THEORY 8.19). The term accelerates the centre of mass by at most 3 mu I / (M rho^4), where I
/// is the largest minus the smallest principal moment. The term is zero if all three moments are equal
/// (THEORY X144).
void Judgement::integrate_position_error(const State& state) noexcept {
  if (plan_.attractor_mu == 0.0) return;
  const Vec3 rho = sub(state.p_WB, plan_.attractor_W);
  const double square = dot(rho, rho);
  attractor_ratio_ = std::max(attractor_ratio_, size_ / std::sqrt(square));
  velocity_error_ +=
      3.0 * plan_.attractor_mu * uneven_inertia_ / (plan_.mass * square * square) * plan_.period;
  position_error_ += velocity_error_ * plan_.period;
}

/// Checks the rotation of the body within a tick, about its centre of mass and about an attractor
/// (THEORY X144, 7.21, 7.25).
void Judgement::check_rotation(const State& state) noexcept {
  const StepPlan& plan = active_plan(plan_, state);
  if (is_coupled(plan) && plan.num_elastic > 0) return check_coupled_rotation(state);
  const Vec3 w = angular_velocity(plan, state);
  RigidLoads loads;
  loads.wheels.h[0] = wheel_momentum_B(plan, state);
  double orbit = 0.0;
  const bool is_long =
      (plan.has_rotation && may_rotate_far(plan, w, state.H_W, loads.wheels)) || may_orbit_far(plan, state);
  if (is_long) {
    loads.start.torque_B = state.moment_B;
    loads.start.force_W = state.force_W;
    const TickRotation tick = rotation_in_tick(plan, state, rotation_matrix(state.q_WB), loads);
    const double ratio = tick.substep_angle / (kSubstepRotation * kMaxRotationSubsteps);
    if (ratio > rotation_ratio_) rotation_ratio_ = ratio, rate_for_rotation_ = ratio / plan.period;
    if (tick.nearest > 0.0) attractor_ratio_ = std::max(attractor_ratio_, size_ / tick.nearest);
    orbit = tick.orbit;
  }
  estimate_spin_curvature(w);
  add_rotating_loads(state, std::max(norm(w) * plan.period, orbit));
}

/// Estimates how much the curve of the spin over time bends in a tick, by the second difference: theta^2 =
/// |w'' h^2| / |w|. Uses the smallest value of three successive ticks, because a load that begins or ends
/// bends the curve only once   (THEORY X144).
void Judgement::estimate_spin_curvature(const Vec3& w) noexcept {
  SpinCurvature& s = spin_curvature_;
  const Vec3 second = add_scaled(add(w, s.before[1]), -2.0, s.before[0]);
  const double most = std::max({norm(w), norm(s.before[0]), norm(s.before[1])});
  s.second = {most > 0.0 ? norm(second) / most : 0.0, s.second[0], s.second[1]};
  s.before = {w, s.before[0]};
  constexpr double kFade = 1.0 - 1.0 / 64.0;  // slow, because ticks may sample a nutation at equal phases
  s.angle *= kFade;
  s.num_ticks = std::min(s.num_ticks + 1, 5);
  if (s.num_ticks == 5)
    s.angle = std::max(s.angle, std::sqrt(*std::min_element(s.second.begin(), s.second.end())));
}

/// Adds the error due to loads that rotate within a tick. The step takes the loads on modes as linear over a
/// tick (THEORY 6.1), and for loads that rotate by theta this has an error of theta^2 / 8 of the load. Free
/// vibration doubles the error, to theta^2 / 4 of the quasi-static displacement (THEORY X144). Loads fixed in
/// the world and loads of an attractor rotate by theta in body axes, but loads due to spin and wheels change
/// with the spin.
/// \param rotation  [rad] rotation of the body or of the orbit in a tick
void Judgement::add_rotating_loads(const State& state, double rotation) noexcept {
  constexpr double kNegligibleAngle = 0.01;  // [rad] smaller angles change the load by less than 1e-5
  constexpr double kFullErrorAngle = 2.0;    // [rad] from this angle on, the whole displacement is the error
  rotating_load_error_ *= command_fade_;
  const StepPlan& plan = active_plan(plan_, state);
  const bool is_of_world =
      plan.attractor_mu > 0.0 || (state.num_slots > 0 && state.commands_pattern.has_world) ||
      std::ranges::any_of(plan.histories,
                          [](const PlanHistory& history) { return history.pattern.has_world; });
  const bool is_of_spin = plan.has_spin_load || !plan.wheels.empty();
  const double angle = std::min(
      kFullErrorAngle, std::max(is_of_world ? rotation : 0.0, is_of_spin ? spin_curvature_.angle : 0.0));
  if (angle < kNegligibleAngle) return;
  double sum = 0.0;
  for (std::size_t l = 0; l < index(plan.num_elastic); ++l) {
    if (plan.omega[l] == 0.0) continue;
    const double quasi_static = state.Q[l] / (plan.mass * plan.omega[l] * plan.omega[l]);
    sum += quasi_static * quasi_static;
  }
  rotating_load_error_ = std::max(rotating_load_error_, 0.25 * angle * angle * std::sqrt(sum));
}

/// Checks the step of the coupled rungs, which has order 4. Adds the error of the attitude, the sum of (w
/// h)^5 / 120 over the substeps, and a second such sum for the nutation due to wheels. Then finds modes
/// that vibrate by more than 1 rad per substep while the body rotates (THEORY X144).
void Judgement::check_coupled_rotation(const State& state) noexcept {
  const double substeps = plan_.coupled.num_substeps, substep = plan_.period / substeps,
               spin = norm(state.coupled.w_B);
  const double substep_angle = spin * substep;
  attitude_error_ += substeps * std::pow(substep_angle, 5) / 120.0;
  const bool has_wheels = std::any_of(state.wheel_momentum.begin(), state.wheel_momentum.end(),
                                      [](double momentum) { return momentum != 0.0; });
  if (has_wheels) {
    // nutation due to wheels, weighted with the component of the spin normal to the momentum of the wheels
    const Vec3 h = wheel_momentum_B(plan_, state);
    const Vec3& inverse = plan_.principal.inverse_moment;
    const double rate = norm(h) * std::sqrt(inverse[0] * inverse[1]);
    const double across = norm(cross(state.coupled.w_B, h));
    if (rate > 0.0)
      attitude_error_ +=
          substeps * std::pow(rate * substep, 5) / 120.0 * std::min(1.0, across / (rate * norm(h)));
  }
  // The method has order 4, so the error is proportional to the fourth power of the substep.
  if (attitude_error_ > kGoodAttitudeError)
    rate_for_rotation_ =
        std::max(rate_for_rotation_, std::pow(attitude_error_ / kGoodAttitudeError, 0.25) / substep);
  constexpr double kFade = 1.0 - 1.0 / 64.0;  // slow, because ticks may sample a vibration at zero rate
  // [rad] Rotation per tick that is added for unresolved vibration if there are wheels, whatever their
  // momentum. After a hundred ticks, the whole vibration is taken as an error.
  constexpr double kByWheels = 0.02;
  unresolved_ *= kFade;
  if (substep_angle == 0.0 && !has_wheels) return;
  double fast = 0.0, most = 0.0;
  const StepPlan& plan = active_plan(plan_, state);
  for (std::size_t l = 0; l < index(plan.num_elastic); ++l) {
    if (plan.omega[l] * substep <= 1.0) continue;
    const double amplitude = state.q_dot[l] / plan.omega[l];
    fast += amplitude * amplitude;
    if (amplitude * amplitude > most)
      most = amplitude * amplitude, unresolved_mode_ = static_cast<std::int32_t>(l);
  }
  if (fast == 0.0) return;
  unresolved_ = std::max(unresolved_, std::sqrt(fast));
  unresolved_rotation_ += spin * plan_.period + (has_wheels ? kByWheels : 0.0);
}

/// Updates the largest sum of commanded forces, which may excite omitted modes   (THEORY 14.9). Magnitudes
/// are summed, because forces that cancel on the kept modes may not cancel on the omitted ones.
void Judgement::take_commands(const State& state) noexcept {
  double now = 0.0;
  for (std::int32_t i = 0; i < state.num_slots; ++i) {
    const ForceCommand& command = state.slots[index(i)].command;
    for (std::int32_t k = 0; k < command.num_points; ++k) now += norm(command.points[index(k)].force);
    for (std::int32_t k = 0; k < command.num_wrenches; ++k)
      now += norm(command.wrenches[index(k)].force) + norm(command.wrenches[index(k)].torque);
    for (std::int32_t k = 0; k < command.num_torques; ++k) now += norm(command.torques[index(k)].torque);
  }
  commanded_ = std::max(now, commanded_ * command_fade_);
}

void Judgement::judge(const State& state) noexcept {
  const ModalErrorSize& own = errors_[uses_fallback_ ? 1 : 0].size();
  now_ = {};
  now_.tick = state.tick;
  now_.displacement_now = own.displacement;
  const double reference = plan_.unmodelled.tolerance > 0.0 ? plan_.unmodelled.tolerance : peak_;
  now_.scale = std::max({reference, own.displacement, kRoundingDisplacement * size_});
  const double by_reference = past_.elastic + current_.elastic;
  const double by_commands = uses_fallback_ ? 0.0 : error_per_force_ * commanded_;
  now_.error = std::hypot(std::max(own.error, by_reference), rotating_load_error_) + by_commands +
               (by_reference > 0.0 ? 0.0 : integration_error_ + filter_error_);
  now_.unquantified = own.unquantified;
  now_.position = past_.position + current_.position;
  const auto note = [this](Level level, Cause cause) {
    if (level > now_.level) now_.level = level, now_.cause = cause;
  };
  if (reading_.is_lost) note(Level::kOutside, Cause::kLost);
  // the reference solution does not resolve a vibration while the body rotates   (THEORY 12.27)
  if (reading_.unresolved > kGoodElastic) note(Level::kWatch, Cause::kUnresolved);
  Cause cause = Cause::kStiffness;
  if (by_reference > own.error) {
    const double model = reading_.model.elastic, integration = reading_.integration.elastic,
                 truncation = reading_.truncation.elastic;
    cause = integration > std::max(model, truncation) ? Cause::kIntegration
            : truncation > model                      ? Cause::kTruncation
                                                      : Cause::kModel;
  } else if (integration_error_ + filter_error_ > 0.7 * now_.error) {
    cause = Cause::kIntegration;
  } else if (rotating_load_error_ > 0.7 * own.error) {
    cause = Cause::kStep;
  } else if (std::max(by_commands, plan_.unmodelled.left_out) > 0.7 * own.error) {
    cause = Cause::kTruncation;
  } else if (own.second_order > 0.7 * own.error) {
    cause = Cause::kDeformation;
  } else if (own.spin > 0.7 * own.error) {
    cause = Cause::kSpinLoad;
  }
  // If there is no deformation, the error is zero. If there is only a single body, the scale is zero too.
  const auto ratio = [this](double error) { return error == 0.0 ? 0.0 : error / now_.scale; };
  note(grade(ratio(now_.error), kGoodElastic, kMostElastic), cause);
  note(grade(own.softening, kGoodSoftening, kMostSoftening), Cause::kBuckling);
  if (size_ > 0.0) {
    note(grade(now_.position / size_, kGoodPosition, kMostPosition), Cause::kPosition);
    note(grade(own.displacement / size_ / displacement_room_, kGoodDisplacement, kMostDisplacement),
         Cause::kSize);
  }
  // If the error is above the limit only with its unquantified part, the verdict is `watch`.
  if (ratio(now_.error + now_.unquantified) > kGoodElastic) note(Level::kWatch, Cause::kUnquantified);
  // If modes were not kept, not even their quasi-static response is known.
  if (plan_.unmodelled.lacks_modes == LacksModes::kNotKept &&
      (own.displacement > 0.0 || !is_zero(state.force_W) || !is_zero(state.H_W)))
    note(Level::kWatch, Cause::kNotKept);
  if (plan_.unmodelled.has_unquantified && size_ > 0.0 && own.displacement / size_ > kGoodUnquantified)
    note(Level::kWatch, Cause::kUnquantified);
  if (position_error_ > kGoodPosition * mass_extent_ || attractor_ratio_ > kNearAttractor)
    note(Level::kWatch, Cause::kAttractor);
  const double unresolved = std::min(2.0, unresolved_rotation_) * unresolved_;
  note(grade(rotation_ratio_, kGoodRotation, kMostRotation), Cause::kStep);
  note(grade(attitude_error_, kGoodAttitudeError, kLostAttitudeError), Cause::kStep);
  if (unresolved > kGoodElastic * now_.scale) note(Level::kWatch, Cause::kStep);
  if (rotation_ratio_ > kGoodRotation || attitude_error_ > kGoodAttitudeError) now_.rate = rate_for_rotation_;
  if (!is_steady_ && !plan_.unmodelled.fast_loads.empty()) note(Level::kWatch, Cause::kFastLoad);
  if (plan_.unmodelled.is_rigid && (!is_zero(state.force_W) || !is_zero(state.H_W)))
    note(Level::kWatch, Cause::kRigid);
  if (!plan_.unmodelled.is_known) note(Level::kWatch, Cause::kUnknown);
  if (now_.level != Level::kGood) name_responsible(state, by_commands);
}

/// Finds the item that the message reports together with the cause. The item does not affect the verdict.
void Judgement::name_responsible(const State& state, double by_commands) noexcept {
  const ModalErrors& errors = errors_[uses_fallback_ ? 1 : 0];
  const ModalLeaders& leaders = errors.leaders();
  Responsible& named = now_.responsible;
  if (is_steady_ && (now_.cause == Cause::kStiffness || now_.cause == Cause::kBuckling)) {
    const bool buckles = now_.cause == Cause::kBuckling;
    named = responsible_.of_steady(
        errors, {buckles ? leaders.softest : leaders.error, buckles && leaders.is_left_out}, state);
    return;
  }
  switch (now_.cause) {
    case Cause::kStiffness:
      named = responsible_.of_stiffness(errors, leaders.error, state);
      break;
    case Cause::kBuckling:
      named = responsible_.of_buckling(errors, state);
      break;
    case Cause::kDeformation:
    case Cause::kSize:
      named = responsible_.of_displacement(leaders.displaced, state);
      break;
    case Cause::kUnquantified:
      named = responsible_.of_unquantified(leaders, state);
      break;
    case Cause::kTruncation:
      if (by_commands > std::max(plan_.unmodelled.left_out, reading_.truncation.elastic))
        named.agent = Responsible::Agent::kCommands;
      break;
    case Cause::kFastLoad:
      named = responsible_.of_fast_load(state);
      break;
    case Cause::kStep:
      if (attitude_error_ > kGoodAttitudeError || rotation_ratio_ > kGoodRotation)
        named.agent = Responsible::Agent::kSpin;
      else if (rotating_load_error_ > 0.0)  // below the coupled rungs, all vibration is resolved
        named.agent = Responsible::Agent::kLoad;
      else
        named = responsible_.of_vibration(unresolved_mode_, state);
      break;
    default:
      break;
  }
}

Verdict judge_steady(const Plan& plan, const State& state) {
  Judgement judgement(plan);
  judgement.take_steady(state);
  return judgement.now();
}

}  // namespace freeflex
