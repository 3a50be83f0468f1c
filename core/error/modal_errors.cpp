#include "core/error/modal_errors.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error/validity.hpp"
#include "core/step/loads/history.hpp"
#include "core/step/loads/loads.hpp"
#include "core/step/readout.hpp"
#include "core/step/vector.hpp"

namespace freeflex {
namespace {

constexpr std::size_t kMostProducts = 512, kMostOwnProducts = 2048;  // multiplications in a tick

// [-] Geometric stiffness that spin and loads can add if the forces inside links are unknown, over w^2 and
// over acceleration / size (THEORY X143). The values are 3.05 and 3.0 for the lowest mode of a free beam.
constexpr double kUnquantifiedSpin = 4.0, kUnquantifiedLoad = 4.0;
// [-] The factor for forces that cancel. Such forces at the ends of a free beam need the factor 12.7, but
// forces that accelerate the beam need only 3. The ratio of these two is 4.2.
constexpr double kCancellingForces = 4.2;

// [rad] The largest phase of a mode between two steps. Up to this phase, the steps resolve a stiffness that
// pulsates at twice the frequency of the mode.
constexpr double kResolved = 0.5;

double square(double x) { return x * x; }
// std::abs of a complex number guards against overflow. The guard takes longer than the rest of the work in a
// tick.
double length(const std::complex<double>& z) { return std::sqrt(std::norm(z)); }

double dot(const double* a, const double* b, std::size_t n) {
  double sums[4] = {};
  std::size_t k = 0;
  for (; k + 4 <= n; k += 4)
    for (std::size_t j = 0; j < 4; ++j) sums[j] += a[k + j] * b[k + j];
  for (; k < n; ++k) sums[0] += a[k] * b[k];
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

}  // namespace

ModalErrors::ModalErrors(const StepPlan& plan, const PlanUnmodelled& unmodelled)
    : plan_(plan), unmodelled_(unmodelled), commands_(plan, unmodelled), shadow_(plan, unmodelled) {
  const auto n = index(plan.num_elastic);
  const auto num_judged = index(unmodelled.num_judged);
  modes_.resize(num_judged);
  amplitudes_.resize(num_judged);
  flexibility_.resize(n);
  quasi_static_.resize(n);
  second_.resize(n);
  num_chunks_ =
      static_cast<std::int64_t>(std::clamp((unmodelled.pairs.size() * n + kMostProducts - 1) / kMostProducts,
                                           std::size_t{1}, std::max<std::size_t>(1, num_judged)));
  round_ = static_cast<double>(num_chunks_) * plan.period;
  step_ticks_ = static_cast<std::int64_t>(std::max<std::size_t>(
      1, ((num_judged - shadow_.size()) * n + kMostOwnProducts - 1) / kMostOwnProducts));
  step_ = static_cast<double>(step_ticks_) * plan.period;
  if (!unmodelled.rate_rows.empty()) mean_rate_.resize(n), q_before_.resize(n);
  for (std::size_t l = 0; l < n; ++l) {
    if (plan.omega[l] == 0.0) continue;
    flexibility_[l] = 1.0 / (plan.mass * square(plan.omega[l]));
    if (omega_1_ == 0.0 || plan.omega[l] < omega_1_) omega_1_ = plan.omega[l];
  }
  std::size_t first = 0;
  for (const PlanHistory& history : plan.histories) {
    const std::size_t count = history.stiffening.components.size();
    if (count > 0) stiffeners_.push_back({&history, first, 0.0});
    first += count * unmodelled.pairs.size();
  }
  command_stiffeners_.reserve(plan.command_stiffening.components.size());
  for (const PlanPoint& point : plan.points) size_of_body_ = std::max(size_of_body_, norm(point.r));
  const std::size_t num_pairs = unmodelled.pairs.size();
  for (std::size_t l = 0; l < num_judged; ++l) {
    const auto mode = index(unmodelled.pairs[l][0]);
    const double omega = plan.omega[mode], decay = plan.decay[mode];
    const double phase = std::sqrt(std::max(0.0, square(omega) - square(decay))) * step_;
    modes_[l].free_step = std::polar(std::exp(-decay * step_), -phase);
    modes_[l].fade = std::exp(-decay * round_);
    first_pair_.push_back(partners_.size());
    for (std::size_t pair = num_judged; pair < num_pairs; ++pair)
      if (unmodelled.pairs[pair][0] == unmodelled.pairs[l][0])
        partners_.push_back({pair, judged_index(unmodelled.pairs[pair][1])});
  }
  first_pair_.push_back(partners_.size());
  if (!is_coupled(plan)) bound_wheel_phases();
}

/// Computes the bound of the phase rate due to gyroscopic coupling, for the modes whose error is not
/// integrated. The bound is h |a x theta_l|^2 / (2 M). Two modes of equal frequency and equal rotation reach
/// this bound (THEORY 16.26).
void ModalErrors::bound_wheel_phases() {
  const std::size_t num_judged = modes_.size(), padded = index(plan_.num_padded);
  wheel_phases_.assign((num_judged + 1) * plan_.wheels.size(), 0.0);
  std::vector<std::size_t> judged(flexibility_.size(), num_judged);
  for (std::size_t l = 0; l < num_judged; ++l) judged[index(unmodelled_.pairs[l][0])] = l;
  for (std::size_t k = 0; k < plan_.wheels.size(); ++k) {
    const PlanWheel& wheel = plan_.wheels[k];
    const double* const rows = rotation_rows(plan_, wheel.attitude_index);
    for (std::size_t mode = 0; mode < judged.size(); ++mode) {
      const Vec3 across = cross(wheel.axis, {rows[mode], rows[padded + mode], rows[2 * padded + mode]});
      double& phase = wheel_phases_[k * (num_judged + 1) + judged[mode]];
      if (judged[mode] >= shadow_.size()) phase = std::max(phase, 0.5 * dot(across, across) / plan_.mass);
    }
  }
}

double ModalErrors::wheel_phase(std::size_t l, const MotionState& state) const noexcept {
  double sum = 0.0;
  for (std::size_t k = 0; k < state.wheel_momentum.size() && !wheel_phases_.empty(); ++k)
    sum += std::abs(state.wheel_momentum[k]) * wheel_phases_[k * (modes_.size() + 1) + l];
  return sum;
}

/// Returns the index of a mode of the plan among the judged modes. If the mode is not judged, returns the
/// number of judged modes.
std::size_t ModalErrors::judged_index(std::int32_t mode) const noexcept {
  std::size_t l = 0;
  while (l < modes_.size() && unmodelled_.pairs[l][0] != mode) ++l;
  return l;
}

void ModalErrors::clear() noexcept {
  for (Mode& mode : modes_) {
    mode.amplitude_error = 0.0;
    mode.peak = mode.quasi_static_error = mode.spread = mode.unquantified = mode.growing = 0.0;
  }
  std::fill(second_.begin(), second_.end(), 0.0);
  std::fill(amplitudes_.begin(), amplitudes_.end(), std::complex<double>{});
  rest_unquantified_ = unquantified_scale_ = unquantified_before_ = 0.0;
  rest_ = fastest_ = softest_ = quartic_ = next_quartic_ = 0.0;
  chunk_ = ticks_since_step_ = 0;
  is_first_ = true;
  size_ = {};
  leaders_ = next_leaders_ = {};
  commands_.clear();
  shadow_.clear();
}

void ModalErrors::join(const ModalErrors& other, const std::vector<std::int32_t>& modes) noexcept {
  clear();
  for (std::size_t k = 0; k < other.modes_.size(); ++k) {
    const std::int32_t mode = modes[index(other.unmodelled_.pairs[k][0])];
    for (std::size_t l = 0; l < modes_.size(); ++l) {
      if (unmodelled_.pairs[l][0] != mode) continue;
      const std::complex<double> free_step = modes_[l].free_step;
      const double fade = modes_[l].fade;
      modes_[l] = other.modes_[k];
      modes_[l].free_step = free_step, modes_[l].fade = fade;
    }
  }
  rest_ = other.rest_;
  size_ = other.size_;
  shadow_.join(other.shadow_, modes);
}

void ModalErrors::take(const State& state) noexcept {
  const std::size_t n = flexibility_.size(), num_judged = modes_.size();
  if (n == 0 && unmodelled_.spin_left_out.empty()) return;
  commands_.update(state);
  if (chunk_ == 0) {
    w_ = angular_velocity(plan_, state);
    products_ = {w_[0] * w_[0], w_[1] * w_[1], w_[2] * w_[2], w_[0] * w_[1], w_[0] * w_[2], w_[1] * w_[2]};
    double loads = 0.0;
    for (std::size_t l = 0; l < n; ++l) {
      quasi_static_[l] = state.Q[l] * flexibility_[l];
      loads += square(state.Q[l]);
    }
    for (std::size_t l = 0; l < mean_rate_.size(); ++l) {
      mean_rate_[l] = is_first_ ? 0.0 : (state.q[l] - q_before_[l]) / round_;
      q_before_[l] = state.q[l];
    }
    is_first_ = false;
    shadow_.set_spin(w_, products_, state.wheel_momentum);
    if (!unmodelled_.bodies.push_rows.empty()) {
      const Mat3 R_WB = rotation_matrix(state.q_WB);
      acceleration_ = scale(1.0 / plan_.mass, multiply_transposed(R_WB, state.force_W));
      w_dot_ = multiply(plan_.inverse_inertia,
                        sub(state.moment_B, cross(w_, multiply_transposed(R_WB, state.H_W))));
    }
    // Q contains no loads before the first step
    const std::int64_t age = state.tick - state.epoch_start_tick;
    R_WB_ = rotation_matrix(state.q_WB);
    update_stiffeners(state, age);
    // rms over the mass, because a force on one light point gives a large acceleration to that point alone
    const double pull = std::max(std::sqrt(loads), internal_forces(state, age)) + norm(state.force_W),
                 acceleration = pull / plan_.mass;
    const bool is_unquantified = unmodelled_.has_unquantified || unmodelled_.lacks_modes != LacksModes::kNone;
    unquantified_before_ = unquantified_scale_;
    unquantified_scale_ =
        is_unquantified ? kUnquantifiedSpin * dot(w_, w_) + kUnquantifiedLoad * acceleration / size_of_body_
                        : 0.0;
  }
  const std::size_t chunks = index(num_chunks_), chunk = index(chunk_);
  for (std::size_t l = chunk * num_judged / chunks; l < (chunk + 1) * num_judged / chunks; ++l)
    l < shadow_.size() ? update_integrated(l, state) : update_mode(l, state);
  if (ticks_since_step_ == 0) advance_higher_modes(state);
  ticks_since_step_ = (ticks_since_step_ + 1) % step_ticks_;
  if (state.tick != state.epoch_start_tick) shadow_.advance(state, commands_);
  chunk_ = (chunk_ + 1) % num_chunks_;
  if (chunk_ == 0) finish_round(state);
}

void ModalErrors::settle(const State& state) noexcept {
  clear();
  for (std::int64_t look = 0; look < num_chunks_; ++look) take(state);
  // the second update uses the squares that the first update summed
  for (std::size_t l = 0; l < modes_.size(); ++l)
    l < shadow_.size() ? update_integrated(l, state) : update_mode(l, state);
  shadow_.settle(state);
  for (Mode& mode : modes_) mode.amplitude_error = mode.unquantified = mode.growing = 0.0;
  rest_ = rest_unquantified_ = 0.0;
  finish_round(state);
}

/// Returns the stiffness of a pair of modes that the rung neglects [N/m]   (THEORY X140, X141):
///   E_lu = sum_v (C_lu,v q_s,v + R_lu,v q_v') + spin_rows . w w + push_rows . (a_B, w') - E of the plan.
double ModalErrors::stiffness_of(std::size_t pair) const noexcept {
  const std::size_t n = flexibility_.size();
  const double* const load_row = unmodelled_.load_rows.data() + pair * n;
  double sum = 0.0;
  for (std::size_t u = 0; u < n; ++u) sum += load_row[u] * quasi_static_[u];
  if (!mean_rate_.empty()) {
    const double* const rate_row = unmodelled_.rate_rows.data() + pair * n;
    for (std::size_t u = 0; u < n; ++u) sum += rate_row[u] * mean_rate_[u];
  }
  for (std::size_t k = 0; k < 6; ++k) sum += unmodelled_.spin_rows[6 * pair + k] * products_[k];
  if (const Array& rows = unmodelled_.bodies.push_rows; !rows.empty())
    for (std::size_t k = 0; k < 3; ++k)
      sum += rows[6 * pair + k] * acceleration_[k] + rows[6 * pair + 3 + k] * w_dot_[k];
  // the plan already includes the stiffness due to its loads, to first order and for the lowest modes
  // (THEORY X145)
  for (const Stiffener& each : stiffeners_) sum -= each.amplitude * stiffened(each, pair);
  return sum - stiffened_by_commands(pair);
}

/// Sets the coefficients of the stiffness that the plan has from loads. No load has acted at age 0.
void ModalErrors::update_stiffeners(const State& state, std::int64_t age) noexcept {
  for (Stiffener& each : stiffeners_)
    each.amplitude = age == 0 ? 0.0 : amplitude_left(*each.history, plan_.period, age);
  command_stiffeners_.clear();
  const std::vector<std::int32_t>& commands = plan_.command_stiffening.components;
  if (state.num_slots == 0 || age == 0 || commands.empty()) return;
  const CommandComponents components(plan_);
  std::size_t first = unmodelled_.stiffened_rows.size() - commands.size() * unmodelled_.pairs.size();
  for (const std::int32_t component : commands) {
    const double c = command_coefficient(components, commands_.sums(), R_WB_, index(component));
    if (c != 0.0) command_stiffeners_.push_back({first, c});
    first += unmodelled_.pairs.size();
  }
}

/// Returns the stiffness of a pair of modes that the plan has from the commands that act [N/m].
double ModalErrors::stiffened_by_commands(std::size_t pair) const noexcept {
  double sum = 0.0;
  for (const CommandStiffener& each : command_stiffeners_)
    sum += each.coefficient * unmodelled_.stiffened_rows[each.first + pair];
  return sum;
}

/// Returns the stiffness of a pair of modes that the plan has from a load at amplitude 1 [N/m].
double ModalErrors::stiffened(const Stiffener& stiffener, std::size_t pair) const noexcept {
  const std::vector<std::int32_t>& components = stiffener.history->stiffening.components;
  const double* at = unmodelled_.stiffened_rows.data() + stiffener.first + pair;
  if (components.size() == 1) return *at;
  double sum = 0.0;  // a load in world axes
  for (const std::int32_t component : components) {
    sum += (component == PlanStiffening::kMotors ? 1.0 : R_WB_[index(component)]) * *at;
    at += unmodelled_.pairs.size();
  }
  return sum;
}

/// Advances the amplitude errors of the higher modes over a step, as free vibration with the stiffness E_ll
/// of each mode (THEORY X142).
void ModalErrors::advance_higher_modes(const MotionState& state) noexcept {
  const std::size_t n = flexibility_.size();
  for (std::size_t l = shadow_.size(); l < modes_.size(); ++l) {
    const auto at = index(unmodelled_.pairs[l][0]);
    const double omega = plan_.omega[at], quasi_static = state.Q[at] * flexibility_[at];
    if (omega == 0.0) continue;
    Mode& mode = modes_[l];
    amplitudes_[l] = {state.q[at] - quasi_static, state.q_dot[at] / omega};
    mode.peak = std::max(length(amplitudes_[l]) + std::abs(quasi_static) + std::abs(mode.quasi_static_error),
                         mode.peak);
    apply_stiffness(l, is_resolved(l)
                           ? mode.steady + dot(unmodelled_.load_rows.data() + l * n, state.q.data(), n)
                           : mode.stiffness);
    mode.amplitude_error *= mode.free_step;
    const double size = length(mode.amplitude_error), most = 2.0 * size_of_body_;
    if (!(size <= most))
      mode.amplitude_error = std::isfinite(size) ? mode.amplitude_error * (most / size) : most;
  }
}

/// Applies a neglected stiffness E_ll over a step to the amplitude a of a mode with its error D. If steps
/// resolve the vibration, the stiffness gives an impulse -i E_ll Re(a + D) h / (M omega_l). Otherwise it
/// rotates the phase by -omega_l e_l h / 2, where e_l is the relative stiffness (THEORY X142).
void ModalErrors::apply_stiffness(std::size_t l, double stiffness) noexcept {
  const std::complex<double> motion = amplitudes_[l] + modes_[l].amplitude_error;
  const auto at = index(unmodelled_.pairs[l][0]);
  const double rate = 0.5 * plan_.omega[at] * stiffness * flexibility_[at] * step_;
  const std::complex<double> after = is_resolved(l)
                                         ? motion - std::complex<double>(0.0, 2.0 * rate * motion.real())
                                         : motion * std::polar(1.0, -rate);
  modes_[l].amplitude_error += after - motion;
}

/// Applies a neglected stiffness between two modes and the Coriolis coupling, (i E_lu / (2 M omega_l) +
/// w.s_lu) h, first to one mode and then to the other, so that one gains what the other loses
/// (THEORY X142).
void ModalErrors::apply_coupling(std::size_t l, std::size_t u, double stiffness, double coriolis) noexcept {
  const auto omega_of = [&](std::size_t mode) { return plan_.omega[index(unmodelled_.pairs[mode][0])]; };
  const bool is_impulse = std::max(omega_of(l), omega_of(u)) * round_ <= kResolved;
  const auto push = [&](std::size_t to, std::size_t from, double coupling) {
    const std::complex<double> motion = amplitudes_[from] + modes_[from].amplitude_error;
    const double rate = 0.5 * stiffness / (plan_.mass * omega_of(to)) * round_;
    const std::complex<double> change = is_impulse ? std::complex<double>(0.0, 2.0 * rate * motion.real())
                                                   : std::complex<double>(0.0, rate) * motion;
    modes_[to].amplitude_error -= change + coupling * round_ * motion;
  };
  push(l, u, coriolis);
  push(u, l, -coriolis);
}

bool ModalErrors::is_resolved(std::size_t l) const noexcept {
  return plan_.omega[index(unmodelled_.pairs[l][0])] * step_ <= kResolved;
}

void ModalErrors::update_mode(std::size_t l, const MotionState& state) noexcept {
  Mode& mode = modes_[l];
  const auto at = index(unmodelled_.pairs[l][0]);
  const double omega = plan_.omega[at];
  double stiffness = stiffness_of(l);
  // second order of the displacements: the load -C_ll,u q_l^2 / 2 on mode u   (THEORY X143)
  const double* const row = unmodelled_.load_rows.data() + l * flexibility_.size();
  for (std::size_t u = 0; u < second_.size(); ++u) second_[u] += row[u] * square(state.q[at]);
  if (omega == 0.0) return update_mechanism(l, stiffness, state);

  // amplitude-averaged cubic stiffness: 3/4 beta_l |a_l|^2 of the mode itself, 3/2 sqrt(beta_l beta_b)
  // |a_b|^2 of the other modes b; root is sqrt(beta_l)   (THEORY X146)
  const double root = unmodelled_.root_quartic[l],
               own = root * square(length(amplitudes_[l]) + std::abs(quasi_static_[at]));
  next_quartic_ += own;
  stiffness += root * (1.5 * std::max(0.0, quartic_ - own) + 0.75 * own);
  const double change = stiffness * flexibility_[at];
  soften(change, static_cast<std::int32_t>(at), false);
  // The steps do not resolve a stiffness that changes between two updates. If the relative stiffness pulsates
  // by e, the growth rate is omega e / 4 (Mathieu).
  const double pulse = is_resolved(l) ? 0.0 : std::abs(stiffness - mode.stiffness) * flexibility_[at];
  mode.stiffness = stiffness;
  mode.steady = stiffness - dot(row, quasi_static_.data(), quasi_static_.size());
  for (std::size_t k = first_pair_[l]; k < first_pair_[l + 1]; ++k) {
    const auto [pair, u] = partners_[k];
    const double* const s = unmodelled_.coriolis_rows.data() + 3 * pair;
    apply_coupling(l, u, stiffness_of(pair),
                   is_coupled(plan_) ? 0.0 : s[0] * w_[0] + s[1] * w_[1] + s[2] * w_[2]);
  }
  double quasi_static_error = -change * quasi_static_[at];
  for (std::size_t k = 0; k < 6 && !unmodelled_.spin_loads.empty(); ++k)
    quasi_static_error += unmodelled_.spin_loads[6 * at + k] * products_[k] * flexibility_[at];
  mode.amplitude_error -= quasi_static_error - mode.quasi_static_error;
  mode.quasi_static_error = quasi_static_error;
  mode.peak *= mode.fade;
  // errors spread to other modes, because mode shapes change with the stiffness and Coriolis forces excite
  // other modes
  mode.spread = std::abs(change) * (length(amplitudes_[l]) + std::abs(quasi_static_[at])) +
                std::sqrt(2.0 * std::max(0.0, coriolis_transfer(l))) * length(amplitudes_[l]);
  fastest_ = std::max(fastest_, 0.5 * omega * std::abs(change));
  update_unquantified(l, pulse, state);
}

/// Updates a mode whose error is integrated. Updates the mode's stiffness due to other modes and to the spin,
/// and the mode's amplitude.
void ModalErrors::update_integrated(std::size_t l, const MotionState& state) noexcept {
  const std::size_t n = flexibility_.size(), num_shadowed = shadow_.size();
  const auto set = [&](std::size_t pair, std::size_t u) {
    const double whole = stiffness_of(pair);
    double among = 0.0;  // the contribution of integrated modes, which is already in the third derivatives
                         // (THEORY X147)
    for (std::size_t v = 0; v < num_shadowed; ++v)
      among += unmodelled_.load_rows[pair * n + v] * quasi_static_[v];
    shadow_.set_stiffness(l, u, whole - among);
    return whole;
  };
  const double stiffness = set(l, l);
  for (std::size_t k = first_pair_[l]; k < first_pair_[l + 1]; ++k)
    if (partners_[k].u < num_shadowed) set(partners_[k].pair, partners_[k].u);
  Mode& mode = modes_[l];
  for (std::size_t u = num_shadowed; u < n; ++u)
    second_[u] += unmodelled_.load_rows[l * n + u] * square(state.q[l]);
  const double omega = plan_.omega[l];
  if (omega == 0.0) {
    mode.peak = std::max(mode.peak, std::abs(state.q[l]));
    return;
  }
  amplitudes_[l] = {state.q[l] - quasi_static_[l], state.q_dot[l] / omega};
  mode.peak = std::max(length(amplitudes_[l]) + std::abs(quasi_static_[l]), mode.peak * mode.fade);
  next_quartic_ += unmodelled_.root_quartic[l] * square(length(amplitudes_[l]) + std::abs(quasi_static_[l]));
  const double change = stiffness * flexibility_[l];
  soften(change, static_cast<std::int32_t>(l), false);
  fastest_ = std::max(fastest_, 0.5 * omega * std::abs(change));
  mode.spread = std::sqrt(2.0 * std::max(0.0, coriolis_transfer(l))) * length(amplitudes_[l]);
  update_unquantified(l, 0.0, state);
}

/// Returns a measure of the forces inside links whose internal forces are unknown [N], or 0 without such
/// links. The measure is the size of a load that accelerates the body and strains the links as much as the
/// motion does. Free vibration strains such links like loads do. Loads that cancel within rigid links excite
/// no mode, but they reduce the stiffness more than loads that accelerate the body, so the measure is at
/// least 4.2 (sum |f| - |sum f|) (THEORY X143).
double ModalErrors::internal_forces(const State& state, std::int64_t age) const noexcept {
  if (unmodelled_.bodies.unquantified_factor.empty()) return 0.0;
  double strains = 0.0, sum = commands_.size();
  for (std::size_t l = 0; l < flexibility_.size(); ++l)
    if (flexibility_[l] > 0.0) strains += square(state.q[l] / flexibility_[l]);
  for (std::size_t k = 0; k < unmodelled_.bodies.load_sizes.size() && age > 0; ++k)
    sum += unmodelled_.bodies.load_sizes[k] * std::abs(amplitude_left(plan_.histories[k], plan_.period, age));
  return std::max(kCancellingForces * std::max(0.0, sum - norm(state.force_W)), std::sqrt(strains));
}

/// Returns the square of the relative amplitude that Coriolis forces excite in modes that are not partners,
/// sum_u (2 omega_l w.s_lu / (omega_u^2 - omega_l^2))^2   (THEORY X141).
double ModalErrors::coriolis_transfer(std::size_t l) const noexcept {
  double transfer = 0.0;
  for (std::size_t k = 0; k < 6 && !unmodelled_.coriolis_transfer.empty(); ++k)
    transfer += unmodelled_.coriolis_transfer[6 * l + k] * products_[k];
  return transfer;
}

/// Returns the unquantified relative stiffness change of a mode [-]   (THEORY X143).
/// \param change  [1/s^2] the relative change, times omega_1 omega_l
double ModalErrors::unquantified_stiffness(std::size_t l, double change) const noexcept {
  const Array& factor = unmodelled_.bodies.unquantified_factor;
  const double omega = plan_.omega[index(unmodelled_.pairs[l][0])];
  return change * (l < factor.size() ? factor[l] : 1.0) / (omega_1_ * omega);
}

/// Updates the unquantified error of a mode. For an unquantified relative stiffness u, the phase error grows
/// at the rate omega u / 2. If u > 1, the amplitude grows at the rate omega (u - 1)^(1/2). If u changes, the
/// amplitude grows at the rate omega |change| / 4 (THEORY X143). \param pulse [-] relative change of
/// stiffness that the steps do not resolve
void ModalErrors::update_unquantified(std::size_t l, double pulse, const MotionState& state) noexcept {
  Mode& mode = modes_[l];
  const double omega = plan_.omega[index(unmodelled_.pairs[l][0])], amplitude = length(amplitudes_[l]);
  const double unquantified = unquantified_stiffness(l, unquantified_scale_);
  const double phase = (0.5 * omega * unquantified + wheel_phase(l, state)) * round_;
  mode.unquantified = std::min(2.0 * mode.peak, (mode.unquantified + phase * amplitude) * mode.fade);
  pulse += std::abs(unquantified - unquantified_stiffness(l, unquantified_before_));
  const double growth = omega * (0.25 * pulse + std::sqrt(std::max(0.0, unquantified - 1.0))) * round_;
  mode.growing =
      std::min(2.0 * size_of_body_, (mode.growing + growth * (mode.growing + amplitude)) * mode.fade);
}

/// Updates a mechanism. The only stiffness of a mechanism is geometric. The member `amplitude_error` holds
/// the error [m] and the rate of the error [m/s].
void ModalErrors::update_mechanism(std::size_t l, double stiffness, const MotionState& state) noexcept {
  Mode& mode = modes_[l];
  const auto at = index(unmodelled_.pairs[l][0]);
  double force = -stiffness * state.q[at];
  for (std::size_t k = 0; k < 6 && !unmodelled_.spin_loads.empty(); ++k)
    force += unmodelled_.spin_loads[6 * at + k] * products_[k];
  const double rate = mode.amplitude_error.imag() + force / plan_.mass * round_;
  mode.peak = std::max(mode.peak, std::abs(state.q[at]));
  mode.amplitude_error = {
      std::clamp(mode.amplitude_error.real() + rate * round_, -2.0 * size_of_body_, 2.0 * size_of_body_),
      rate};
}

/// Updates the softening of omitted modes. No load excites omitted modes, but they can buckle like other
/// modes.
void ModalErrors::update_left_out() noexcept {
  const std::size_t n = flexibility_.size();
  for (std::size_t l = 0; l < unmodelled_.left_out_spin.size() / 6; ++l) {
    double change = 0.0;
    for (std::size_t u = 0; u < n; ++u) change += unmodelled_.left_out_rows[l * n + u] * quasi_static_[u];
    for (std::size_t k = 0; k < 6; ++k) change += unmodelled_.left_out_spin[6 * l + k] * products_[k];
    soften(change, static_cast<std::int32_t>(l), true);
  }
}

void ModalErrors::soften(double change, std::int32_t mode, bool is_left_out) noexcept {
  if (!(-change > softest_)) return;
  softest_ = -change;
  next_leaders_.softest = mode;
  next_leaders_.is_left_out = is_left_out;
}

/// Returns the largest rate of the unquantified error that the axis of a wheel causes [m/s], and sets `wheel`
/// to the index of this wheel.
double ModalErrors::wheel_error(const MotionState& state, std::int32_t& wheel) const noexcept {
  double most = 0.0;
  for (std::size_t k = 0; k < state.wheel_momentum.size() && !wheel_phases_.empty(); ++k)
    for (std::size_t l = 0; l <= modes_.size(); ++l) {
      const double amplitude = l < modes_.size() ? length(amplitudes_[l]) : rest_unquantified_;
      const double each =
          std::abs(state.wheel_momentum[k]) * wheel_phases_[k * (modes_.size() + 1) + l] * amplitude;
      if (each > most) most = each, wheel = static_cast<std::int32_t>(k);
    }
  return most;
}

void ModalErrors::find_leaders(const MotionState& state) noexcept {
  ModalLeaders& next = next_leaders_;
  double error = 0.0, displaced = 0.0, unquantified = 0.0, by_links = 0.0;
  for (std::size_t u = 0; u < flexibility_.size(); ++u)
    if (square(state.q[u]) > displaced)
      displaced = square(state.q[u]), next.displaced = static_cast<std::int32_t>(u);
  for (std::size_t l = 0; l < modes_.size(); ++l) {
    const Mode& mode = modes_[l];
    const std::int32_t at = unmodelled_.pairs[l][0];
    const auto index_in_plan = index(at);
    const double own =
        square(mode.spread) + (l < shadow_.size() ? shadow_.square_of(index_in_plan)
                               : plan_.omega[index_in_plan] == 0.0
                                   ? square(mode.amplitude_error.real())
                                   : std::norm(mode.amplitude_error + mode.quasi_static_error));
    if (own > error) error = own, next.error = at;
    if (plan_.omega[index_in_plan] == 0.0) continue;
    const double change = unquantified_stiffness(l, unquantified_scale_),
                 unquantified_square = square(mode.unquantified) + square(mode.growing) +
                                       square(change * quasi_static_[index_in_plan]);
    if (unquantified_square > unquantified) unquantified = unquantified_square, next.unquantified = at;
    by_links = std::max(by_links, 0.5 * plan_.omega[index_in_plan] * change * length(amplitudes_[l]));
  }
  if (!(wheel_error(state, next.wheel) > by_links)) next.wheel = -1;
  leaders_ = std::exchange(next_leaders_, {});
}

/// Returns the stiffness [N/m] that shifts the phase of a mode by the same angle as the Coriolis forces
/// between the mode and its partners. Returns 0 on the coupled rungs, because they include these forces.
double ModalErrors::coriolis_stiffness(std::size_t l) const noexcept {
  if (is_coupled(plan_)) return 0.0;
  const std::int32_t mode = unmodelled_.pairs[l][0];
  double most = 0.0;
  for (std::size_t pair = modes_.size(); pair < unmodelled_.pairs.size(); ++pair) {
    if (unmodelled_.pairs[pair][0] != mode && unmodelled_.pairs[pair][1] != mode) continue;
    const double* const s = unmodelled_.coriolis_rows.data() + 3 * pair;
    most = std::max(most, std::abs(s[0] * w_[0] + s[1] * w_[1] + s[2] * w_[2]));
  }
  return 2.0 * plan_.mass * plan_.omega[index(mode)] * most;
}

/// Finds the wheel with the largest effect on a mode below the coupled rungs. The effect comes from
/// gyroscopic forces between the mode and its partners (THEORY 16.24), or from the torque of the wheel's
/// rotated axis on the body (THEORY 16.25, X148).
void ModalErrors::find_wheel(std::size_t l, const MotionState& state,
                             StiffnessChanges& changes) const noexcept {
  if (is_coupled(plan_)) return;
  const std::int32_t mode = unmodelled_.pairs[l][0];
  const auto at = index(mode), padded = index(plan_.num_padded);
  for (std::size_t k = 0; k < state.wheel_momentum.size(); ++k) {
    const PlanWheel& wheel = plan_.wheels[k];
    const double* const rows = rotation_rows(plan_, wheel.attitude_index);
    const Vec3 across = cross(wheel.axis, {rows[at], rows[padded + at], rows[2 * padded + at]});
    const double h = std::abs(state.wheel_momentum[k]);
    double most = 0.0;
    for (std::size_t pair = modes_.size(); pair < unmodelled_.pairs.size(); ++pair)
      if (unmodelled_.pairs[pair][0] == mode || unmodelled_.pairs[pair][1] == mode)
        most = std::max(most, std::abs(unmodelled_.gyroscopic[k * unmodelled_.pairs.size() + pair]));
    const double change =
        h * plan_.omega[at] * most + h * h * dot(across, multiply(plan_.inverse_inertia, across));
    if (change > changes.wheel) changes.wheel = change, changes.largest_wheel = static_cast<std::int32_t>(k);
  }
}

/// Returns the row (num_elastic) of the stiffness of a mode per quasi-static coordinate. If the mode is not
/// judged, returns nullptr.
const double* ModalErrors::load_row(const JudgedMode& named) const noexcept {
  const std::size_t n = flexibility_.size();
  if (named.mode < 0) return nullptr;
  if (named.is_left_out) return unmodelled_.left_out_rows.data() + index(named.mode) * n;
  const std::size_t l = judged_index(named.mode);
  return l < modes_.size() ? unmodelled_.load_rows.data() + l * n : nullptr;
}

double ModalErrors::stiffness_by(const JudgedMode& named, const double* Q) const noexcept {
  const double* const row = load_row(named);
  double sum = 0.0;
  for (std::size_t u = 0; u < flexibility_.size() && row != nullptr; ++u)
    sum += row[u] * Q[u] * flexibility_[u];
  return sum;
}

double ModalErrors::stiffened_by(const JudgedMode& named, const PlanHistory& history) const noexcept {
  const std::size_t l = named.mode < 0 || named.is_left_out ? modes_.size() : judged_index(named.mode);
  for (const Stiffener& each : stiffeners_)
    if (each.history == &history && l < modes_.size()) return stiffened(each, l);
  return 0.0;
}

double ModalErrors::stiffened_by_commands(const JudgedMode& named) const noexcept {
  const std::size_t l = named.mode < 0 || named.is_left_out ? modes_.size() : judged_index(named.mode);
  return l < modes_.size() ? stiffened_by_commands(l) : 0.0;
}

StiffnessChanges ModalErrors::stiffness_changes(const JudgedMode& named,
                                                const MotionState& state) const noexcept {
  StiffnessChanges changes;
  const double* const row = load_row(named);
  if (row == nullptr) return changes;
  const std::size_t l = named.is_left_out ? index(named.mode) : judged_index(named.mode);
  const Array& spin_rows = named.is_left_out ? unmodelled_.left_out_spin : unmodelled_.spin_rows;
  for (std::size_t k = 0; k < 6; ++k) changes.spin += spin_rows[6 * l + k] * products_[k];
  changes.spin = std::abs(changes.spin);
  double sum = 0.0;
  for (std::size_t u = 0; u < flexibility_.size(); ++u) {
    const double rate = plan_.omega[u] > 0.0 ? state.q_dot[u] / plan_.omega[u] : 0.0;
    sum += square(row[u]) * (square(state.q[u] - quasi_static_[u]) + square(rate));
  }
  changes.vibration = std::sqrt(sum);
  if (named.is_left_out) return changes;
  changes.spin += coriolis_stiffness(l);
  find_wheel(l, state, changes);
  return changes;
}

void ModalErrors::finish_round(const MotionState& state) noexcept {
  const std::size_t n = flexibility_.size();
  update_left_out();
  double all = 0.0, envelope = 0.0, judged_amplitude = 0.0, error = 0.0, second_order = 0.0, spin = 0.0,
         unquantified = 0.0, amplitude = 0.0, spread = 0.0, slowest = 0.0;
  for (std::size_t u = 0; u < n; ++u) {
    all += square(state.q[u]);
    envelope += square(state.q[u]) + (flexibility_[u] > 0.0 ? square(state.q_dot[u] / plan_.omega[u]) : 0.0);
    second_order += square(0.5 * second_[u] * flexibility_[u]);
    double quasi_static = 0.0;
    for (std::size_t k = 0; k < 6 && !unmodelled_.spin_loads.empty(); ++k)
      quasi_static += unmodelled_.spin_loads[6 * u + k] * products_[k] * flexibility_[u];
    spin += square(quasi_static);
    if (flexibility_[u] > 0.0)
      amplitude += square(state.q[u] - quasi_static_[u]) + square(state.q_dot[u] / plan_.omega[u]);
    if (slowest == 0.0 || plan_.decay[u] < slowest) slowest = plan_.decay[u];
    second_[u] = 0.0;
  }
  for (std::size_t a = 0; a < 6 && !unmodelled_.spin_left_out.empty(); ++a)
    for (std::size_t b = 0; b < 6; ++b)
      spin += unmodelled_.spin_left_out[6 * a + b] * products_[a] * products_[b];
  spin = std::max(0.0, spin);
  double judged_spin = 0.0;
  shadow_.limit(2.0 * size_of_body_);
  error += shadow_.square();
  // The attitude error also rotates the loads on the higher modes. The error of the higher modes is phi times
  // their quasi-static response.
  if (const double attitude_error = shadow_.attitude_error(); attitude_error > 0.0) {
    double quasi_static = 0.0;
    for (std::size_t u = shadow_.size(); u < n; ++u) quasi_static += square(quasi_static_[u]);
    error += square(attitude_error) * quasi_static;
  }
  for (std::size_t l = 0; l < modes_.size(); ++l) {
    const Mode& mode = modes_[l];
    const auto at = index(unmodelled_.pairs[l][0]);
    const bool is_mechanism = plan_.omega[at] == 0.0;
    if (l >= shadow_.size())
      error += is_mechanism ? square(mode.amplitude_error.real())
                            : std::norm(mode.amplitude_error + mode.quasi_static_error);
    judged_amplitude += std::norm(amplitudes_[l]);
    spread += square(mode.spread);
    unquantified += square(mode.unquantified) + square(mode.growing);
    if (!is_mechanism)
      unquantified += square(unquantified_stiffness(l, unquantified_scale_) * quasi_static_[at]);
    double quasi_static = 0.0;
    for (std::size_t k = 0; k < 6 && !unmodelled_.spin_loads.empty(); ++k)
      quasi_static += unmodelled_.spin_loads[6 * at + k] * products_[k] * flexibility_[at];
    judged_spin += square(quasi_static);
  }
  const double other_amplitude = std::sqrt(std::max(0.0, amplitude - judged_amplitude));
  rest_ = std::min(2.0 * other_amplitude,
                   (rest_ + fastest_ * round_ * other_amplitude) * std::exp(-slowest * round_));
  rest_unquantified_ =
      std::min(2.0 * other_amplitude,
               (rest_unquantified_ + wheel_phase(modes_.size(), state) * round_ * other_amplitude) *
                   std::exp(-slowest * round_));
  unquantified += square(rest_unquantified_) + square(unmodelled_.bodies.inner_load * dot(w_, w_));
  fastest_ = 0.0;
  quartic_ = std::exchange(next_quartic_, 0.0);
  find_leaders(state);
  size_.softening = std::exchange(softest_, 0.0);
  size_.displacement = std::sqrt(all);
  size_.envelope = std::sqrt(envelope);
  size_.second_order = std::sqrt(second_order);
  size_.spin = std::sqrt(spin);
  size_.error = std::sqrt(error + spread + second_order + square(rest_) + square(unmodelled_.left_out) +
                          std::max(0.0, spin - judged_spin));
  size_.unquantified = std::sqrt(unquantified);
}

}  // namespace freeflex
