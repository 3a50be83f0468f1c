#include "core/error/error_shadow.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error/validity.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/linear/modal_coupling.hpp"
#include "core/step/loads/history.hpp"
#include "core/step/loads/loads.hpp"
#include "core/step/readout.hpp"
#include "core/step/rigid/frame.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

namespace {

constexpr double kMaxAttitudeError = 2.0;  // [rad] error at which the attitude is lost

/// Returns e^{-a h} cos(r h) and e^{-a h} sin(r h) / r, with a = decay and r = sqrt(omega^2 - a^2). If a >
/// omega, cosh and sinh replace cos and sin.
std::pair<double, double> free_motion(double omega, double decay, double h) noexcept {
  const double square = omega * omega - decay * decay, damped = std::sqrt(std::abs(square));
  if (damped * h < 1e-6) return {std::exp(-decay * h), h * std::exp(-decay * h)};
  if (square > 0.0)
    return {std::exp(-decay * h) * std::cos(damped * h),
            std::exp(-decay * h) * std::sin(damped * h) / damped};
  const double slow = std::exp(-omega * omega / (decay + damped) * h), fast = std::exp(-(decay + damped) * h);
  return {0.5 * (slow + fast), 0.5 * (slow - fast) / damped};
}

/// Returns the derivative of k . (w0^2, w1^2, w2^2, w0 w1, w0 w2, w1 w2) with respect to w.
Vec3 gradient(const double* k, const Vec3& w) noexcept {
  return {2.0 * k[0] * w[0] + k[3] * w[1] + k[4] * w[2], 2.0 * k[1] * w[1] + k[3] * w[0] + k[5] * w[2],
          2.0 * k[2] * w[2] + k[4] * w[0] + k[5] * w[1]};
}

}  // namespace

ErrorShadow::Free ErrorShadow::free_over(double omega, double decay, double h) noexcept {
  const auto [cosine, sine] = free_motion(omega, decay, h);
  return {cosine + decay * sine, sine, -omega * omega * sine, cosine - decay * sine};
}

ErrorShadow::ErrorShadow(const StepPlan& plan, const PlanUnmodelled& unmodelled)
    : plan_(plan), unmodelled_(unmodelled) {
  const auto n = index(unmodelled.num_shadowed);
  const double h = plan.period;
  for (std::size_t c = 0; c < n; ++c) {
    const double omega = plan.omega[c], decay = plan.decay[c], M = plan.mass;
    const Free whole = free_over(omega, decay, h);
    Tick tick{whole, free_over(omega, decay, 0.5 * h), 0.5 * h * h / M, whole.from_rate / M};
    // if the phase in a tick is below 1e-5 rad, the quotient is less accurate than the first term of its
    // series, h^2 / (2 M), which is therefore kept
    if (std::max(omega, decay) * h > 1e-5 && omega > 0.0)
      tick.by_force = (1.0 - whole.from_delta) / (M * omega * omega);
    ticks_.push_back(tick);
  }
  for (std::vector<double>* values : {&spin_force_, &x_, &v_, &product_, &missing_q_, &world_forces_})
    values->resize(n);
  half_delta_.resize(n);
  const bool is_coupled_by_forces = n > 0 && (plan.modal_coupling.num_damping > 0 || !plan.feedbacks.empty());
  for (Array* values : {&delta_, &rate_, &force_})
    values->resize(is_coupled_by_forces ? index(plan.num_padded) : n);
  if (is_coupled_by_forces) {
    for (Array* values : {&next_delta_, &next_rate_, &zero_, &low_, &rate_low_, &rate_after_impulse_})
      values->resize(delta_.size());
    scratch_.resize(modal_coupling_scratch_size(plan));
  }
  for (std::size_t pair = 0; pair < unmodelled.pairs.size(); ++pair) {
    const auto [l, u] = unmodelled.pairs[pair];
    const double* const s = unmodelled.coriolis_rows.data() + 3 * pair;
    if (l != u && std::max(l, u) < unmodelled.num_shadowed)
      pairs_.push_back({pair, index(l), index(u), {s[0], s[1], s[2]}});
  }
  E_.resize(n * n);
  coriolis_.resize(n * n);
}

void ErrorShadow::clear() noexcept {
  for (Array* values : {&delta_, &rate_}) std::fill(values->begin(), values->end(), 0.0);
  for (std::vector<double>* values : {&spin_force_, &E_, &coriolis_})
    std::fill(values->begin(), values->end(), 0.0);
  has_coriolis_ = false;
  has_world_loads_ = false;
  H_W_ = phi_ = w_ = w_error_ = {};
  std::fill(world_forces_.begin(), world_forces_.end(), 0.0);
}

void ErrorShadow::set_stiffness(std::size_t l, std::size_t u, double E) noexcept {
  E_[l * size() + u] = E_[u * size() + l] = E;
}

void ErrorShadow::set_spin(const Vec3& w, const std::array<double, 6>& products,
                           std::span<const double> wheels) noexcept {
  const std::size_t n = size();
  has_coriolis_ = w[0] != 0.0 || w[1] != 0.0 || w[2] != 0.0 ||
                  std::any_of(wheels.begin(), wheels.end(), [](double h) { return h != 0.0; });
  if (!has_coriolis_ &&
      std::all_of(spin_force_.begin(), spin_force_.end(), [](double f) { return f == 0.0; }))
    return;
  for (std::size_t c = 0; c < n && !unmodelled_.spin_loads.empty(); ++c) {
    spin_force_[c] = 0.0;
    for (std::size_t k = 0; k < 6; ++k) spin_force_[c] += unmodelled_.spin_loads[6 * c + k] * products[k];
  }
  for (const auto& [pair, l, u, s] : pairs_) {
    if (is_coupled(plan_)) break;
    coriolis_[l * n + u] = 2.0 * plan_.mass * dot(s, w);
    // gyroscopic force -theta_l . (theta' x h a)   (THEORY 16.24)
    for (std::size_t k = 0; k < wheels.size(); ++k)
      coriolis_[l * n + u] -= wheels[k] * unmodelled_.gyroscopic[k * unmodelled_.pairs.size() + pair];
    coriolis_[u * n + l] = -coriolis_[l * n + u];
  }
}

/// Computes the motion of the rung and the error of this motion halfway through the tick, as free vibration.
/// If F is taken at this time, a tick is equivalent to free motion over half a tick, an impulse proportional
/// to F, and free motion over the other half. F therefore neither feeds nor damps the vibration
/// (THEORY X142).
void ErrorShadow::move_halfway(const MotionState& state) noexcept {
  for (std::size_t c = 0; c < size(); ++c) {
    const Free& half = ticks_[c].half;
    const double stiffness = plan_.mass * plan_.omega[c] * plan_.omega[c];
    const double quasi_static = stiffness > 0.0 ? state.Q[c] / stiffness : 0.0,
                 vibration = state.q[c] - quasi_static;
    half_delta_[c] = half.from_delta * delta_[c] + half.from_rate * rate_[c];
    x_[c] = quasi_static + half.from_delta * vibration + half.from_rate * state.q_dot[c] + half_delta_[c];
    v_[c] =
        half.rate_from_delta * (vibration + delta_[c]) + half.rate_from_rate * (state.q_dot[c] + rate_[c]);
  }
}

/// Computes F at x = q + delta   (THEORY X142):
///   F_c = -1/2 sum_ab Gamma_abc x_a x_b   third order of the energy of the integrated modes (THEORY X147)
///         - sum_b E_cb x_b                stiffness due to the other modes and the spin
///         - 1/2 sum_r (x^T H_r x) H_r x   fourth order of the energy (THEORY X146)
///         + centrifugal and Coriolis forces that the rung neglects + terms of the attitude error
///         (THEORY X148)
void ErrorShadow::compute_forces(const MotionState& state) noexcept {
  const std::size_t n = size();
  for (std::size_t c = 0; c < n; ++c) force_[c] = spin_force_[c] + world_forces_[c];
  const double* gamma = unmodelled_.shadow_rows.data();
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = a; b < n; ++b, gamma += n)
      combine_one(gamma, -x_[a] * x_[b], true, n, force_.data());
  for (std::size_t b = 0; b < n; ++b) combine_one(E_.data() + b * n, -x_[b], true, n, force_.data());
  unmodelled_.quartic_forms.empty() ? add_fourth_order_bound() : add_fourth_order();
  for (std::size_t c = 0; c < n && !unmodelled_.inertia_rows.empty(); ++c)
    force_[c] += dot(gradient(unmodelled_.inertia_rows.data() + 6 * c, w_), w_error_);
  for (const PlanWheel& wheel : plan_.wheels) add_wheel_torque(wheel, state);
  if (has_coriolis_) add_coriolis();
}

/// Adds the force due to the fourth order of the energy to F: -1/2 sum_r (x^T H_r x) H_r x   (THEORY X146).
void ErrorShadow::add_fourth_order() noexcept {
  const std::size_t n = size();
  const Array& forms = unmodelled_.quartic_forms;
  for (const double* form = forms.data(); form != forms.data() + forms.size(); form += n * n) {
    for (std::size_t b = 0; b < n; ++b) combine_one(form + b * n, x_[b], b > 0, n, product_.data());
    double sum = 0.0;
    for (std::size_t a = 0; a < n; ++a) sum += product_[a] * x_[a];
    combine_one(product_.data(), -0.5 * sum, true, n, force_.data());
  }
}

/// Adds a bound of the fourth-order force to F, as if all modes stretched the same links. The bound is used
/// if the plan does not contain the forms H_r (THEORY X146).
void ErrorShadow::add_fourth_order_bound() noexcept {
  const Array& root = unmodelled_.root_quartic;
  double all = 0.0;
  for (std::size_t c = 0; c < size(); ++c) all += root[c] * x_[c] * x_[c];
  for (std::size_t c = 0; c < size(); ++c)
    force_[c] -= root[c] * (3.0 * all - 2.0 * root[c] * x_[c] * x_[c]) * x_[c];
}

/// Adds Coriolis forces to F: 2 M w . s_cb x_b'. The rate x' is taken halfway through the impulse, so that
/// Coriolis forces rotate the motion but do not change the size of the motion.
void ErrorShadow::add_coriolis() noexcept {
  const std::size_t n = size();
  const double half = 0.5 * plan_.period / plan_.mass;
  const auto coriolis = [&](std::size_t c) {
    double sum = 0.0;
    for (std::size_t b = 0; b < n; ++b) sum += coriolis_[c * n + b] * v_[b];
    return sum;
  };
  for (std::size_t c = 0; c < n; ++c) product_[c] = coriolis(c);
  for (std::size_t c = 0; c < n; ++c) v_[c] += half * product_[c];
  for (std::size_t c = 0; c < n; ++c) force_[c] += coriolis(c);
}

/// Returns the part of a body's elastic rotation that the rung neglects [rad]. On the coupled rungs this part
/// is the rotation due to the error. Below the coupled rungs, this part is the whole elastic rotation.
Vec3 ErrorShadow::neglected_rotation(const double* rows, const MotionState& state,
                                     const Array& delta) const noexcept {
  const std::size_t padded = index(plan_.num_padded);
  Vec3 theta = is_coupled(plan_) ? Vec3{} : contract_rows(rows, state.q.data(), padded);
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t c = 0; c < size(); ++c) theta[axis] += rows[axis * padded + c] * delta[c];
  return theta;
}

/// Adds two torques of a wheel to F: the torque due to the error of the spin, -theta_l . (dw x h a)
/// (THEORY X148), and the torque due to the spin on the rotated axis, to first order, h ((theta x a) x w + a
/// x (w x theta)) / 2 (THEORY 16.27 to 16.31).
void ErrorShadow::add_wheel_torque(const PlanWheel& wheel, const MotionState& state) noexcept {
  const double* const rows = rotation_rows(plan_, wheel.attitude_index);
  const std::size_t padded = index(plan_.num_padded);
  const double h = state.wheel_momentum[index(static_cast<std::int32_t>(&wheel - plan_.wheels.data()))];
  const Vec3 theta = neglected_rotation(rows, state, half_delta_), &a = wheel.axis;
  const Vec3 by_axis = scale(0.5, add(cross(cross(theta, a), w_), cross(a, cross(w_, theta))));
  const Vec3 torque = scale(h, sub(by_axis, cross(w_error_, a)));
  for (std::size_t c = 0; c < size(); ++c)
    force_[c] += rows[c] * torque[0] + rows[padded + c] * torque[1] + rows[2 * padded + c] * torque[2];
}

/// Adds to H_W_ the impulse, in a tick, of the torque that the rung neglects. Loads on displaced points cause
/// the part (V + dV) x F, and loads fixed in the world cause the other part, because the attitude has the
/// error phi. The same error makes loads fixed in the world load the modes: b . (F x phi) = phi . (b x F)
/// (THEORY X148).
void ErrorShadow::add_torque(const State& state, const CommandLoads& commands, const Mat3& R_WB) noexcept {
  RigidLoad loads;
  Vec3 torque = cross(phi_, state.moment_B);
  std::fill(world_forces_.begin(), world_forces_.end(), 0.0);
  const auto add_load = [&](const LoadPattern& pattern, const double* arms, double amplitude) {
    add_pattern(pattern, amplitude, loads);
    RigidLoad arm;
    arm.has_moment_W = pattern.has_world;
    for (std::size_t c = 0; c < size(); ++c, arms += kArmSize) {
      std::copy_n(arms, arm.moment_W.size(), arm.moment_W.begin());
      const Vec3 by_world = scale(amplitude, moment_B(arm, R_WB)),
                 by_body = scale(amplitude, {arms[27], arms[28], arms[29]});
      world_forces_[c] += dot(phi_, by_world);
      torque = add_scaled(torque, missing_q_[c], add(by_world, by_body));
    }
  };
  if (state.num_slots > 0) add_load(state.commands_pattern, commands.arms().data(), 1.0);
  const std::int64_t age = state.tick - state.epoch_start_tick;
  for (std::size_t k = 0; k < plan_.histories.size(); ++k) {
    const double amplitude = amplitude_left(plan_.histories[k], plan_.period, age);
    if (amplitude != 0.0)
      add_load(plan_.histories[k].pattern, unmodelled_.load_arms.data() + k * size() * kArmSize, amplitude);
  }
  has_world_loads_ = loads.has_moment_W;
  if (has_world_loads_) {
    loads.torque_B = {};
    const Mat3 phi_cross = {0.0, -phi_[2], phi_[1], phi_[2], 0.0, -phi_[0], -phi_[1], phi_[0], 0.0};
    torque = add(torque, moment_B(loads, multiply(R_WB, phi_cross)));
  }
  H_W_ = add_scaled(H_W_, plan_.period, multiply(R_WB, torque));
}

/// Returns the part of the angular momentum of the vibration, sum m V x V', that the rung neglects [N m s].
/// Below the coupled rungs the rung neglects all of it. On the coupled rungs it neglects the change that the
/// error makes.
Vec3 ErrorShadow::vibration_momentum(const MotionState& state) const noexcept {
  const double own = is_coupled(plan_) ? 1.0 : 0.0;
  Vec3 sum{};
  for (const auto& [pair, l, u, s] : pairs_) {
    const auto area = [&, l = l, u = u](double share) {
      return (state.q[l] + share * delta_[l]) * (state.q_dot[u] + share * rate_[u]) -
             (state.q[u] + share * delta_[u]) * (state.q_dot[l] + share * rate_[l]);
    };
    sum = add_scaled(sum, plan_.mass * (area(1.0) - own * area(0.0)), s);
  }
  return sum;
}

/// Advances the error of the attitude by a tick: phi' = dw - w x phi, dw = J^-1 (H x phi + dH - dJ w - h)
/// (THEORY X148). The momentum is fixed in the world, so an attitude error rotates its components in body
/// axes. dJ is the change of inertia due to the deformation, and h is the angular momentum of the vibration.
void ErrorShadow::advance_attitude(const State& state, const CommandLoads& commands) noexcept {
  if (unmodelled_.inertia_rows.empty()) return;
  const Mat3 R_WB = rotation_matrix(state.q_WB);
  for (std::size_t c = 0; c < size(); ++c) missing_q_[c] = (is_coupled(plan_) ? 0.0 : state.q[c]) + delta_[c];
  add_torque(state, commands, R_WB);
  w_ = angular_velocity(plan_, state);
  Vec3 H = multiply(plan_.inertia, w_);
  Vec3 added = sub(vibration_momentum(state), multiply_transposed(R_WB, H_W_));
  for (std::size_t k = 0; k < plan_.wheels.size(); ++k) {  // h theta x a: the rotated axis (THEORY 16.25)
    const PlanWheel& wheel = plan_.wheels[k];
    const Vec3 theta = neglected_rotation(rotation_rows(plan_, wheel.attitude_index), state, delta_);
    H = add_scaled(H, state.wheel_momentum[k], wheel.axis);
    added = add_scaled(added, state.wheel_momentum[k], cross(theta, wheel.axis));
  }
  for (std::size_t c = 0; c < size(); ++c)
    added = add_scaled(added, missing_q_[c], gradient(unmodelled_.inertia_rows.data() + 6 * c, w_));
  const auto spin_error = [&](const Vec3& phi) {
    return multiply(plan_.inverse_inertia, sub(cross(H, phi), added));
  };
  const auto rate = [&](const Vec3& phi) { return sub(spin_error(phi), cross(w_, phi)); };
  const double h = plan_.period;
  const Vec3 k1 = rate(phi_), k2 = rate(add_scaled(phi_, 0.5 * h, k1)),
             k3 = rate(add_scaled(phi_, 0.5 * h, k2)), k4 = rate(add_scaled(phi_, h, k3));
  phi_ = add_scaled(add_scaled(phi_, h / 6.0, add(k1, k4)), h / 3.0, add(k2, k3));
  if (const double size = norm(phi_); !(size < kMaxAttitudeError)) {
    phi_ = std::isfinite(size) ? scale(kMaxAttitudeError / size, phi_) : Vec3{kMaxAttitudeError, 0.0, 0.0};
    if (!std::isfinite(norm(H_W_))) H_W_ = {};
  }
  w_error_ = spin_error(phi_);
}

double ErrorShadow::attitude_error() const noexcept { return has_world_loads_ ? norm(phi_) : 0.0; }

void ErrorShadow::advance(const State& state, const CommandLoads& commands) noexcept {
  advance_attitude(state, commands);
  move_halfway(state);
  compute_forces(state);
  if (!zero_.empty()) return advance_coupled();
  for (std::size_t c = 0; c < size(); ++c) {
    const auto& [free, half, by_force, rate_by_force] = ticks_[c];
    const double delta = delta_[c], rate = rate_[c];
    delta_[c] = free.from_delta * delta + free.from_rate * rate + by_force * force_[c];
    rate_[c] = free.rate_from_delta * delta + free.rate_from_rate * rate + rate_by_force * force_[c];
  }
}

/// Advances the errors if dashpots or feedback couple the modes, by the propagator of the rung. The coupled
/// rungs apply these forces stage by stage, so there a splitting impulse changes the errors, then the modes
/// move, then a second splitting impulse changes the errors.
void ErrorShadow::advance_coupled() noexcept {
  // The errors do not need low parts, so the low parts that go in are zero and the low parts that come out
  // are discarded.
  const ModalState from{delta_.data(), zero_.data(), rate_.data(), zero_.data()};
  const ModalResult to{next_delta_.data(), low_.data(), next_rate_.data(), rate_low_.data()};
  DependentLoad last_impulse;
  const bool has_impulses = is_coupled(plan_);
  if (has_impulses) add_half_impulse(delta_, false, rate_);
  advance_linear(plan_, from, force_.data(), force_.data(), rate_after_impulse_, scratch_, to, last_impulse);
  if (has_impulses) add_half_impulse(next_delta_, true, next_rate_);
  delta_.swap(next_delta_);
  rate_.swap(next_rate_);
}

/// Applies one splitting impulse: of feedback and of each dashpot in turn. Feedback is applied explicitly.
/// The dashpots are applied implicitly, so their coefficients may be of any size. The second splitting
/// impulse of a step applies them in the reverse order of the first.
void ErrorShadow::add_half_impulse(const Array& delta, bool is_second, Array& rate) noexcept {
  const std::size_t n = rate.size(), num_damping = index(plan_.modal_coupling.num_damping);
  const double share = 0.5 * plan_.period / plan_.mass;
  const auto feed = [&] {
    for (const PlanFeedback& feedback : plan_.feedbacks) {
      const Vec3 force = add(contract_rows(feedback.q_rows.data(), delta.data(), n),
                             contract_rows(feedback.q_dot_rows.data(), rate.data(), n));
      combine_rows(point_rows(plan_, feedback.row), scale(share, force), true, n, rate.data());
    }
  };
  if (!is_second) feed();
  for (std::size_t k = 0; k < num_damping; ++k) {
    const double* row = plan_.modal_coupling.damping_rows.data() + (is_second ? num_damping - 1 - k : k) * n;
    const double weight = share / (1.0 + share * dot_lanes(row, row, n));
    combine_one(row, -weight * dot_lanes(row, rate.data(), n), true, n, rate.data());
  }
  if (is_second) feed();
}

void ErrorShadow::settle(const MotionState& state) noexcept {
  constexpr int kRounds = 8;  // if the rung neglects half of the stiffness, an error of 0.5 % remains
  std::fill(delta_.begin(), delta_.end(), 0.0);
  std::fill(rate_.begin(), rate_.end(), 0.0);
  std::fill(v_.begin(), v_.end(), 0.0);
  for (int round = 0; round < kRounds; ++round) {
    std::copy_n(delta_.begin(), size(), half_delta_.begin());
    for (std::size_t c = 0; c < size(); ++c) x_[c] = state.q[c] + delta_[c];
    compute_forces(state);
    for (std::size_t c = 0; c < size(); ++c)
      if (const double omega = plan_.omega[c]; omega > 0.0)
        delta_[c] = force_[c] / (plan_.mass * omega * omega);
  }
}

void ErrorShadow::limit(double most) noexcept {
  for (std::size_t c = 0; c < delta_.size(); ++c) {
    const double omega = plan_.omega[c];
    const double amplitude = std::hypot(delta_[c], omega > 0.0 ? rate_[c] / omega : 0.0);
    if (amplitude <= most) continue;
    // An error whose amplitude is infinite or NaN is set to `most`.
    const double share = std::isfinite(amplitude) ? most / amplitude : 0.0;
    delta_[c] = share > 0.0 ? delta_[c] * share : most;
    rate_[c] = share > 0.0 ? rate_[c] * share : 0.0;
  }
}

void ErrorShadow::join(const ErrorShadow& other, const std::vector<std::int32_t>& modes) noexcept {
  for (std::size_t c = 0; c < other.size(); ++c)
    if (const auto at = index(modes[c]); at < size()) {
      delta_[at] = other.delta_[c];
      rate_[at] = other.rate_[c];
    }
  H_W_ = other.H_W_;
  phi_ = other.phi_;
}

double ErrorShadow::square() const noexcept {
  double sum = 0.0;
  for (std::size_t c = 0; c < delta_.size(); ++c) sum += square_of(c);
  return sum;
}

double ErrorShadow::square_of(std::size_t mode) const noexcept {
  const double omega = plan_.omega[mode], rate = omega > 0.0 ? rate_[mode] / omega : 0.0;
  return delta_[mode] * delta_[mode] + rate * rate;
}

}  // namespace freeflex
