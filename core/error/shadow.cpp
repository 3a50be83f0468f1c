#include "core/error/shadow.hpp"

#include <algorithm>

#include "core/step/coupled/coupled.hpp"
#include "core/step/coupled/curve.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/readout.hpp"
#include "core/step/step.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

Vec3 rotation_between(const Quat& from, const Quat& to) noexcept {
  const Quat q = multiply(to, {from[0], -from[1], -from[2], -from[3]});
  const double sign = q[0] < 0.0 ? -2.0 : 2.0;
  return {sign * q[1], sign * q[2], sign * q[3]};
}

namespace {

/// Returns an attitude rotated by a vector in world axes as rotation_between() returns it.
Quat rotated(const Vec3& by, const Quat& from) noexcept {
  const double square = 0.25 * dot(by, by);
  const double cosine = square < 1.0 ? __builtin_sqrt(1.0 - square) : 0.0;
  Quat q = multiply(Quat{cosine, 0.5 * by[0], 0.5 * by[1], 0.5 * by[2]}, from);
  const double norm = __builtin_sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (double& each : q) each /= norm;
  return q;
}

Vec3 spin_W(const StepPlan& plan, const MotionState& state) noexcept {
  return multiply(rotation_matrix(state.q_WB), angular_velocity(plan, state));
}

/// Returns (1 + E)^n of a 2 x 2 matrix E, row-major.
std::array<double, 4> power(const std::array<double, 4>& E, std::int64_t n) noexcept {
  std::array<double, 4> square{1.0 + E[0], E[1], E[2], 1.0 + E[3]}, product{1.0, 0.0, 0.0, 1.0};
  const auto times = [](const std::array<double, 4>& a, const std::array<double, 4>& b) {
    return std::array<double, 4>{a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3],
                                 a[2] * b[0] + a[3] * b[2], a[2] * b[1] + a[3] * b[3]};
  };
  for (; n > 0; n /= 2) {
    if (n % 2 == 1) product = times(product, square);
    square = times(square, square);
  }
  return product;
}

}  // namespace

Shadow::Shadow(const StepPlan& plan, const PlanShadow& shadow, bool takes_scene_loads)
    : plan_(plan),
      shadow_(shadow),
      state_(make_state(shadow.plan)),
      workspace_(make_workspace(shadow.plan)),
      loads_(plan, shadow),
      takes_scene_loads_(takes_scene_loads) {
  const std::size_t n = index(shadow.plan.num_padded);
  for (Array* v : {&apart_.q, &apart_.q_dot, &q_, &q_dot_, &q_before_, &q_dot_before_}) v->resize(n);
  const auto end = shadow.plan.decay.begin() + shadow.plan.num_elastic;
  const double slowest =
      shadow.plan.num_elastic > 0 ? *std::min_element(shadow.plan.decay.begin(), end) : 0.0;
  fade_ = 1.0 / (1.0 + slowest * shadow.plan.period);  // at least exp(-decay H), without libm
}

bool Shadow::needs(const MotionState& state) const noexcept {
  const std::int64_t age = state.tick - state.epoch_start_tick;
  return state.epoch != epoch_ || age % shadow_.horizon_ticks == 0 ||
         (is_judged_ && age % shadow_.ticks == 0);
}

bool Shadow::take(const MotionState& state) noexcept {
  if (state.epoch != epoch_) {
    begin_epoch(state);
    return true;
  }
  if (!needs(state)) return false;
  const std::int64_t age = state.tick - start_tick_;
  const bool was_judged = is_judged_;
  if (is_judged_) {
    is_judged_ = step_once(age - shadow_.ticks);
    if (!is_judged_) stop_ = report_.status;
    if (is_judged_) compare(state);
  }
  // a shadow that has just stopped is judged first, and starts again with a later horizon
  if (age % shadow_.horizon_ticks == 0 && is_judged_ == was_judged) begin_horizon(state);
  if (is_judged_ && shadow_.ticks > 1) loads_.begin_step(state.tick);
  return was_judged;
}

void Shadow::clear(Apart& apart) noexcept {
  for (Array* v : {&apart.q, &apart.q_dot}) std::fill(v->begin(), v->end(), 0.0);
  apart.position_W = apart.velocity_W = apart.rotation_W = apart.spin_W = {};
}

void Shadow::begin_epoch(const MotionState& state) noexcept {
  epoch_ = state.epoch;
  start_tick_ = state.epoch_start_tick;
  loads_.clear();
  clear(apart_);
  report_.status = StepStatus::kOk;
  stop_ = StepStatus::kOk;
  own_attitude_ = integration_error_ = largest_load_ = 0.0;
  misses_loads_ = false;
  put(state, nullptr);
  // the initial state of the shadow's plan, because the plan of the state may omit modes that move
  state_.q = shadow_.plan.initial.q;
  state_.q_dot = shadow_.plan.initial.q_dot;
  if (is_coupled(shadow_.plan)) set_coupled_motion(shadow_.plan, angular_velocity(plan_, state), state_);
  is_judged_ = true;
  compare(state);
  if (shadow_.ticks > 1) loads_.begin_step(state.tick);
}

/// Goes on from one horizon to the next   (THEORY 15.6). If every horizon is judged, the shadow goes on too.
/// Otherwise it pauses after a horizon that was judged, and starts again where the true motion is expected.
void Shadow::begin_horizon(const MotionState& state) noexcept {
  const std::int64_t number = (state.tick - start_tick_) / shadow_.horizon_ticks;
  const bool is_next = number % shadow_.every == 0;
  if (is_judged_ && is_next) return;
  if (!is_judged_) find_missed_loads(loads_.command_size_in_pause());
  if (is_judged_) {
    pause(state);
  } else if (is_next && report_.status == StepStatus::kOk) {
    move_on(apart_, (shadow_.every - 1) * shadow_.horizon_ticks * shadow_.substeps / shadow_.ticks);
    put(state, &apart_);
  } else if (is_next) {  // the shadow has stopped
    clear(apart_);
    report_.status = StepStatus::kOk;
    put(state, nullptr);
  }
  is_judged_ = is_next;
  if (is_judged_) return;
  loads_.skip_to(state.tick);
  loads_.begin_pause();
  const std::int64_t age = state.tick - start_tick_;
  find_missed_loads(loads_.largest_histories(age, age + (shadow_.every - 1) * shadow_.horizon_ticks));
}

/// Loads that are larger than those that were judged may cause an error that was not seen.
void Shadow::find_missed_loads(double size) noexcept {
  constexpr double kLarger = 1.2;  // the errors of equal loads are alike
  misses_loads_ = misses_loads_ || size > kLarger * largest_load_;
}

/// Notes how far the shadow is from the state at the end of a horizon. The horizons that are not judged are
/// taken to add as much as this one did.
void Shadow::pause(const MotionState& state) noexcept {
  const Frame before = state_;
  const Vec3 w_before = spin_W(shadow_.plan, state_);
  q_before_ = state_.q;
  q_dot_before_ = state_.q_dot;
  put(state, nullptr);
  const auto times = static_cast<double>(shadow_.every - 1);
  const auto extend = [times](double now, double& apart) { apart = now + times * (now - apart); };
  for (std::size_t l = 0; l < apart_.q.size(); ++l) {
    extend(q_before_[l] - state_.q[l], apart_.q[l]);
    extend(q_dot_before_[l] - state_.q_dot[l], apart_.q_dot[l]);
  }
  const Vec3 position = sub(before.p_WB, state_.p_WB), velocity = sub(before.v_WB, state_.v_WB),
             rotation = rotation_between(state_.q_WB, before.q_WB),
             spin = sub(w_before, spin_W(shadow_.plan, state_));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    extend(position[axis], apart_.position_W[axis]);
    extend(velocity[axis], apart_.velocity_W[axis]);
    extend(rotation[axis], apart_.rotation_W[axis]);
    extend(spin[axis], apart_.spin_W[axis]);
  }
}

/// Sets q and q_dot to the coordinates of the state on the shadow's plan   (THEORY 15.3).
void Shadow::to_shadow(const MotionState& state, Array& q, Array& q_dot) const noexcept {
  std::fill(q.begin(), q.end(), 0.0);
  std::fill(q_dot.begin(), q_dot.end(), 0.0);
  const StepPlan& active = active_plan(plan_, state);
  const ShadowModes& modes = shadow_.modes[state.uses_fallback ? 1 : 0];
  const auto num_modes = index(active.num_elastic);
  if (modes.projection.empty()) {
    for (std::size_t l = 0; l < num_modes; ++l) {
      q[index(modes.numbers[l])] = state.q[l];
      q_dot[index(modes.numbers[l])] = state.q_dot[l];
    }
    return;
  }
  const std::size_t n = q.size();
  for (std::size_t l = 0; l < num_modes; ++l)
    for (std::size_t s = 0; s < n; ++s) {
      q[s] += modes.projection[l * n + s] * state.q[l];
      q_dot[s] += modes.projection[l * n + s] * state.q_dot[l];
    }
}

/// Sets the shadow to the motion of the state, plus a distance. If only the shadow has true geometry, stiff
/// modes get the foreshortening that the motion of the state lacks   (THEORY 15.4).
void Shadow::put(const MotionState& state, const Apart* apart) noexcept {
  const StepPlan& own = shadow_.plan;
  state_.tick = (state.tick - start_tick_) * shadow_.substeps / shadow_.ticks;
  state_.epoch_start_tick = 0;
  static_cast<Frame&>(state_) = state;
  state_.wheel_momentum = state.wheel_momentum;
  state_.wheel_momentum_low = state.wheel_momentum_low;
  to_shadow(state, state_.q, state_.q_dot);
  if (is_curved(own) && !traits_of(plan_.fidelity).has_true_geometry) {
    CurveWorkspace& curve = workspace_.coupled.curve;
    to_linear(own, state_.q.data(), state_.q_dot.data(), curve);
    std::copy(curve.q.begin(), curve.q.end(), state_.q.begin());
    std::copy(curve.p.begin(), curve.p.end(), state_.q_dot.begin());
  }
  Vec3 w_W = spin_W(plan_, state);
  if (apart != nullptr) {
    for (std::size_t l = 0; l < state_.q.size(); ++l) {
      state_.q[l] += apart->q[l];
      state_.q_dot[l] += apart->q_dot[l];
    }
    state_.p_WB = add(state_.p_WB, apart->position_W);
    state_.v_WB = add(state_.v_WB, apart->velocity_W);
    state_.q_WB = rotated(apart->rotation_W, state_.q_WB);
    state_.p_WB_low = state_.v_WB_low = {};
    state_.q_WB_low = {};
    w_W = add(w_W, apart->spin_W);
  }
  for (Array* v : {&state_.q_low, &state_.q_dot_low, &state_.Q}) std::fill(v->begin(), v->end(), 0.0);
  if (is_coupled(own))
    set_coupled_motion(own, multiply_transposed(rotation_matrix(state_.q_WB), w_W), state_);
  state_.slots_changed = true;
  sum_before_ = state_.coupled.integration_error;
}

/// Advances the shadow, and the distance with which it started, by one of its steps or by those of one tick.
bool Shadow::step_once(std::int64_t age) noexcept {
  if (shadow_.ticks > 1) {
    advance_step(&loads_.end_step(start_tick_ + age + shadow_.ticks, age));
  } else {
    loads_.skip_to(start_tick_ + age);
    if (!takes_scene_loads_) loads_.copy_slots(age, state_);
    for (std::int32_t s = 0; s < shadow_.substeps && report_.status == StepStatus::kOk; ++s)
      advance_step(takes_scene_loads_ ? &loads_.loads_of_substep(age, s) : nullptr);
  }
  largest_load_ = std::max(largest_load_, loads_.size());
  return report_.status == StepStatus::kOk;
}

/// Advances the shadow by one of its steps.  \param over  loads in place of those of the plan, or nullptr
void Shadow::advance_step(const LoadsOverStep* over) noexcept {
  step(shadow_.plan, state_, {{}, over}, workspace_, report_);
  if (report_.status == StepStatus::kOk) move_on(apart_, 1);
  add_attitude_error();
  add_integration_error();
}

/// Adds the estimate of the last step to the errors of the steps before, which decay with the vibration.
void Shadow::add_integration_error() noexcept {
  const double sum = state_.coupled.integration_error;
  integration_error_ = integration_error_ * fade_ + (sum - sum_before_);
  sum_before_ = sum;
}

/// Adds the error of the attitude that a step of order 4 makes. A body without modes is advanced more
/// accurately (7.20), and is left out.
void Shadow::add_attitude_error() noexcept {
  const StepPlan& own = shadow_.plan;
  if (!is_coupled(own) || own.num_elastic == 0) return;
  const double substeps = own.coupled.num_substeps, h = own.period / substeps;
  double rate = length(state_.coupled.w_B);
  if (!own.wheels.empty()) {
    const Vec3 momentum = wheel_momentum_B(own, state_);
    const Vec3& inverse = own.principal.inverse_moment;
    const double nutation = length(momentum) * __builtin_sqrt(inverse[0] * inverse[1]);
    if (rate > 0.0 && nutation > rate) rate = nutation;
  }
  const double angle = rate * h, square = angle * angle;
  own_attitude_ += substeps * square * square * angle / 120.0;
}

/// Advances a distance by a number of steps: the modes by their linear motion, the frame at constant rates.
void Shadow::move_on(Apart& apart, std::int64_t num_steps) const noexcept {
  const StepPlan& own = shadow_.plan;
  if (shadow_.every == 1 || !is_coupled(own)) return;  // the shadow never pauses
  const std::size_t n = index(own.num_padded);
  const double* const E = own.coupled.functions.data() +
                          std::size_t{PlanCoupled::kNumEntries} * std::size_t{PlanCoupled::kStep} * n;
  for (std::size_t l = 0; l < index(own.num_elastic); ++l) {
    const std::array<double, 4> over =
        power({E[l], E[n + l], E[2 * n + l], E[3 * n + l]}, num_steps * own.coupled.num_substeps);
    const double q = apart.q[l], v = apart.q_dot[l];
    apart.q[l] = over[0] * q + over[1] * v;
    apart.q_dot[l] = over[2] * q + over[3] * v;
  }
  const double span = static_cast<double>(num_steps) * own.period;
  apart.position_W = add_scaled(apart.position_W, span, apart.velocity_W);
  apart.rotation_W = add_scaled(apart.rotation_W, span, apart.spin_W);
}

/// Returns the displacement at coordinates q [m], rms over the mass   (THEORY 15.5, 16.9).
double Shadow::size_of(const Array& q) const noexcept {
  double square = 0.0;
  for (std::size_t l = 0; l < index(shadow_.plan.num_elastic); ++l) square += q[l] * q[l];
  return __builtin_sqrt(square);
}

/// Returns what is to be added to the square of the difference q_ of coordinates [m^2], because the points of
/// rigid links move on tangents in a state without true geometry, and on arcs in the shadow   (THEORY 15.5).
double Shadow::square_of_rigid_links() const noexcept {
  const StepPlan& own = shadow_.plan;
  const PlanTurning& turning = own.coupled.turning;
  if (!is_coupled(own) || traits_of(plan_.fidelity).has_true_geometry) return 0.0;
  double sum = 0.0;  // [kg m^2]
  for (const PlanTurningBody& body : turning.bodies)
    for (std::int32_t k = body.first; body.count > 1 && k < body.first + body.count; ++k) {
      const std::int32_t point = turning.points[index(k)];
      const PlanPoint& at = own.points[index(point)];
      if (at.mass == 0.0) continue;
      const double* const rows = point_rows(own, at.row);
      const Vec3 difference = contract_rows(rows, q_.data(), q_.size()),
                 arc = sub(read_in_frame(own, state_, point).V,
                           contract_rows(rows, state_.q.data(), q_.size()));
      sum += at.mass * (dot(arc, arc) - 2.0 * dot(arc, difference));
    }
  return sum / own.mass;
}

/// Computes the distance of the state from the shadow   (THEORY 15.5).
void Shadow::compare(const MotionState& state) noexcept {
  to_shadow(state, q_, q_dot_);
  displacement_of_state_ = size_of(q_);
  displacement_ = size_of(state_.q);
  for (std::size_t l = 0; l < q_.size(); ++l) q_[l] -= state_.q[l];
  const double linear = size_of(q_);
  error_.deformation = __builtin_sqrt(std::max(0.0, linear * linear + square_of_rigid_links()));
  error_.position = length(sub(state.p_WB, state_.p_WB));
  error_.attitude = length(rotation_between(state_.q_WB, state.q_WB));
  own_error_ = integration_error_ + state_.coupled.filter_error;
}

}  // namespace freeflex
