#include "core/error/judgement.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/step/readout.hpp"
#include "core/step/vector.hpp"

namespace freeflex {
namespace {

using Level = Verdict::Level;
using Cause = Verdict::Cause;

// [-] A ratio of displacement to size that is as small as this is not judged   (THEORY 15.7).
constexpr double kLeastDisplacement = 1e-9;
// [-] Size of the body over its distance from an attractor. The first neglected term of the attractor's field
// is to the gradient term as this ratio.
constexpr double kNearAttractor = 0.02;
// [-] Share of the forces of a vibration that is taken to be along links, where it changes their stiffness.
constexpr double kAlong = 0.2;
// [-] Share by which a displacement of the size of the body may change the stiffness inside a matrix. Beams
// as matrices that bent by 0.016 to 0.044 of the size were wrong by 4 to 19 % after 10 and 20 s.
constexpr double kBow = 5.0;
// [-] The peak of the displacement decays by 1 / e in at most ten cycles of the lowest mode, so that a load
// that was removed does not set the scale for ever. A vibration renews its peak in every cycle.
constexpr double kFadePerRadian = 1.0 / (20.0 * std::numbers::pi);

/// Returns exp(-x) for x >= 0 to a share of x^2 / 128 of it, with the same bits on every machine.
double decayed(double x) {
  double y = 1.0 / (1.0 + x / 64.0);
  for (int k = 0; k < 6; ++k) y *= y;
  return y;
}

}  // namespace

Verdict::Level grade(double value, double good, double most) noexcept {
  if (value <= good) return Level::kGood;
  return value <= most ? Level::kWatch : Level::kOutside;  // also if the value is not a number
}

Judgement::Judgement(const Plan& plan) : plan_(plan) {
  if (!plan.verdict.shadows.empty()) {
    const PlanShadow& shadow = plan.verdict.shadows.front();
    shadow_.emplace(plan, shadow, takes_scene_loads(shadow));
  }
  for (const PlanPoint& point : plan.points) size_ = std::max(size_, length(point.r));
  const Vec3& inverse = plan.principal.inverse_moment;
  // the moment about the line of a straight structure is zero but for rounding errors, which are near 1e-16
  constexpr double kRounding = 1e-9;
  if (inverse[2] > kRounding * inverse[0])
    uneven_inertia_ = 1.0 / inverse[2] - 1.0 / inverse[0];
  else if (inverse[1] > 0.0)
    uneven_inertia_ = 1.0 / inverse[1];
  size_ = std::max(size_, std::sqrt(uneven_inertia_ / plan.mass));
  if (shadow_)
    is_field_exact_ =
        plan.verdict.shadows.front().plan.coupled.kinetics.form == PlanKinetics::Form::kComplete;
  const auto end = plan.decay.begin() + plan.num_elastic;
  slowest_ = plan.num_elastic > 0 ? *std::min_element(plan.decay.begin(), end) : 0.0;
  fade_ = std::max(slowest_, kFadePerRadian * plan.verdict.lowest_omega);
}

void Judgement::command(std::int64_t tick, std::span<const ForceCommand> commands) noexcept {
  if (shadow_) shadow_->command(tick, commands);
}

bool Judgement::needs(const MotionState& state) const noexcept {
  return state.epoch != epoch_ || (shadow_ && shadow_->needs(state));
}

bool Judgement::take(const MotionState& state) noexcept {
  if (state.epoch != epoch_) begin(state);
  if (!shadow_ || !shadow_->take(state)) return false;
  judge(state);
  if (now_.level > worst_.level) worst_ = now_;
  if (state.tick == state.epoch_start_tick && now_.level == Level::kGood) now_ = {};  // the shadow is equal
  return true;
}

void Judgement::begin(const MotionState& state) noexcept {
  epoch_ = state.epoch;
  last_tick_ = state.tick;
  start_W_ = state.p_WB;
  hidden_phase_ = ringing_ = peak_ = velocity_error_ = position_error_ = attractor_ratio_ = 0.0;
  growth_.clear();
  now_ = worst_ = {};
}

/// Integrates the error of the position that the first neglected term of an attractor's field causes, the
/// term after the gradient (THEORY 8.19). The term accelerates the centre of mass by at most 3 mu I / (M
/// rho^4), where I is the largest minus the smallest principal moment   (THEORY 15.10). \param span  [s] time
/// since the last state
void Judgement::take_attractor(const MotionState& state, double span) noexcept {
  const Vec3 rho = sub(state.p_WB, plan_.attractor_W);
  const double square = dot(rho, rho);
  attractor_ratio_ = std::max(attractor_ratio_, size_ / std::sqrt(square));
  velocity_error_ += 3.0 * plan_.attractor_mu * uneven_inertia_ / (plan_.mass * square * square) * span;
  position_error_ += velocity_error_ * span;
}

/// Returns the force of the links on the modes above the lowest ones, over the mass [m/s^2].
double Judgement::vibration(const MotionState& state) const noexcept {
  const StepPlan& plan = active_plan(plan_, state);
  const double least = 1.5 * plan_.verdict.lowest_omega;
  double sum = 0.0;
  for (std::size_t l = 0; l < index(plan.num_elastic); ++l)
    if (plan.omega[l] > least) {
      const double acceleration = plan.omega[l] * plan.omega[l] * state.q[l];
      sum += acceleration * acceleration;
    }
  return std::sqrt(sum);
}

/// Returns whether the inside of links that is not known may matter. Spin, loads, vibration and bending may
/// change the stiffness of the lowest mode by a share kappa, which shifts its phase by kappa omega_1 / 2 per
/// second (THEORY 15.12). Coriolis forces on masses inside superelements may turn the plane of a vibration as
/// fast as the body turns. \param span  [s] time since the last state
bool Judgement::may_inside_matter(const MotionState& state, double span) noexcept {
  const double lowest = plan_.verdict.lowest_omega;
  if (lowest == 0.0 || size_ == 0.0) return false;
  const Vec3 w = angular_velocity(plan_, state);
  const double force = shadow_->load_size() / plan_.mass + kAlong * vibration(state),
               bow = now_.displacement_now / size_;
  const double kappa = (dot(w, w) + force / size_) / (lowest * lowest) + kBow * bow * bow;
  const bool has_mass = plan_.verdict.shared == SharedError::kInsideMass;
  const double rate = 0.5 * kappa * lowest + (has_mass ? length(w) : 0.0);
  hidden_phase_ = hidden_phase_ * decayed(slowest_ * span) + rate * span;
  const double by_spin = dot(w, w) / (lowest * lowest) * size_;  // [m] displacement of inner masses
  return !(kappa + hidden_phase_ <= kGoodElastic) || (has_mass && !(by_spin <= kGoodElastic * now_.scale));
}

/// Returns whether modes ring that turn by more than 1 rad in a step of the shadow, with a force that may
/// change the stiffness of the lowest mode. The shadow leaves such forces out (THEORY 12.82), as does a
/// motion with long ticks   (THEORY 15.15).
bool Judgement::may_ringing_matter(double span) noexcept {
  const StepPlan& plan = plan_.verdict.shadows.front().plan;
  const double lowest = plan_.verdict.lowest_omega;
  if (lowest == 0.0 || size_ == 0.0 || !is_coupled(plan)) return false;
  const double fast = plan.coupled.num_substeps / plan.period;  // [rad/s]
  const MotionState& state = shadow_->state();
  double sum = 0.0;
  for (std::size_t l = 0; l < index(plan.num_elastic); ++l)
    if (plan.omega[l] > fast) {
      const double acceleration = plan.omega[l] * state.q_dot[l];
      sum += acceleration * acceleration;
    }
  const double kappa = kAlong * std::sqrt(sum) / (size_ * lowest * lowest);
  ringing_ = std::max(kappa, ringing_ * decayed(slowest_ * span));
  return !(ringing_ <= kGoodElastic);
}

/// Returns whether horizons that are not judged follow, in which the error may grow past its
/// limit   (THEORY 15.6).  \param ratio  [-] largest part of the error over its limit
bool Judgement::may_error_grow(const MotionState& state, double ratio) noexcept {
  const PlanShadow& shadow = plan_.verdict.shadows.front();
  const std::int64_t age = state.tick - state.epoch_start_tick;
  if (shadow.every == 1 || age == 0) return false;
  const std::int64_t all = shadow.horizon_ticks, ticks = (age - 1) % all + 1;
  growth_.take(ticks, all, ratio, shadow_->load_size());
  return ticks == all && growth_.may_exceed(shadow.every - 1);
}

/// Sets the present verdict   (THEORY 15.7 to 15.15).
void Judgement::judge(const MotionState& state) noexcept {
  const PlanVerdict& given = plan_.verdict;
  now_ = {};
  now_.tick = state.tick;
  now_.error = shadow_->error();
  now_.own_error = shadow_->own_error();
  now_.stopped = shadow_->status();
  now_.displacement_now = shadow_->displacement_of_state();
  const double span = static_cast<double>(state.tick - last_tick_) * plan_.period;
  last_tick_ = state.tick;
  if (plan_.attractor_mu > 0.0 && !is_field_exact_) take_attractor(state, span);
  peak_ = std::max({now_.displacement_now, shadow_->displacement(), peak_ * decayed(fade_ * span)});
  now_.scale = std::max(given.tolerance > 0.0 ? given.tolerance : peak_, kLeastDisplacement * size_);
  const auto note = [this](Level level, Cause cause) {
    if (level > now_.level) now_.level = level, now_.cause = cause;
  };
  if (now_.stopped != StepStatus::kOk) {
    constexpr double kUnknown = std::numeric_limits<double>::infinity();
    now_.error = {kUnknown, kUnknown, kUnknown};
    return note(Level::kOutside, Cause::kLost);
  }
  now_.stopped = shadow_->last_stop();
  if (now_.stopped != StepStatus::kOk) note(Level::kWatch, Cause::kLost);
  const bool is_rigid = plan_.num_elastic == 0 && given.lowest_omega > 0.0;
  // a single point has no size, so it is judged by the distance that it has moved
  const double size = size_ > 0.0 ? size_ : length(sub(state.p_WB, start_W_));
  if (size > 0.0) note(grade(now_.error.position / size, kGoodPosition, kMostPosition), Cause::kPosition);
  note(grade(now_.error.attitude, kGoodAttitude, kMostAttitude), Cause::kAttitude);
  if (is_rigid && given.tolerance == 0.0) {
    if (now_.error.deformation > kLeastDisplacement * size_) note(Level::kWatch, Cause::kRigid);
  } else if (now_.scale > 0.0) {
    note(grade(now_.error.deformation / now_.scale, kGoodElastic, kMostElastic), Cause::kDeformation);
    // by the estimates of steps and of the filter   (THEORY 12.95, 12.97)
    if (!(now_.own_error <= kGoodElastic * now_.scale)) note(Level::kWatch, Cause::kCoarse);
  }
  if (!(shadow_->own_attitude_error() <= kGoodAttitude)) note(Level::kWatch, Cause::kCoarse);
  if (!given.fast_loads.empty()) note(Level::kWatch, Cause::kFastLoad);
  if (may_ringing_matter(span)) note(Level::kWatch, Cause::kRinging);
  if (shadow_->misses_loads()) note(Level::kWatch, Cause::kMissedLoad);
  if (!(position_error_ <= kGoodPosition * size_ && attractor_ratio_ <= kNearAttractor))
    note(Level::kWatch, Cause::kAttractor);
  const double ratio = std::max(
      {size > 0.0 ? now_.error.position / (kGoodPosition * size) : 0.0, now_.error.attitude / kGoodAttitude,
       now_.scale > 0.0 ? now_.error.deformation / (kGoodElastic * now_.scale) : 0.0});
  if (may_error_grow(state, ratio)) note(Level::kWatch, Cause::kGrowth);
  const bool is_shared = given.shared != SharedError::kNone && now_.scale > kLeastDisplacement * size_;
  const bool is_inside = given.shared == SharedError::kInside || given.shared == SharedError::kInsideMass;
  if (is_shared && (!is_inside || may_inside_matter(state, span))) note(Level::kWatch, Cause::kShared);
}

}  // namespace freeflex
