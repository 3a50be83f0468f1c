#include "core/validity/judgement.hpp"

#include <algorithm>
#include <cmath>

#include "core/step/field.hpp"
#include "core/step/readout.hpp"
#include "core/step/tick_turn.hpp"
#include "core/step/vector.hpp"
#include "core/validity/validity.hpp"

namespace freeflex {
namespace {

// [periods] of the lowest elastic mode in which the peak falls to 1 / e
constexpr double kFadingPeriods = 30.0;
// [-] of the size: displacements below that are rounding, and judged as if they were so large
constexpr double kNothing = 1e-12;
// more displacement where every link has its true geometry
constexpr double kRoomOfTrueBars = 20.0;
// [-] of the stiffness of a mode, lost to internal forces and spin: at 1 it buckles
constexpr double kGoodSoftening = 0.5, kMostSoftening = 1.0;
constexpr std::int64_t kLooksInHorizon = 8;
// [rad] by which the step of the body may be off: 4 % of the displacements where it was measured; and where
// nothing that it turns is right
constexpr double kGoodTurn = 1e-3, kLostTurn = 0.1;
// [-] of what the most substeps resolve: beyond half of it loads may carry a body out of it within a tick
constexpr double kGoodShare = 0.5, kMostShare = 1.0;
// [-] size over distance of an attractor: the first term that is left out is as large beside the gradient
constexpr double kNearAttractor = 0.02;

Verdict::Word grade(double value, double good, double most) {
  if (value <= good) return Verdict::Word::kGood;
  return value <= most ? Verdict::Word::kWatch : Verdict::Word::kOutside;
}

}  // namespace

Judgement::Judgement(const Plan& plan) : plan_(plan), responsible_(plan) {
  errors_.emplace_back(plan);
  for (const Plan& wide : plan.wide) errors_.emplace_back(wide);
  for (const PlanPoint& point : plan.points) size_ = std::max(size_, norm(point.r));
  const Vec3& inverse = plan.principal.inverse_moment;
  if (inverse[2] > 0.0)
    uneven_inertia_ = 1.0 / inverse[2] - 1.0 / inverse[0];
  else if (inverse[1] > 0.0)
    uneven_inertia_ = 1.0 / inverse[1];
  extent_ = std::max(size_, std::sqrt(uneven_inertia_ / plan.mass));
  const double lowest = lowest_omega(plan);
  if (lowest > 0.0) fade_ = std::exp(-errors_.front().round() * lowest / (2.0 * M_PI * kFadingPeriods));
  // errors of horizons that are over fade as the slowest mode does
  const auto end = plan.decay.begin() + plan.num_elastic;
  const double slowest = plan.num_elastic > 0 ? *std::min_element(plan.decay.begin(), end) : 0.0;
  beside_fade_ = std::exp(-slowest * plan.budget.horizon);
  const auto bends = [](const PlanLink& link) {
    return link.kind != "spring" && link.kind != "bar" && link.kind != "dashpot";
  };
  if (traits_of(plan.fidelity).has_true_geometry && std::none_of(plan.links.begin(), plan.links.end(), bends))
    room_ = kRoomOfTrueBars;
  for (const PlanPart& part : plan.parts) error_per_push_ = std::max(error_per_push_, part.error_per_force);
  push_fade_ = std::exp(-slowest * plan.period);
  look_every_ = std::max<std::int64_t>(1, plan.budget.horizon_ticks / kLooksInHorizon);
}

void Judgement::begin(const State& state) noexcept {
  epoch_ = state.epoch;
  is_wide_ = false;
  pushed_ = 0.0;
  for (ModalErrors& errors : errors_) errors.clear();
  peak_ = fall_rate_ = fall_ = attractor_share_ = 0.0;
  turn_error_ = turn_share_ = rate_for_turn_ = bent_ = unresolved_ = unresolved_turn_ = 0.0;
  swing_ = {};
  unresolved_mode_ = -1;
  over_ = running_ = {};
  reading_ = {};
  now_ = worst_ = {};
  worst_.tick = -1;
}

void Judgement::take(const State& state, Budget& budget) noexcept {
  if (state.epoch != epoch_) begin(state);
  if (state.is_wide && !is_wide_) {
    errors_.back().join(errors_.front(), plan_.wide_modes);
    is_wide_ = true;
  }
  if (error_per_push_ > 0.0) take_pushes(state);
  ModalErrors& errors = errors_[is_wide_ ? 1 : 0];
  errors.take(state);
  read_beside(state, budget);
  fall(state);
  turn(state);
  if (!errors.is_round_over()) return;
  peak_ = std::max(errors.size().envelope, peak_ * fade_);
  judge(state);
  if (now_.word > worst_.word) worst_ = now_;
}

void Judgement::take_steady(const State& state) noexcept {
  begin(state);
  is_steady_ = true;
  errors_.front().settle(state);
  judge(state);
}

/// The error budget: horizons that begin anew add up.
void Judgement::read_beside(const State& state, Budget& budget) noexcept {
  if (budget.shadows.empty() || budget.tick != state.tick || budget.epoch != state.epoch) return;
  const std::int64_t age = state.tick - budget.sync_tick;
  const bool is_over = age >= plan_.budget.horizon_ticks;
  // often while the horizon is young
  const bool is_young = (age & (age - 1)) == 0;
  if (!is_over && !is_young && age % look_every_ != 0) return;
  reading_ = read_budget(plan_, state, budget);
  running_ = {reading_.total.displacement, reading_.total.position};
  if (!is_over) return;
  over_.elastic = over_.elastic * beside_fade_ + running_.elastic;
  over_.position += running_.position;
  running_ = {};
}

/// What an attractor's field has beyond its gradient: its part on the centre of mass is at most
/// 3 mu I / (M rho^4), I the difference of the largest and the least moment, and moves it as a force does; a
/// body with three equal moments feels none   (X72).
void Judgement::fall(const State& state) noexcept {
  if (plan_.attractor_mu == 0.0) return;
  const Vec3 rho = sub(state.p_WB, plan_.attractor_W);
  const double square = dot(rho, rho);
  attractor_share_ = std::max(attractor_share_, size_ / std::sqrt(square));
  fall_rate_ += 3.0 * plan_.attractor_mu * uneven_inertia_ / (plan_.mass * square * square) * plan_.period;
  fall_ += fall_rate_ * plan_.period;
}

/// X144: how far the body turns in a tick, in itself and about an attractor.
void Judgement::turn(const State& state) noexcept {
  const Plan& plan = active_plan(plan_, state);
  if (is_coupled(plan) && plan.num_elastic > 0) return turn_coupled(state);
  const Vec3 w = angular_velocity(plan, state);
  StepLoads loads;
  loads.wheels.h[0] = wheel_momentum_B(plan, state);
  double orbit = 0.0;
  const bool is_long =
      (plan.turns && may_turn_long(plan, w, state.H_W, loads.wheels)) || may_fall_long(plan, state);
  if (is_long) {
    loads.start.torque_B = state.moment_B;
    loads.start.force_W = state.force_W;
    const TickTurn tick = turn_in_tick(plan, state, rotation_matrix(state.q_WB), loads);
    const double share = tick.uneven / (kUnevenTurn * kMostSubsteps);
    if (share > turn_share_) turn_share_ = share, rate_for_turn_ = share / plan.period;
    if (tick.nearest > 0.0) attractor_share_ = std::max(attractor_share_, size_ / tick.nearest);
    orbit = tick.orbit;
  }
  swing(w);
  bend_loads(state, std::max(norm(w) * plan.period, orbit));
}

/// How far the spin swings in a tick, by its second difference, theta^2 of it: the least of three ticks in a
/// row, for loads that begin or end bend it once.
void Judgement::swing(const Vec3& w) noexcept {
  Swing& s = swing_;
  const Vec3 second = add_scaled(add(w, s.before[1]), -2.0, s.before[0]);
  const double most = std::max({norm(w), norm(s.before[0]), norm(s.before[1])});
  s.second = {most > 0.0 ? norm(second) / most : 0.0, s.second[0], s.second[1]};
  s.before = {w, s.before[0]};
  constexpr double kFade = 1.0 - 1.0 / 64.0;  // a sampled nutation may come to the same place
  s.angle *= kFade;
  s.num_ticks = std::min(s.num_ticks + 1, 5);
  if (s.num_ticks == 5)
    s.angle = std::max(s.angle, std::sqrt(*std::min_element(s.second.begin(), s.second.end())));
}

/// Modes take what loads them as straight over a tick, and are off by theta^2 / 8 of it, twice for what rings
/// (X13): loads that are fixed in the world, and an attractor's, turn by theta in the axes of the body; what
/// spin and wheels do changes as the spin does.  \param turn  [rad] of the body or the orbit in a tick
void Judgement::bend_loads(const State& state, double turn) noexcept {
  constexpr double kStraight = 0.01;  // [rad] 1e-5 of the load
  constexpr double kWhole = 2.0;      // [rad] all of what they displace is off then
  bent_ *= push_fade_;
  const Plan& plan = active_plan(plan_, state);
  const bool is_of_world =
      plan.attractor_mu > 0.0 || (state.num_slots > 0 && state.commands_pattern.has_world) ||
      std::ranges::any_of(plan.histories,
                          [](const PlanHistory& history) { return history.pattern.has_world; });
  const bool is_of_spin = plan.has_spin_load || !plan.wheels.all.empty();
  const double angle = std::min(kWhole, std::max(is_of_world ? turn : 0.0, is_of_spin ? swing_.angle : 0.0));
  if (angle < kStraight) return;
  double sum = 0.0;
  for (std::size_t l = 0; l < static_cast<std::size_t>(plan.num_elastic); ++l) {
    if (plan.omega[l] == 0.0) continue;
    const double displaced = state.Q[l] / (plan.mass * plan.omega[l] * plan.omega[l]);
    sum += displaced * displaced;
  }
  bent_ = std::max(bent_, 0.25 * angle * angle * std::sqrt(sum));
}

/// Rungs that couple step the turning body by order four, and what vibrates must be resolved where it turns.
void Judgement::turn_coupled(const State& state) noexcept {
  const double parts = plan_.coupled.num_parts, part = plan_.period / parts, spin = norm(state.coupled.w_B);
  const double step = spin * part;
  turn_error_ += parts * std::pow(step, 5) / 120.0;
  const bool has_wheels = std::any_of(state.wheel_momentum.begin(), state.wheel_momentum.end(),
                                      [](double momentum) { return momentum != 0.0; });
  if (has_wheels) {
    // the nutation of body and wheels, as far as the body does not turn about the axis of the wheels
    const Vec3 h = wheel_momentum_B(plan_, state);
    const Vec3& inverse = plan_.principal.inverse_moment;
    const double rate = norm(h) * std::sqrt(inverse[0] * inverse[1]);
    const double across = norm(cross(state.coupled.w_B, h));
    if (rate > 0.0)
      turn_error_ += parts * std::pow(rate * part, 5) / 120.0 * std::min(1.0, across / (rate * norm(h)));
  }
  // order four: the error goes with the fourth power of a part
  if (turn_error_ > kGoodTurn)
    rate_for_turn_ = std::max(rate_for_turn_, std::pow(turn_error_ / kGoodTurn, 0.25) / part);
  constexpr double kFade = 1.0 - 1.0 / 64.0;  // of a tick: a sampled motion may stand at its turning points
  // [rad] a tick that a wheel turns what vibrates unresolved by, whatever its momentum: all is off in a
  // hundred
  constexpr double kByWheels = 0.02;
  unresolved_ *= kFade;
  if (step == 0.0 && !has_wheels) return;
  double fast = 0.0, most = 0.0;
  const Plan& plan = active_plan(plan_, state);
  for (std::size_t l = 0; l < static_cast<std::size_t>(plan.num_elastic); ++l) {
    if (plan.omega[l] * part <= 1.0) continue;
    const double amplitude = state.q_dot[l] / plan.omega[l];
    fast += amplitude * amplitude;
    if (amplitude * amplitude > most)
      most = amplitude * amplitude, unresolved_mode_ = static_cast<std::int32_t>(l);
  }
  if (fast == 0.0) return;
  unresolved_ = std::max(unresolved_, std::sqrt(fast));
  unresolved_turn_ += spin * plan_.period + (has_wheels ? kByWheels : 0.0);
}

/// X124: what pushes can do to modes that are left out. Forces that would cancel in what is kept add up.
void Judgement::take_pushes(const State& state) noexcept {
  double now = 0.0;
  for (std::int32_t i = 0; i < state.num_slots; ++i) {
    const ForceCommand& command = state.slots[index(i)].command;
    for (std::int32_t k = 0; k < command.num_points; ++k) now += norm(command.points[index(k)].force);
    for (std::int32_t k = 0; k < command.num_wrenches; ++k)
      now += norm(command.wrenches[index(k)].force) + norm(command.wrenches[index(k)].torque);
    for (std::int32_t k = 0; k < command.num_torques; ++k) now += norm(command.torques[index(k)].torque);
  }
  pushed_ = std::max(now, pushed_ * push_fade_);
}

void Judgement::judge(const State& state) noexcept {
  using Word = Verdict::Word;
  using Cause = Verdict::Cause;
  const ModalErrorSize& own = errors_[is_wide_ ? 1 : 0].size();
  now_ = {};
  now_.tick = state.tick;
  now_.displacement_now = own.displacement;
  const double matters = plan_.neglect.tolerance > 0.0 ? plan_.neglect.tolerance : peak_;
  now_.scale = std::max({matters, own.displacement, kNothing * size_});
  const double beside = over_.elastic + running_.elastic;
  const double by_pushes = is_wide_ ? 0.0 : error_per_push_ * pushed_;
  now_.error = std::hypot(std::max(own.seen, beside), bent_) + by_pushes;
  now_.unseen = own.unseen;
  now_.position = over_.position + running_.position;
  const auto note = [this](Word word, Cause cause) {
    if (word > now_.word) now_.word = word, now_.cause = cause;
  };
  if (reading_.is_lost) note(Word::kOutside, Cause::kLost);
  if (reading_.unresolved > kGoodElastic) note(Word::kWatch, Cause::kUnresolved);
  Cause cause = Cause::kStiffness;
  if (beside > own.seen) {
    const double model = reading_.model.elastic, integration = reading_.integration.elastic,
                 truncation = reading_.truncation.elastic;
    cause = integration > std::max(model, truncation) ? Cause::kIntegration
            : truncation > model                      ? Cause::kTruncation
                                                      : Cause::kModel;
  } else if (bent_ > 0.7 * own.seen) {
    cause = Cause::kStep;
  } else if (std::max(by_pushes, plan_.neglect.left_out) > 0.7 * own.seen) {
    cause = Cause::kTruncation;
  } else if (own.amplitude > 0.7 * own.seen) {
    cause = Cause::kDeformation;
  } else if (own.spin > 0.7 * own.seen) {
    cause = Cause::kSpinLoad;
  }
  // nothing is off where nothing deforms, one body among it, which has no size
  const auto share = [this](double error) { return error == 0.0 ? 0.0 : error / now_.scale; };
  note(grade(share(now_.error), kGoodElastic, kMostElastic), cause);
  note(grade(own.softening, kGoodSoftening, kMostSoftening), Cause::kBuckling);
  if (size_ > 0.0) {
    note(grade(now_.position / size_, kGoodPosition, kMostPosition), Cause::kPosition);
    note(grade(own.displacement / size_ / room_, kGoodDisplacement, kMostDisplacement), Cause::kSize);
  }
  // what cannot be known is at best watch
  if (share(now_.error + now_.unseen) > kGoodElastic) note(Word::kWatch, Cause::kUnseen);
  // nothing is known of modes that were not kept, not even what loads do to them statically
  if (plan_.neglect.lacks_modes == LacksModes::kNotKept &&
      (own.displacement > 0.0 || !is_zero(state.force_W) || !is_zero(state.H_W)))
    note(Word::kWatch, Cause::kNotKept);
  if (plan_.neglect.has_unseen && size_ > 0.0 && own.displacement / size_ > kGoodUnseen)
    note(Word::kWatch, Cause::kUnseen);
  if (fall_ > kGoodPosition * extent_ || attractor_share_ > kNearAttractor)
    note(Word::kWatch, Cause::kAttractor);
  const double unresolved = std::min(2.0, unresolved_turn_) * unresolved_;
  note(grade(turn_share_, kGoodShare, kMostShare), Cause::kStep);
  note(grade(turn_error_, kGoodTurn, kLostTurn), Cause::kStep);
  if (unresolved > kGoodElastic * now_.scale) note(Word::kWatch, Cause::kStep);
  if (turn_share_ > kGoodShare || turn_error_ > kGoodTurn) now_.rate = rate_for_turn_;
  if (!is_steady_ && !plan_.neglect.fast_loads.empty()) note(Word::kWatch, Cause::kFastLoad);
  if (plan_.neglect.is_rigid && (!is_zero(state.force_W) || !is_zero(state.H_W)))
    note(Word::kWatch, Cause::kRigid);
  if (!plan_.neglect.is_known) note(Word::kWatch, Cause::kUnknown);
  if (now_.word != Word::kGood) name_responsible(state, by_pushes);
}

/// What a message names beside the cause. Nothing of it goes into the word.
void Judgement::name_responsible(const State& state, double by_pushes) noexcept {
  using Cause = Verdict::Cause;
  const ModalErrors& errors = errors_[is_wide_ ? 1 : 0];
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
    case Cause::kUnseen:
      named = responsible_.of_hidden(leaders, state);
      break;
    case Cause::kTruncation:
      if (by_pushes > std::max(plan_.neglect.left_out, reading_.truncation.elastic))
        named.agent = Responsible::Agent::kCommands;
      break;
    case Cause::kFastLoad:
      named = responsible_.of_fast_load(state);
      break;
    case Cause::kStep:
      if (turn_error_ > kGoodTurn || turn_share_ > kGoodShare)
        named.agent = Responsible::Agent::kSpin;
      else if (bent_ > 0.0)  // below the coupled rungs, where nothing is unresolved
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
