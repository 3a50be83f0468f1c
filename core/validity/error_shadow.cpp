#include "core/validity/error_shadow.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/step/frame.hpp"
#include "core/step/history.hpp"
#include "core/step/kernels.hpp"
#include "core/step/loads.hpp"
#include "core/step/mixing.hpp"
#include "core/step/readout.hpp"
#include "core/step/vector.hpp"
#include "core/validity/validity.hpp"

namespace freeflex {

namespace {

constexpr double kMostTurn = 2.0;  // [rad] all is lost then

/// e^{-a h} cos(r h) and e^{-a h} sin(r h) / r, r = sqrt(omega^2 - a^2), with cosh and sinh where a > omega.
std::pair<double, double> free_motion(double omega, double decay, double h) noexcept {
  const double square = omega * omega - decay * decay, ring = std::sqrt(std::abs(square));
  if (ring * h < 1e-6) return {std::exp(-decay * h), h * std::exp(-decay * h)};
  if (square > 0.0)
    return {std::exp(-decay * h) * std::cos(ring * h), std::exp(-decay * h) * std::sin(ring * h) / ring};
  const double slow = std::exp(-omega * omega / (decay + ring) * h), fast = std::exp(-(decay + ring) * h);
  return {0.5 * (slow + fast), 0.5 * (slow - fast) / ring};
}

/// Derivative by w of the sum of six coefficients times the products of w.
Vec3 gradient(const double* k, const Vec3& w) noexcept {
  return {2.0 * k[0] * w[0] + k[3] * w[1] + k[4] * w[2], 2.0 * k[1] * w[1] + k[3] * w[0] + k[5] * w[2],
          2.0 * k[2] * w[2] + k[4] * w[0] + k[5] * w[1]};
}

}  // namespace

ErrorShadow::Free ErrorShadow::free_over(double omega, double decay, double h) noexcept {
  const auto [cosine, sine] = free_motion(omega, decay, h);
  return {cosine + decay * sine, sine, -omega * omega * sine, cosine - decay * sine};
}

ErrorShadow::ErrorShadow(const Plan& plan) : plan_(plan) {
  const auto n = static_cast<std::size_t>(plan.neglect.num_shadowed);
  const double h = plan.period;
  for (std::size_t c = 0; c < n; ++c) {
    const double omega = plan.omega[c], decay = plan.decay[c], M = plan.mass;
    const Free whole = free_over(omega, decay, h);
    Tick tick{whole, free_over(omega, decay, 0.5 * h), 0.5 * h * h / M, whole.from_rate / M};
    // below it the quotient loses more digits than the series of one term lacks
    if (std::max(omega, decay) * h > 1e-5 && omega > 0.0)
      tick.by_force = (1.0 - whole.from_delta) / (M * omega * omega);
    ticks_.push_back(tick);
  }
  for (std::vector<double>* values : {&spin_force_, &x_, &v_, &bent_, &missing_, &turned_}) values->resize(n);
  half_delta_.resize(n);
  const bool mixes = n > 0 && (plan.mixing.num_damping > 0 || !plan.feedbacks.empty());
  for (Array* values : {&delta_, &rate_, &force_})
    values->resize(mixes ? static_cast<std::size_t>(plan.num_padded) : n);
  if (mixes) {
    for (Array* values : {&next_delta_, &next_rate_, &zero_, &low_, &rate_low_, &kicked_})
      values->resize(delta_.size());
    scratch_.resize(mixing_scratch_size(plan));
  }
  for (std::size_t pair = 0; pair < plan.neglect.pairs.size(); ++pair) {
    const auto [l, u] = plan.neglect.pairs[pair];
    const double* const s = plan.neglect.coriolis_rows.data() + 3 * pair;
    if (l != u && std::max(l, u) < plan.neglect.num_shadowed)
      pairs_.push_back({pair, static_cast<std::size_t>(l), static_cast<std::size_t>(u), {s[0], s[1], s[2]}});
  }
  E_.resize(n * n);
  coriolis_.resize(n * n);
}

void ErrorShadow::clear() noexcept {
  for (Array* values : {&delta_, &rate_}) std::fill(values->begin(), values->end(), 0.0);
  for (std::vector<double>* values : {&spin_force_, &E_, &coriolis_})
    std::fill(values->begin(), values->end(), 0.0);
  spins_ = false;
  has_world_loads_ = false;
  H_W_ = phi_ = w_ = error_ = {};
  std::fill(turned_.begin(), turned_.end(), 0.0);
}

void ErrorShadow::set_stiffness(std::size_t l, std::size_t u, double E) noexcept {
  E_[l * size() + u] = E_[u * size() + l] = E;
}

void ErrorShadow::set_spin(const Vec3& w, const std::array<double, 6>& products,
                           std::span<const double> wheels) noexcept {
  const PlanNeglect& neglect = plan_.neglect;
  const std::size_t n = size();
  spins_ = w[0] != 0.0 || w[1] != 0.0 || w[2] != 0.0 ||
           std::any_of(wheels.begin(), wheels.end(), [](double h) { return h != 0.0; });
  if (!spins_ && std::all_of(spin_force_.begin(), spin_force_.end(), [](double f) { return f == 0.0; }))
    return;
  for (std::size_t c = 0; c < n && !neglect.spin_loads.empty(); ++c) {
    spin_force_[c] = 0.0;
    for (std::size_t k = 0; k < 6; ++k) spin_force_[c] += neglect.spin_loads[6 * c + k] * products[k];
  }
  for (const auto& [pair, l, u, s] : pairs_) {
    if (is_coupled(plan_)) break;
    coriolis_[l * n + u] = 2.0 * plan_.mass * dot(s, w);
    // -theta_l . (theta' x h a)   (X167)
    for (std::size_t k = 0; k < wheels.size(); ++k)
      coriolis_[l * n + u] -= wheels[k] * plan_.wheels.all[k].gyroscopic[pair];
    coriolis_[u * n + l] = -coriolis_[l * n + u];
  }
}

/// Halfway through a tick both motions as they ring freely: the force there makes the tick the map of a kick
/// between two free halves, up to scale, so that what pushes back neither pumps nor damps.
void ErrorShadow::go_halfway(const MotionState& state) noexcept {
  for (std::size_t c = 0; c < size(); ++c) {
    const Free& half = ticks_[c].half;
    const double stiffness = plan_.mass * plan_.omega[c] * plan_.omega[c];
    const double still = stiffness > 0.0 ? state.Q[c] / stiffness : 0.0, ring = state.q[c] - still;
    half_delta_[c] = half.from_delta * delta_[c] + half.from_rate * rate_[c];
    x_[c] = still + half.from_delta * ring + half.from_rate * state.q_dot[c] + half_delta_[c];
    v_[c] = half.rate_from_delta * (ring + delta_[c]) + half.rate_from_rate * (state.q_dot[c] + rate_[c]);
  }
}

/// X142, X143, X146, X147 of what there is with its error: third order of the energy among the shadowed
/// modes, stiffness by what else strains the links, spin, fourth order.
void ErrorShadow::find_forces(const MotionState& state) noexcept {
  const PlanNeglect& neglect = plan_.neglect;
  const std::size_t n = size();
  for (std::size_t c = 0; c < n; ++c) force_[c] = spin_force_[c] + turned_[c];
  const double* gamma = neglect.shadow_rows.data();
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = a; b < n; ++b, gamma += n)
      combine_one(gamma, -x_[a] * x_[b], true, n, force_.data());
  for (std::size_t b = 0; b < n; ++b) combine_one(E_.data() + b * n, -x_[b], true, n, force_.data());
  neglect.quartic.forms.empty() ? stretch_alike() : stretch();
  for (std::size_t c = 0; c < n && !neglect.inertia_rows.empty(); ++c)
    force_[c] += dot(gradient(neglect.inertia_rows.data() + 6 * c, w_), error_);
  for (const PlanWheel& wheel : plan_.wheels.all) push_by_wheel(wheel, state);
  if (spins_) add_coriolis();
}

/// X146: -1/2 sum_r (x^T H_r x) H_r x.
void ErrorShadow::stretch() noexcept {
  const std::size_t n = size();
  const Array& forms = plan_.neglect.quartic.forms;
  for (const double* form = forms.data(); form != forms.data() + forms.size(); form += n * n) {
    for (std::size_t b = 0; b < n; ++b) combine_one(form + b * n, x_[b], b > 0, n, bent_.data());
    double sum = 0.0;
    for (std::size_t a = 0; a < n; ++a) sum += bent_[a] * x_[a];
    combine_one(bent_.data(), -0.5 * sum, true, n, force_.data());
  }
}

/// As if all stretch were alike, of plan files that have no more.
void ErrorShadow::stretch_alike() noexcept {
  const Array& root = plan_.neglect.root_quartic;
  double all = 0.0;
  for (std::size_t c = 0; c < size(); ++c) all += root[c] * x_[c] * x_[c];
  for (std::size_t c = 0; c < size(); ++c)
    force_[c] -= root[c] * (3.0 * all - 2.0 * root[c] * x_[c] * x_[c]) * x_[c];
}

/// Of the rate halfway through the kick: they turn the motion, and a turn keeps its size.
void ErrorShadow::add_coriolis() noexcept {
  const std::size_t n = size();
  const double half = 0.5 * plan_.period / plan_.mass;
  const auto coriolis = [&](std::size_t c) {
    double sum = 0.0;
    for (std::size_t b = 0; b < n; ++b) sum += coriolis_[c * n + b] * v_[b];
    return sum;
  };
  for (std::size_t c = 0; c < n; ++c) bent_[c] = coriolis(c);
  for (std::size_t c = 0; c < n; ++c) v_[c] += half * bent_[c];
  for (std::size_t c = 0; c < n; ++c) force_[c] += coriolis(c);
}

/// Elastic turn of a body that the rung does not reckon with: its own on rungs that do not couple, the error.
Vec3 ErrorShadow::turn_at(const double* rows, const MotionState& state, const Array& delta) const noexcept {
  const std::size_t padded = index(plan_.num_padded);
  Vec3 theta = is_coupled(plan_) ? Vec3{} : contract_rows(rows, state.q.data(), padded);
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t c = 0; c < size(); ++c) theta[axis] += rows[axis * padded + c] * delta[c];
  return theta;
}

/// X148: -theta_l . (dw x h a), what the spin is off by, and what an axis that has turned makes of the spin
/// (X168).
void ErrorShadow::push_by_wheel(const PlanWheel& wheel, const MotionState& state) noexcept {
  const double* const rows = turn_rows(plan_, wheel.turning);
  const std::size_t padded = index(plan_.num_padded);
  const double h = state.wheel_momentum[index(static_cast<std::int32_t>(&wheel - plan_.wheels.all.data()))];
  const Vec3 theta = turn_at(rows, state, half_delta_), &a = wheel.axis;
  const Vec3 turned = scale(0.5, add(cross(cross(theta, a), w_), cross(a, cross(w_, theta))));
  const Vec3 torque = scale(h, sub(turned, cross(error_, a)));
  for (std::size_t c = 0; c < size(); ++c)
    force_[c] += rows[c] * torque[0] + rows[padded + c] * torque[1] + rows[2 * padded + c] * torque[2];
}

/// X148: loads act on displaced points, and those that are fixed in the world on a body that has turned
/// otherwise: b . (F x phi) = phi . (b x F) along each mode.
void ErrorShadow::take_torque(const State& state, const Mat3& R_WB) noexcept {
  RigidLoad turned;
  Vec3 torque = cross(phi_, state.moment_B);
  std::fill(turned_.begin(), turned_.end(), 0.0);
  const auto add_load = [&](const LoadPattern& pattern, const double* arms, double amplitude) {
    add_pattern(pattern, amplitude, turned);
    RigidLoad arm;
    arm.has_moment_W = pattern.has_world;
    for (std::size_t c = 0; c < size(); ++c, arms += kArmSize) {
      std::copy_n(arms, arm.moment_W.size(), arm.moment_W.begin());
      const Vec3 by_world = scale(amplitude, moment_B(arm, R_WB)),
                 by_body = scale(amplitude, {arms[27], arms[28], arms[29]});
      turned_[c] += dot(phi_, by_world);
      torque = add_scaled(torque, missing_[c], add(by_world, by_body));
    }
  };
  if (state.num_slots > 0) add_load(state.commands_pattern, state.commands_arms.data(), 1.0);
  const std::int64_t age = state.tick - state.epoch_start_tick;
  for (std::size_t k = 0; k < plan_.histories.size(); ++k) {
    const double amplitude = amplitude_left(plan_.histories[k], plan_.period, age);
    if (amplitude != 0.0)
      add_load(plan_.histories[k].pattern, plan_.neglect.load_arms.data() + k * size() * kArmSize, amplitude);
  }
  has_world_loads_ = turned.has_moment_W;
  if (has_world_loads_) {
    turned.torque_B = {};
    const Mat3 turn = {0.0, -phi_[2], phi_[1], phi_[2], 0.0, -phi_[0], -phi_[1], phi_[0], 0.0};
    torque = add(torque, moment_B(turned, multiply(R_WB, turn)));
  }
  H_W_ = add_scaled(H_W_, plan_.period, multiply(R_WB, torque));
}

/// Momentum of what rings, sum m V x V', that the rung lacks: its own on rungs that do not couple.
Vec3 ErrorShadow::ring_momentum(const MotionState& state) const noexcept {
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

/// X148: the momentum is as it is in the world, so an error of the attitude turns it in the body, and what
/// the deformation adds to the inertia is missing: phi' = dw - w x phi, dw = J^-1 (H x phi + dH - dJ w).
void ErrorShadow::turn_body(const State& state) noexcept {
  const PlanNeglect& neglect = plan_.neglect;
  if (neglect.inertia_rows.empty()) return;
  const Mat3 R_WB = rotation_matrix(state.q_WB);
  for (std::size_t c = 0; c < size(); ++c) missing_[c] = (is_coupled(plan_) ? 0.0 : state.q[c]) + delta_[c];
  take_torque(state, R_WB);
  w_ = angular_velocity(plan_, state);
  Vec3 H = multiply(plan_.inertia, w_);
  Vec3 added = sub(ring_momentum(state), multiply_transposed(R_WB, H_W_));
  for (std::size_t k = 0; k < plan_.wheels.all.size(); ++k) {  // the axis turns with its body   (X167)
    const PlanWheel& wheel = plan_.wheels.all[k];
    const Vec3 theta = turn_at(turn_rows(plan_, wheel.turning), state, delta_);
    H = add_scaled(H, state.wheel_momentum[k], wheel.axis);
    added = add_scaled(added, state.wheel_momentum[k], cross(theta, wheel.axis));
  }
  for (std::size_t c = 0; c < size(); ++c)
    added = add_scaled(added, missing_[c], gradient(neglect.inertia_rows.data() + 6 * c, w_));
  const auto spin_error = [&](const Vec3& phi) {
    return multiply(plan_.inverse_inertia, sub(cross(H, phi), added));
  };
  const auto rate = [&](const Vec3& phi) { return sub(spin_error(phi), cross(w_, phi)); };
  const double h = plan_.period;
  const Vec3 k1 = rate(phi_), k2 = rate(add_scaled(phi_, 0.5 * h, k1)),
             k3 = rate(add_scaled(phi_, 0.5 * h, k2)), k4 = rate(add_scaled(phi_, h, k3));
  phi_ = add_scaled(add_scaled(phi_, h / 6.0, add(k1, k4)), h / 3.0, add(k2, k3));
  if (const double size = norm(phi_); !(size < kMostTurn)) {
    phi_ = std::isfinite(size) ? scale(kMostTurn / size, phi_) : Vec3{kMostTurn, 0.0, 0.0};
    if (!std::isfinite(norm(H_W_))) H_W_ = {};
  }
  error_ = spin_error(phi_);
}

double ErrorShadow::turn() const noexcept { return has_world_loads_ ? norm(phi_) : 0.0; }

void ErrorShadow::advance(const State& state) noexcept {
  turn_body(state);
  go_halfway(state);
  find_forces(state);
  if (!zero_.empty()) return advance_all();
  for (std::size_t c = 0; c < size(); ++c) {
    const auto& [free, half, by_force, rate_by_force] = ticks_[c];
    const double delta = delta_[c], rate = rate_[c];
    delta_[c] = free.from_delta * delta + free.from_rate * rate + by_force * force_[c];
    rate_[c] = free.rate_from_delta * delta + free.rate_from_rate * rate + rate_by_force * force_[c];
  }
}

/// With the dashpots and feedback that the rung has. Rungs that couple resolve them by their stages; there
/// half a kick, the modes, half a kick.
void ErrorShadow::advance_all() noexcept {
  // lower parts of errors are nothing: those that come out are not taken up
  const ModalState from{delta_.data(), zero_.data(), rate_.data(), zero_.data()};
  const ModalResult to{next_delta_.data(), low_.data(), next_rate_.data(), rate_low_.data()};
  DependentLoad last_kick;
  const bool kicks = is_coupled(plan_);
  if (kicks) kick_half(delta_, false, rate_);
  advance_linear(plan_, from, force_.data(), force_.data(), kicked_, scratch_, to, last_kick);
  if (kicks) kick_half(next_delta_, true, next_rate_);
  delta_.swap(next_delta_);
  rate_.swap(next_rate_);
}

/// Feedback as it stands; dashpots one by one, implicitly: none is too stiff. The second half is the first
/// backwards.
void ErrorShadow::kick_half(const Array& delta, bool is_second, Array& rate) noexcept {
  const std::size_t n = rate.size(), num_damping = static_cast<std::size_t>(plan_.mixing.num_damping);
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
    const double* row = plan_.mixing.damping_rows.data() + (is_second ? num_damping - 1 - k : k) * n;
    const double weight = share / (1.0 + share * dot_lanes(row, row, n));
    combine_one(row, -weight * dot_lanes(row, rate.data(), n), true, n, rate.data());
  }
  if (is_second) feed();
}

void ErrorShadow::settle(const MotionState& state) noexcept {
  constexpr int kRounds = 8;  // a stiffness off by half settles to half a percent
  std::fill(delta_.begin(), delta_.end(), 0.0);
  std::fill(rate_.begin(), rate_.end(), 0.0);
  std::fill(v_.begin(), v_.end(), 0.0);
  for (int round = 0; round < kRounds; ++round) {
    std::copy_n(delta_.begin(), size(), half_delta_.begin());
    for (std::size_t c = 0; c < size(); ++c) x_[c] = state.q[c] + delta_[c];
    find_forces(state);
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
    // also where it is no number any more
    const double share = std::isfinite(amplitude) ? most / amplitude : 0.0;
    delta_[c] = share > 0.0 ? delta_[c] * share : most;
    rate_[c] = share > 0.0 ? rate_[c] * share : 0.0;
  }
}

void ErrorShadow::join(const ErrorShadow& other, const std::vector<std::int32_t>& modes) noexcept {
  for (std::size_t c = 0; c < other.size(); ++c)
    if (const auto at = static_cast<std::size_t>(modes[c]); at < size()) {
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
  const double omega = plan_.omega[mode], swing = omega > 0.0 ? rate_[mode] / omega : 0.0;
  return delta_[mode] * delta_[mode] + swing * swing;
}

}  // namespace freeflex
