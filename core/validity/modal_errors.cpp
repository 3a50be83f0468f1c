#include "core/validity/modal_errors.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/step/history.hpp"
#include "core/step/readout.hpp"
#include "core/step/vector.hpp"
#include "core/validity/validity.hpp"

namespace freeflex {
namespace {

constexpr std::size_t kMostProducts = 512, kMostOwnProducts = 2048;  // of a tick

// Stiffness that spin and loads can add where nothing tells how links carry them, in units of w^2 and of the
// acceleration over the size. A free beam has 3.05 and 3.0 in its lowest mode.
constexpr double kUnseenSpin = 4.0, kUnseenLoad = 4.0;
// [-] forces that cancel at the ends of a free beam take 12.7 of it, forces that accelerate it 3
constexpr double kSqueeze = 4.2;

// of the stiffness by followers that the plan is taken to have: the rest counts as neglected
constexpr double kFollowerShare = 0.9;

// [rad] between two steps of a mode: what swings twice as fast is told from what stands
constexpr double kResolved = 0.5;

double square(double x) { return x * x; }
// without the care of std::abs for what overflows, which takes longer than all else
double length(const std::complex<double>& z) { return std::sqrt(std::norm(z)); }

/// [N/m] stiffness of a pair of modes by followers at amplitude 1 that the plan is taken to have.
double followed(const PlanHistory& history, std::int32_t l, std::int32_t u) noexcept {
  const std::vector<std::int32_t>& modes = history.stiffening.modes;
  const auto at_l = std::lower_bound(modes.begin(), modes.end(), l),
             at_u = std::lower_bound(modes.begin(), modes.end(), u);
  if (at_l == modes.end() || *at_l != l || at_u == modes.end() || *at_u != u) return 0.0;
  const auto row = static_cast<std::size_t>(at_l - modes.begin()),
             column = static_cast<std::size_t>(at_u - modes.begin());
  return kFollowerShare * history.stiffening.rows[row * modes.size() + column];
}

double dot(const double* a, const double* b, std::size_t n) {
  double sums[4] = {};
  std::size_t k = 0;
  for (; k + 4 <= n; k += 4)
    for (std::size_t j = 0; j < 4; ++j) sums[j] += a[k + j] * b[k + j];
  for (; k < n; ++k) sums[0] += a[k] * b[k];
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

}  // namespace

ModalErrors::ModalErrors(const Plan& plan) : plan_(plan), shadow_(plan) {
  const auto n = static_cast<std::size_t>(plan.num_elastic);
  const auto num_judged = static_cast<std::size_t>(plan.neglect.num_judged);
  modes_.resize(num_judged);
  swing_.resize(num_judged);
  flexibility_.resize(n);
  still_.resize(n);
  second_.resize(n);
  num_chunks_ = static_cast<std::int64_t>(
      std::clamp((plan.neglect.pairs.size() * n + kMostProducts - 1) / kMostProducts, std::size_t{1},
                 std::max<std::size_t>(1, num_judged)));
  round_ = static_cast<double>(num_chunks_) * plan.period;
  every_ = static_cast<std::int64_t>(std::max<std::size_t>(
      1, ((num_judged - shadow_.size()) * n + kMostOwnProducts - 1) / kMostOwnProducts));
  step_ = static_cast<double>(every_) * plan.period;
  if (!plan.neglect.rate_rows.empty()) creep_.resize(n), q_before_.resize(n);
  for (std::size_t l = 0; l < n; ++l) {
    if (plan.omega[l] == 0.0) continue;
    flexibility_[l] = 1.0 / (plan.mass * square(plan.omega[l]));
    if (omega_1_ == 0.0 || plan.omega[l] < omega_1_) omega_1_ = plan.omega[l];
  }
  for (const PlanHistory& history : plan.histories)
    if (!history.stiffening.modes.empty()) followers_.push_back({&history, 0.0});
  for (const PlanPoint& point : plan.points) size_of_body_ = std::max(size_of_body_, norm(point.r));
  const std::size_t num_pairs = plan.neglect.pairs.size();
  for (std::size_t l = 0; l < num_judged; ++l) {
    const auto mode = static_cast<std::size_t>(plan.neglect.pairs[l][0]);
    const double omega = plan.omega[mode], decay = plan.decay[mode];
    const double turn = std::sqrt(std::max(0.0, square(omega) - square(decay))) * step_;
    modes_[l].turn = std::polar(std::exp(-decay * step_), -turn);
    modes_[l].fade = std::exp(-decay * round_);
    first_pair_.push_back(partners_.size());
    for (std::size_t pair = num_judged; pair < num_pairs; ++pair)
      if (plan.neglect.pairs[pair][0] == plan.neglect.pairs[l][0])
        partners_.push_back({pair, judged_place(plan.neglect.pairs[pair][1])});
  }
  first_pair_.push_back(partners_.size());
  if (!is_coupled(plan)) weigh_wheels();
}

/// Gyroscopic coupling of modes beyond those whose error is integrated: of two that turn alike and stand
/// close it turns the phase by h |a x theta_l|^2 / (2 M), which is as much as it can   (X148).
void ModalErrors::weigh_wheels() {
  const std::size_t num_judged = modes_.size(), padded = static_cast<std::size_t>(plan_.num_padded);
  wheel_phases_.assign((num_judged + 1) * plan_.wheels.all.size(), 0.0);
  std::vector<std::size_t> place(flexibility_.size(), num_judged);
  for (std::size_t l = 0; l < num_judged; ++l) place[static_cast<std::size_t>(plan_.neglect.pairs[l][0])] = l;
  for (std::size_t k = 0; k < plan_.wheels.all.size(); ++k) {
    const PlanWheel& wheel = plan_.wheels.all[k];
    const double* const rows = turn_rows(plan_, wheel.turning);
    for (std::size_t mode = 0; mode < place.size(); ++mode) {
      const Vec3 across = cross(wheel.axis, {rows[mode], rows[padded + mode], rows[2 * padded + mode]});
      double& phase = wheel_phases_[k * (num_judged + 1) + place[mode]];
      if (place[mode] >= shadow_.size()) phase = std::max(phase, 0.5 * dot(across, across) / plan_.mass);
    }
  }
}

double ModalErrors::wheel_phase(std::size_t l, const MotionState& state) const noexcept {
  double sum = 0.0;
  for (std::size_t k = 0; k < state.wheel_momentum.size() && !wheel_phases_.empty(); ++k)
    sum += std::abs(state.wheel_momentum[k]) * wheel_phases_[k * (modes_.size() + 1) + l];
  return sum;
}

/// Judged mode of a mode of the plan; their number: it is not judged.
std::size_t ModalErrors::judged_place(std::int32_t mode) const noexcept {
  std::size_t l = 0;
  while (l < modes_.size() && plan_.neglect.pairs[l][0] != mode) ++l;
  return l;
}

void ModalErrors::clear() noexcept {
  for (Mode& mode : modes_) {
    mode.ring = 0.0;
    mode.most = mode.still = mode.spread = mode.unseen = mode.pumped = 0.0;
  }
  std::fill(second_.begin(), second_.end(), 0.0);
  std::fill(swing_.begin(), swing_.end(), std::complex<double>{});
  rest_hidden_ = unseen_share_ = unseen_before_ = 0.0;
  rest_ = fastest_ = softest_ = quartic_ = next_quartic_ = 0.0;
  chunk_ = since_ = 0;
  is_first_ = true;
  size_ = {};
  leaders_ = next_leaders_ = {};
  shadow_.clear();
}

void ModalErrors::join(const ModalErrors& other, const std::vector<std::int32_t>& modes) noexcept {
  clear();
  for (std::size_t k = 0; k < other.modes_.size(); ++k) {
    const std::int32_t mode = modes[static_cast<std::size_t>(other.plan_.neglect.pairs[k][0])];
    for (std::size_t l = 0; l < modes_.size(); ++l) {
      if (plan_.neglect.pairs[l][0] != mode) continue;
      const std::complex<double> turn = modes_[l].turn;
      const double fade = modes_[l].fade;
      modes_[l] = other.modes_[k];
      modes_[l].turn = turn, modes_[l].fade = fade;
    }
  }
  rest_ = other.rest_;
  size_ = other.size_;
  shadow_.join(other.shadow_, modes);
}

void ModalErrors::take(const State& state) noexcept {
  const std::size_t n = flexibility_.size(), num_judged = modes_.size();
  if (n == 0 && plan_.neglect.spin_left_out.empty()) return;
  if (chunk_ == 0) {
    w_ = angular_velocity(plan_, state);
    products_ = {w_[0] * w_[0], w_[1] * w_[1], w_[2] * w_[2], w_[0] * w_[1], w_[0] * w_[2], w_[1] * w_[2]};
    double loads = 0.0;
    for (std::size_t l = 0; l < n; ++l) {
      still_[l] = state.Q[l] * flexibility_[l];
      loads += square(state.Q[l]);
    }
    for (std::size_t l = 0; l < creep_.size(); ++l) {
      creep_[l] = is_first_ ? 0.0 : (state.q[l] - q_before_[l]) / round_;
      q_before_[l] = state.q[l];
    }
    is_first_ = false;
    shadow_.set_spin(w_, products_, state.wheel_momentum);
    if (!plan_.neglect.bodies.push_rows.empty()) {
      const Mat3 R_WB = rotation_matrix(state.q_WB);
      push_ = scale(1.0 / plan_.mass, multiply_transposed(R_WB, state.force_W));
      w_dot_ = multiply(plan_.inverse_inertia,
                        sub(state.moment_B, cross(w_, multiply_transposed(R_WB, state.H_W))));
    }
    // before the first step no load stands in Q
    const std::int64_t age = state.tick - state.epoch_start_tick;
    for (Follower& follower : followers_)
      follower.amplitude = age == 0 ? 0.0 : amplitude_left(*follower.history, plan_.period, age);
    // rms over the mass: a force on one light point is large where it acts
    const double pull = std::max(std::sqrt(loads), squeeze(state, age)) + norm(state.force_W),
                 acceleration = pull / plan_.mass;
    const bool hides = plan_.neglect.has_unseen || plan_.neglect.lacks_modes != LacksModes::kNone;
    unseen_before_ = unseen_share_;
    unseen_share_ = hides ? kUnseenSpin * dot(w_, w_) + kUnseenLoad * acceleration / size_of_body_ : 0.0;
  }
  const std::size_t chunks = static_cast<std::size_t>(num_chunks_), chunk = static_cast<std::size_t>(chunk_);
  for (std::size_t l = chunk * num_judged / chunks; l < (chunk + 1) * num_judged / chunks; ++l)
    l < shadow_.size() ? look_at_shadowed(l, state) : look_at(l, state);
  if (since_ == 0) go_on(state);
  since_ = (since_ + 1) % every_;
  if (state.tick != state.epoch_start_tick) shadow_.advance(state);
  chunk_ = (chunk_ + 1) % num_chunks_;
  if (chunk_ == 0) finish_round(state);
}

void ModalErrors::settle(const State& state) noexcept {
  clear();
  for (std::int64_t look = 0; look < num_chunks_; ++look) take(state);
  // once more, with the squares that were added up
  for (std::size_t l = 0; l < modes_.size(); ++l)
    l < shadow_.size() ? look_at_shadowed(l, state) : look_at(l, state);
  shadow_.settle(state);
  for (Mode& mode : modes_) mode.ring = mode.unseen = mode.pumped = 0.0;
  rest_ = rest_hidden_ = 0.0;
  finish_round(state);
}

/// E of X140 and X141.
double ModalErrors::stiffness_of(std::size_t pair) const noexcept {
  const std::size_t n = flexibility_.size();
  const double* const load_row = plan_.neglect.load_rows.data() + pair * n;
  double sum = 0.0;
  for (std::size_t u = 0; u < n; ++u) sum += load_row[u] * still_[u];
  if (!creep_.empty()) {
    const double* const rate_row = plan_.neglect.rate_rows.data() + pair * n;
    for (std::size_t u = 0; u < n; ++u) sum += rate_row[u] * creep_[u];
  }
  for (std::size_t k = 0; k < 6; ++k) sum += plan_.neglect.spin_rows[6 * pair + k] * products_[k];
  if (const Array& rows = plan_.neglect.bodies.push_rows; !rows.empty())
    for (std::size_t k = 0; k < 3; ++k)
      sum += rows[6 * pair + k] * push_[k] + rows[6 * pair + 3 + k] * w_dot_[k];
  // what followers add stands in the plan, to first order and of the lowest modes
  const auto [l, u] = plan_.neglect.pairs[pair];
  for (const Follower& follower : followers_) sum -= follower.amplitude * followed(*follower.history, l, u);
  return sum;
}

/// The modes beyond those whose error is integrated, free but for their own stiffness.
void ModalErrors::go_on(const MotionState& state) noexcept {
  const std::size_t n = flexibility_.size();
  for (std::size_t l = shadow_.size(); l < modes_.size(); ++l) {
    const auto at = static_cast<std::size_t>(plan_.neglect.pairs[l][0]);
    const double omega = plan_.omega[at], still = state.Q[at] * flexibility_[at];
    if (omega == 0.0) continue;
    Mode& mode = modes_[l];
    swing_[l] = {state.q[at] - still, state.q_dot[at] / omega};
    mode.most = std::max(length(swing_[l]) + std::abs(still) + std::abs(mode.still), mode.most);
    turn_by(l, is_resolved(l) ? mode.steady + dot(plan_.neglect.load_rows.data() + l * n, state.q.data(), n)
                              : mode.stiffness);
    mode.ring *= mode.turn;
    const double size = length(mode.ring), most = 2.0 * size_of_body_;
    if (!(size <= most)) mode.ring = std::isfinite(size) ? mode.ring * (most / size) : most;
  }
}

/// A stiffness that is off, over a step, on the motion with its error: a kick where steps tell what pulsates
/// with the mode from what stands, else a turn of the phase.
void ModalErrors::turn_by(std::size_t l, double stiffness) noexcept {
  const std::complex<double> whole = swing_[l] + modes_[l].ring;
  const auto at = static_cast<std::size_t>(plan_.neglect.pairs[l][0]);
  const double rate = 0.5 * plan_.omega[at] * stiffness * flexibility_[at] * step_;
  const std::complex<double> turned = is_resolved(l)
                                          ? whole - std::complex<double>(0.0, 2.0 * rate * whole.real())
                                          : whole * std::polar(1.0, -rate);
  modes_[l].ring += turned - whole;
}

/// The same of a stiffness between two modes and of what the spin turns one into the other by, one after the
/// other: neither gains what the other does not lose.
void ModalErrors::turn_each_other(std::size_t l, std::size_t u, double stiffness, double coriolis) noexcept {
  const auto omega_of = [&](std::size_t mode) {
    return plan_.omega[static_cast<std::size_t>(plan_.neglect.pairs[mode][0])];
  };
  const bool is_kick = std::max(omega_of(l), omega_of(u)) * round_ <= kResolved;
  const auto push = [&](std::size_t to, std::size_t from, double turn) {
    const std::complex<double> whole = swing_[from] + modes_[from].ring;
    const double rate = 0.5 * stiffness / (plan_.mass * omega_of(to)) * round_;
    const std::complex<double> share = is_kick ? std::complex<double>(0.0, 2.0 * rate * whole.real())
                                               : std::complex<double>(0.0, rate) * whole;
    modes_[to].ring -= share + turn * round_ * whole;
  };
  push(l, u, coriolis);
  push(u, l, -coriolis);
}

bool ModalErrors::is_resolved(std::size_t l) const noexcept {
  return plan_.omega[static_cast<std::size_t>(plan_.neglect.pairs[l][0])] * step_ <= kResolved;
}

void ModalErrors::look_at(std::size_t l, const MotionState& state) noexcept {
  const PlanNeglect& neglect = plan_.neglect;
  Mode& mode = modes_[l];
  const auto at = static_cast<std::size_t>(neglect.pairs[l][0]);
  const double omega = plan_.omega[at];
  double stiffness = stiffness_of(l);
  // X143: what the mode's displacement does to the others at second order
  const double* const row = neglect.load_rows.data() + l * flexibility_.size();
  for (std::size_t u = 0; u < second_.size(); ++u) second_[u] += row[u] * square(state.q[at]);
  if (omega == 0.0) return look_at_mechanism(l, stiffness, state);

  // X146: as much as a spring of third order on average, and with the others three times as much
  const double root = neglect.root_quartic[l], own = root * square(length(swing_[l]) + std::abs(still_[at]));
  next_quartic_ += own;
  stiffness += root * (1.5 * std::max(0.0, quartic_ - own) + 0.75 * own);
  const double share = stiffness * flexibility_[at];
  soften(share, static_cast<std::int32_t>(at), false);
  // a pulse that steps do not tell: stiffness that swings by e makes grow by omega e / 4 a second (Mathieu)
  const double pulse = is_resolved(l) ? 0.0 : std::abs(stiffness - mode.stiffness) * flexibility_[at];
  mode.stiffness = stiffness;
  mode.steady = stiffness - dot(row, still_.data(), still_.size());
  for (std::size_t k = first_pair_[l]; k < first_pair_[l + 1]; ++k) {
    const auto [pair, u] = partners_[k];
    const double* const s = neglect.coriolis_rows.data() + 3 * pair;
    turn_each_other(l, u, stiffness_of(pair),
                    is_coupled(plan_) ? 0.0 : s[0] * w_[0] + s[1] * w_[1] + s[2] * w_[2]);
  }
  double still = -share * still_[at];
  for (std::size_t k = 0; k < 6 && !neglect.spin_loads.empty(); ++k)
    still += neglect.spin_loads[6 * at + k] * products_[k] * flexibility_[at];
  mode.ring -= still - mode.still;
  mode.still = still;
  mode.most *= mode.fade;
  // shapes change with the stiffness, and Coriolis forces make the others swing along
  mode.spread = std::abs(share) * (length(swing_[l]) + std::abs(still_[at])) +
                std::sqrt(2.0 * std::max(0.0, coriolis_reach(l))) * length(swing_[l]);
  fastest_ = std::max(fastest_, 0.5 * omega * std::abs(share));
  hide(l, pulse, state);
}

/// One of those whose error is integrated: what other modes and the spin give its stiffness, and how it
/// swings.
void ModalErrors::look_at_shadowed(std::size_t l, const MotionState& state) noexcept {
  const PlanNeglect& neglect = plan_.neglect;
  const std::size_t n = flexibility_.size(), num_shadowed = shadow_.size();
  const auto set = [&](std::size_t pair, std::size_t u) {
    const double whole = stiffness_of(pair);
    double among = 0.0;  // what shadowed modes strain has its third derivatives
    for (std::size_t v = 0; v < num_shadowed; ++v) among += neglect.load_rows[pair * n + v] * still_[v];
    shadow_.set_stiffness(l, u, whole - among);
    return whole;
  };
  const double stiffness = set(l, l);
  for (std::size_t k = first_pair_[l]; k < first_pair_[l + 1]; ++k)
    if (partners_[k].u < num_shadowed) set(partners_[k].pair, partners_[k].u);
  Mode& mode = modes_[l];
  for (std::size_t u = num_shadowed; u < n; ++u)
    second_[u] += neglect.load_rows[l * n + u] * square(state.q[l]);
  const double omega = plan_.omega[l];
  if (omega == 0.0) {
    mode.most = std::max(mode.most, std::abs(state.q[l]));
    return;
  }
  swing_[l] = {state.q[l] - still_[l], state.q_dot[l] / omega};
  mode.most = std::max(length(swing_[l]) + std::abs(still_[l]), mode.most * mode.fade);
  next_quartic_ += neglect.root_quartic[l] * square(length(swing_[l]) + std::abs(still_[l]));
  const double share = stiffness * flexibility_[l];
  soften(share, static_cast<std::int32_t>(l), false);
  fastest_ = std::max(fastest_, 0.5 * omega * std::abs(share));
  mode.spread = std::sqrt(2.0 * std::max(0.0, coriolis_reach(l))) * length(swing_[l]);
  hide(l, 0.0, state);
}

/// [N] What squeezes links whose inside nothing tells, 0 without such, as a load that accelerates: ringing
/// pulls as loads do, and loads that cancel in rigid links reach no mode and take more of its stiffness.
double ModalErrors::squeeze(const State& state, std::int64_t age) const noexcept {
  if (plan_.neglect.bodies.unseen_factor.empty()) return 0.0;
  double strains = 0.0, sum = state.commands_size;
  for (std::size_t l = 0; l < flexibility_.size(); ++l)
    if (flexibility_[l] > 0.0) strains += square(state.q[l] / flexibility_[l]);
  for (std::size_t k = 0; k < plan_.neglect.bodies.load_sizes.size() && age > 0; ++k)
    sum +=
        plan_.neglect.bodies.load_sizes[k] * std::abs(amplitude_left(plan_.histories[k], plan_.period, age));
  return std::max(kSqueeze * std::max(0.0, sum - norm(state.force_W)), std::sqrt(strains));
}

/// What Coriolis forces make far modes swing along, square of its share   (X141).
double ModalErrors::coriolis_reach(std::size_t l) const noexcept {
  double reach = 0.0;
  for (std::size_t k = 0; k < 6 && !plan_.neglect.coriolis_reach.empty(); ++k)
    reach += plan_.neglect.coriolis_reach[6 * l + k] * products_[k];
  return reach;
}

/// [-] of a mode's stiffness, that nothing tells.  \param share  of omega_1 omega_l
double ModalErrors::unseen_stiffness(std::size_t l, double share) const noexcept {
  const Array& factor = plan_.neglect.bodies.unseen_factor;
  const double omega = plan_.omega[static_cast<std::size_t>(plan_.neglect.pairs[l][0])];
  return share * (l < factor.size() ? factor[l] : 1.0) / (omega_1_ * omega);
}

/// Ringing's error by what nothing tells: it turns the phase, and makes grow where it could buckle the mode
/// or pulsates.  \param pulse  [-] of the stiffness, that steps do not tell
void ModalErrors::hide(std::size_t l, double pulse, const MotionState& state) noexcept {
  Mode& mode = modes_[l];
  const double omega = plan_.omega[static_cast<std::size_t>(plan_.neglect.pairs[l][0])],
               swing = length(swing_[l]);
  const double unseen = unseen_stiffness(l, unseen_share_);
  const double phase = (0.5 * omega * unseen + wheel_phase(l, state)) * round_;
  mode.unseen = std::min(2.0 * mode.most, (mode.unseen + phase * swing) * mode.fade);
  pulse += std::abs(unseen - unseen_stiffness(l, unseen_before_));
  const double growth = omega * (0.25 * pulse + std::sqrt(std::max(0.0, unseen - 1.0))) * round_;
  mode.pumped = std::min(2.0 * size_of_body_, (mode.pumped + growth * (mode.pumped + swing)) * mode.fade);
}

/// A mode without stiffness has what prestress gives it alone: error and its rate stand in `ring`.
void ModalErrors::look_at_mechanism(std::size_t l, double stiffness, const MotionState& state) noexcept {
  Mode& mode = modes_[l];
  const auto at = static_cast<std::size_t>(plan_.neglect.pairs[l][0]);
  double force = -stiffness * state.q[at];
  for (std::size_t k = 0; k < 6 && !plan_.neglect.spin_loads.empty(); ++k)
    force += plan_.neglect.spin_loads[6 * at + k] * products_[k];
  const double rate = mode.ring.imag() + force / plan_.mass * round_;
  mode.most = std::max(mode.most, std::abs(state.q[at]));
  mode.ring = {std::clamp(mode.ring.real() + rate * round_, -2.0 * size_of_body_, 2.0 * size_of_body_), rate};
}

/// A mode that is left out since nothing reaches it buckles as others do.
void ModalErrors::look_at_left_out() noexcept {
  const PlanNeglect& neglect = plan_.neglect;
  const std::size_t n = flexibility_.size();
  for (std::size_t l = 0; l < neglect.left_out_spin.size() / 6; ++l) {
    double share = 0.0;
    for (std::size_t u = 0; u < n; ++u) share += neglect.left_out_rows[l * n + u] * still_[u];
    for (std::size_t k = 0; k < 6; ++k) share += neglect.left_out_spin[6 * l + k] * products_[k];
    soften(share, static_cast<std::int32_t>(l), true);
  }
}

void ModalErrors::soften(double share, std::int32_t mode, bool is_left_out) noexcept {
  if (!(-share > softest_)) return;
  softest_ = -share;
  next_leaders_.softest = mode;
  next_leaders_.is_left_out = is_left_out;
}

/// [m] largest error that the axis of a wheel could hide, and of which wheel.
double ModalErrors::wheel_error(const MotionState& state, std::int32_t& wheel) const noexcept {
  double most = 0.0;
  for (std::size_t k = 0; k < state.wheel_momentum.size() && !wheel_phases_.empty(); ++k)
    for (std::size_t l = 0; l <= modes_.size(); ++l) {
      const double swing = l < modes_.size() ? length(swing_[l]) : rest_hidden_;
      const double each =
          std::abs(state.wheel_momentum[k]) * wheel_phases_[k * (modes_.size() + 1) + l] * swing;
      if (each > most) most = each, wheel = static_cast<std::int32_t>(k);
    }
  return most;
}

void ModalErrors::find_leaders(const MotionState& state) noexcept {
  ModalLeaders& next = next_leaders_;
  double error = 0.0, displaced = 0.0, hidden = 0.0, by_links = 0.0;
  for (std::size_t u = 0; u < flexibility_.size(); ++u)
    if (square(state.q[u]) > displaced)
      displaced = square(state.q[u]), next.displaced = static_cast<std::int32_t>(u);
  for (std::size_t l = 0; l < modes_.size(); ++l) {
    const Mode& mode = modes_[l];
    const std::int32_t at = plan_.neglect.pairs[l][0];
    const auto place = static_cast<std::size_t>(at);
    const double own =
        square(mode.spread) + (l < shadow_.size()          ? shadow_.square_of(place)
                               : plan_.omega[place] == 0.0 ? square(mode.ring.real())
                                                           : std::norm(mode.ring + mode.still));
    if (own > error) error = own, next.error = at;
    if (plan_.omega[place] == 0.0) continue;
    const double share = unseen_stiffness(l, unseen_share_),
                 hides = square(mode.unseen) + square(mode.pumped) + square(share * still_[place]);
    if (hides > hidden) hidden = hides, next.hidden = at;
    by_links = std::max(by_links, 0.5 * plan_.omega[place] * share * length(swing_[l]));
  }
  if (!(wheel_error(state, next.wheel) > by_links)) next.wheel = -1;
  leaders_ = std::exchange(next_leaders_, {});
}

/// [N/m] what would turn the phase of a mode as Coriolis forces between it and its partners do; 0 on rungs
/// that have them.
double ModalErrors::coriolis_stiffness(std::size_t l) const noexcept {
  if (is_coupled(plan_)) return 0.0;
  const std::int32_t mode = plan_.neglect.pairs[l][0];
  double most = 0.0;
  for (std::size_t pair = modes_.size(); pair < plan_.neglect.pairs.size(); ++pair) {
    if (plan_.neglect.pairs[pair][0] != mode && plan_.neglect.pairs[pair][1] != mode) continue;
    const double* const s = plan_.neglect.coriolis_rows.data() + 3 * pair;
    most = std::max(most, std::abs(s[0] * w_[0] + s[1] * w_[1] + s[2] * w_[2]));
  }
  return 2.0 * plan_.mass * plan_.omega[static_cast<std::size_t>(mode)] * most;
}

/// The wheel that does most to a mode on rungs that do not couple: gyroscopic forces between it and its
/// partners, as Coriolis forces (X167), and its torque on the body that turns with the mode (X148).
void ModalErrors::find_wheel(std::size_t l, const MotionState& state,
                             StiffnessShares& shares) const noexcept {
  if (is_coupled(plan_)) return;
  const std::int32_t mode = plan_.neglect.pairs[l][0];
  const auto at = static_cast<std::size_t>(mode), padded = static_cast<std::size_t>(plan_.num_padded);
  for (std::size_t k = 0; k < state.wheel_momentum.size(); ++k) {
    const PlanWheel& wheel = plan_.wheels.all[k];
    const double* const rows = turn_rows(plan_, wheel.turning);
    const Vec3 across = cross(wheel.axis, {rows[at], rows[padded + at], rows[2 * padded + at]});
    const double h = std::abs(state.wheel_momentum[k]);
    double most = 0.0;
    for (std::size_t pair = modes_.size(); pair < plan_.neglect.pairs.size(); ++pair)
      if (plan_.neglect.pairs[pair][0] == mode || plan_.neglect.pairs[pair][1] == mode)
        most = std::max(most, std::abs(wheel.gyroscopic[pair]));
    const double share =
        h * plan_.omega[at] * most + h * h * dot(across, multiply(plan_.inverse_inertia, across));
    if (share > shares.wheel) shares.wheel = share, shares.largest_wheel = static_cast<std::int32_t>(k);
  }
}

/// (num_elastic) stiffness of a mode per static elastic coordinate; null where it is not judged.
const double* ModalErrors::load_row(const JudgedMode& named) const noexcept {
  const std::size_t n = flexibility_.size();
  if (named.mode < 0) return nullptr;
  if (named.is_left_out) return plan_.neglect.left_out_rows.data() + static_cast<std::size_t>(named.mode) * n;
  const std::size_t l = judged_place(named.mode);
  return l < modes_.size() ? plan_.neglect.load_rows.data() + l * n : nullptr;
}

double ModalErrors::stiffness_by(const JudgedMode& named, const double* Q) const noexcept {
  const double* const row = load_row(named);
  double sum = 0.0;
  for (std::size_t u = 0; u < flexibility_.size() && row != nullptr; ++u)
    sum += row[u] * Q[u] * flexibility_[u];
  return sum;
}

double ModalErrors::followed_by(const JudgedMode& named, const PlanHistory& history) const noexcept {
  return named.mode < 0 || named.is_left_out ? 0.0 : followed(history, named.mode, named.mode);
}

StiffnessShares ModalErrors::shares_of(const JudgedMode& named, const MotionState& state) const noexcept {
  StiffnessShares shares;
  const double* const row = load_row(named);
  if (row == nullptr) return shares;
  const std::size_t l = named.is_left_out ? static_cast<std::size_t>(named.mode) : judged_place(named.mode);
  const Array& spin_rows = named.is_left_out ? plan_.neglect.left_out_spin : plan_.neglect.spin_rows;
  for (std::size_t k = 0; k < 6; ++k) shares.spin += spin_rows[6 * l + k] * products_[k];
  shares.spin = std::abs(shares.spin);
  double sum = 0.0;
  for (std::size_t u = 0; u < flexibility_.size(); ++u) {
    const double rate = plan_.omega[u] > 0.0 ? state.q_dot[u] / plan_.omega[u] : 0.0;
    sum += square(row[u]) * (square(state.q[u] - still_[u]) + square(rate));
  }
  shares.vibration = std::sqrt(sum);
  if (named.is_left_out) return shares;
  shares.spin += coriolis_stiffness(l);
  find_wheel(l, state, shares);
  return shares;
}

void ModalErrors::finish_round(const MotionState& state) noexcept {
  const std::size_t n = flexibility_.size();
  look_at_left_out();
  double all = 0.0, envelope = 0.0, judged_swing = 0.0, seen = 0.0, amplitude = 0.0, spin = 0.0, hidden = 0.0,
         swing = 0.0, spread = 0.0, slowest = 0.0;
  for (std::size_t u = 0; u < n; ++u) {
    all += square(state.q[u]);
    envelope += square(state.q[u]) + (flexibility_[u] > 0.0 ? square(state.q_dot[u] / plan_.omega[u]) : 0.0);
    amplitude += square(0.5 * second_[u] * flexibility_[u]);
    double still = 0.0;
    for (std::size_t k = 0; k < 6 && !plan_.neglect.spin_loads.empty(); ++k)
      still += plan_.neglect.spin_loads[6 * u + k] * products_[k] * flexibility_[u];
    spin += square(still);
    if (flexibility_[u] > 0.0)
      swing += square(state.q[u] - still_[u]) + square(state.q_dot[u] / plan_.omega[u]);
    if (slowest == 0.0 || plan_.decay[u] < slowest) slowest = plan_.decay[u];
    second_[u] = 0.0;
  }
  for (std::size_t a = 0; a < 6 && !plan_.neglect.spin_left_out.empty(); ++a)
    for (std::size_t b = 0; b < 6; ++b)
      spin += plan_.neglect.spin_left_out[6 * a + b] * products_[a] * products_[b];
  spin = std::max(0.0, spin);
  double judged_spin = 0.0;
  shadow_.limit(2.0 * size_of_body_);
  seen += shadow_.square();
  // what turns the shadowed modes turns the others too, at rest
  if (const double turn = shadow_.turn(); turn > 0.0) {
    double still = 0.0;
    for (std::size_t u = shadow_.size(); u < n; ++u) still += square(still_[u]);
    seen += square(turn) * still;
  }
  for (std::size_t l = 0; l < modes_.size(); ++l) {
    const Mode& mode = modes_[l];
    const auto at = static_cast<std::size_t>(plan_.neglect.pairs[l][0]);
    const bool is_mechanism = plan_.omega[at] == 0.0;
    if (l >= shadow_.size())
      seen += is_mechanism ? square(mode.ring.real()) : std::norm(mode.ring + mode.still);
    judged_swing += std::norm(swing_[l]);
    spread += square(mode.spread);
    hidden += square(mode.unseen) + square(mode.pumped);
    if (!is_mechanism) hidden += square(unseen_stiffness(l, unseen_share_) * still_[at]);
    double still = 0.0;
    for (std::size_t k = 0; k < 6 && !plan_.neglect.spin_loads.empty(); ++k)
      still += plan_.neglect.spin_loads[6 * at + k] * products_[k] * flexibility_[at];
    judged_spin += square(still);
  }
  const double other_swing = std::sqrt(std::max(0.0, swing - judged_swing));
  rest_ =
      std::min(2.0 * other_swing, (rest_ + fastest_ * round_ * other_swing) * std::exp(-slowest * round_));
  rest_hidden_ =
      std::min(2.0 * other_swing, (rest_hidden_ + wheel_phase(modes_.size(), state) * round_ * other_swing) *
                                      std::exp(-slowest * round_));
  hidden += square(rest_hidden_) + square(plan_.neglect.bodies.inner_load * dot(w_, w_));
  fastest_ = 0.0;
  quartic_ = std::exchange(next_quartic_, 0.0);
  find_leaders(state);
  size_.softening = std::exchange(softest_, 0.0);
  size_.displacement = std::sqrt(all);
  size_.envelope = std::sqrt(envelope);
  size_.amplitude = std::sqrt(amplitude);
  size_.spin = std::sqrt(spin);
  size_.seen = std::sqrt(seen + spread + amplitude + square(rest_) + square(plan_.neglect.left_out) +
                         std::max(0.0, spin - judged_spin));
  size_.unseen = std::sqrt(hidden);
}

}  // namespace freeflex
