#include "core/error/shadow_loads.hpp"

#include <algorithm>
#include <limits>

#include "core/step/loads/history.hpp"
#include "core/step/loads/slots.hpp"
#include "core/step/vector.hpp"

namespace freeflex {
namespace {

/// Returns the values of sum_j (2 j + 1) A_j P_j(2 s - 1) at s = 0, 1/2, 1, with Legendre polynomials P_j.
/// \param A  integrals over the step of a(s) P_j(2 s - 1) for j = 0, 1, 2, where a is the load (THEORY 15.2)
std::array<double, 3> stages_of(const std::array<double, 3>& A) noexcept {
  return {A[0] - 3.0 * A[1] + 5.0 * A[2], A[0] - 2.5 * A[2], A[0] + 3.0 * A[1] + 5.0 * A[2]};
}

/// Returns the integrals of P_0, P_1, P_2 of 2 s - 1 from 0 to s.
std::array<double, 3> integrals(double s) noexcept {
  return {s, s * (s - 1.0), s * ((2.0 * s - 1.0) * (s - 1.0))};
}

void add_scaled_sums(double factor, const LoadSums& from, LoadSums& to) noexcept {
  const auto add = [factor](const std::vector<Vec3>& a, std::vector<Vec3>& b) {
    for (std::size_t k = 0; k < a.size(); ++k) b[k] = add_scaled(b[k], factor, a[k]);
  };
  add(from.force_W, to.force_W);
  add(from.force_B, to.force_B);
  add(from.group_force_W, to.group_force_W);
  add(from.group_torque_W, to.group_torque_W);
  add(from.group_force_B, to.group_force_B);
  add(from.group_torque_B, to.group_torque_B);
  add(from.torque_W, to.torque_W);
  add(from.torque_B, to.torque_B);
  for (std::size_t k = 0; k < from.wheel_torques.size(); ++k)
    to.wheel_torques[k] += factor * from.wheel_torques[k];
}

/// Returns the sum of the lengths of all forces, and of all torques over `arm` [m], in N.
double size_of(const LoadSums& sums, double arm) noexcept {
  double force = 0.0, torque = 0.0;
  for (const auto* forces : {&sums.force_W, &sums.force_B, &sums.group_force_W, &sums.group_force_B})
    for (const Vec3& each : *forces) force += length(each);
  for (const auto* torques : {&sums.torque_W, &sums.torque_B, &sums.group_torque_W, &sums.group_torque_B})
    for (const Vec3& each : *torques) torque += length(each);
  for (const double each : sums.wheel_torques) torque += each < 0.0 ? -each : each;
  return arm > 0.0 ? force + torque / arm : force;
}

}  // namespace

std::array<double, 3> parabola_of_piece(double u, double v) noexcept {
  const std::array<double, 3> at_u = integrals(u), at_v = integrals(v);
  return stages_of({at_v[0] - at_u[0], at_v[1] - at_u[1], at_v[2] - at_u[2]});
}

ShadowLoads::ShadowLoads(const StepPlan& plan, const PlanShadow& shadow)
    : plan_(plan), shadow_(shadow), slots_(kMaxSlots) {
  const StepPlan& own = shadow.plan;
  now_ = make_load_sums(own);
  pieces_.fill(now_);
  group_rows_ = make_group_rows(own);
  for (LoadPattern& pattern : over_.commands) {
    pattern = make_pattern(own);
    set_pattern(own, group_rows_, now_, pattern);
  }
  over_.amplitudes.resize(own.histories.size());
  for (const PlanPoint& point : own.points) arm_ = std::max(arm_, length(point.r));
  for (const PlanHistory& history : own.histories)
    history_sizes_.push_back(size_of(history.pattern.sums, arm_));
}

void ShadowLoads::clear() noexcept {
  num_slots_ = 0;
  is_new_ = true;
  is_copied_ = is_in_step_ = is_pausing_ = false;
  command_size_ = size_ = pause_size_ = 0.0;
}

void ShadowLoads::command(std::int64_t tick, std::span<const ForceCommand> commands) noexcept {
  move_to(tick);
  if (commands.empty()) return;
  add_piece(from_, tick);
  for (const ForceCommand& each : commands) num_slots_ = apply_command(tick, each, slots_, num_slots_);
  is_new_ = true;
  is_copied_ = false;
  if (!is_pausing_) return;
  sum_slots();
  pause_size_ = std::max(pause_size_, size_of(now_, arm_));
}

void ShadowLoads::sum_slots() noexcept {
  if (!is_new_) return;
  freeflex::clear(now_);
  add_slots(shadow_.plan, std::span(slots_).first(index(num_slots_)), now_);
  is_new_ = false;
}

void ShadowLoads::begin_pause() noexcept {
  is_pausing_ = true;
  sum_slots();
  pause_size_ = size_of(now_, arm_);
}

/// Removes the slots that end up to a tick, one end after another, and adds what acted before each end.
void ShadowLoads::move_to(std::int64_t tick) noexcept {
  while (true) {
    std::int64_t end = std::numeric_limits<std::int64_t>::max();
    for (std::int32_t i = 0; i < num_slots_; ++i) end = std::min(end, slots_[index(i)].end_tick);
    if (end > tick) break;
    add_piece(from_, end);
    ends_.num_expiries = 0;
    num_slots_ = expire_slots(end, slots_, num_slots_, ends_);
    is_new_ = true;
    is_copied_ = false;
  }
}

void ShadowLoads::skip_to(std::int64_t tick) noexcept {
  is_in_step_ = is_pausing_ = false;
  move_to(tick);
}

void ShadowLoads::begin_step(std::int64_t tick) noexcept {
  is_in_step_ = is_pausing_ = false;
  move_to(tick);
  is_in_step_ = true;
  has_pieces_ = false;
  command_size_ = 0.0;
  start_ = from_ = tick;
}

/// Adds the loads that act from one tick to another of the present step.
void ShadowLoads::add_piece(std::int64_t from, std::int64_t to) noexcept {
  if (!is_in_step_ || to <= from) return;
  sum_slots();
  if (!has_pieces_)
    for (SumsOnPoints& sums : pieces_) freeflex::clear(sums);
  has_pieces_ = true;
  const auto ticks = static_cast<double>(shadow_.ticks);
  const std::array<double, 3> stages =
      parabola_of_piece(static_cast<double>(from - start_) / ticks, static_cast<double>(to - start_) / ticks);
  for (std::size_t k = 0; k < 3; ++k) add_scaled_sums(stages[k], now_, pieces_[k]);
  command_size_ = std::max(command_size_, size_of(now_, arm_));
  from_ = to;
}

const LoadsOverStep& ShadowLoads::end_step(std::int64_t tick, std::int64_t age) noexcept {
  // slots that end at the end of the step act to its end, so they are removed by the next one
  move_to(tick - 1);
  const bool varies = has_pieces_;
  over_.jumps = varies || is_new_;
  if (varies) {
    add_piece(from_, tick);
    for (std::size_t k = 0; k < 3; ++k) set_pattern(shadow_.plan, group_rows_, pieces_[k], over_.commands[k]);
    is_new_ = true;  // the patterns are not those of the slots alone
  } else if (is_new_) {
    sum_slots();
    for (LoadPattern& pattern : over_.commands) set_pattern(shadow_.plan, group_rows_, now_, pattern);
  }
  is_in_step_ = false;
  sum_amplitudes(age, 0);
  command_size_ = std::max(command_size_, size_of(now_, arm_));
  sum_sizes(age);
  return over_;
}

namespace {

/// Returns int a(s) P_j(2 s - 1) ds for a pulse as the scene gives it, which need not begin and end at ticks.
/// \param period  [s] length of a tick, or of a substep if the step is one
/// \param age  [periods] from the start of the epoch to that of the step  \param ticks  [periods] its length
std::array<double, 3> moments_of_pulse(const PlanHistory& history, double period, std::int64_t age,
                                       double ticks) noexcept {
  const auto share = [&](double time) {
    const double s = (time / period - static_cast<double>(age)) / ticks;
    return std::clamp(s, 0.0, 1.0);
  };
  const std::array<double, 3> at_start = integrals(share(history.pulse_start)),
                              at_end = integrals(share(history.pulse_start + history.pulse_duration));
  return {at_end[0] - at_start[0], at_end[1] - at_start[1], at_end[2] - at_start[2]};
}

/// Returns the same for a history that is continuous in time. It is sampled more finely than the ticks of the
/// plan, because the plan takes it as a parabola in each tick. Boole's rule is exact to order 5.
std::array<double, 3> moments_of_continuous(const PlanHistory& history, double period, std::int64_t age,
                                            std::int32_t ticks) noexcept {
  constexpr std::int32_t kPieces = 4;  // of a tick
  constexpr std::array<double, 5> kWeights{7.0, 32.0, 12.0, 32.0, 7.0};
  const double fine = period / (2 * kPieces);  // exact, a power of two
  const double pieces = kPieces * ticks;
  std::array<double, 3> A{};
  for (std::int32_t piece = 0; piece < kPieces * ticks; ++piece)
    for (std::size_t m = 0; m < 5; ++m) {
      const std::int64_t half = 2 * (kPieces * age + piece) + static_cast<std::int64_t>(m) / 2;
      const double f =
          m % 2 == 0 ? amplitude_right(history, fine, half) : amplitude_middle(history, fine, half);
      const double s = (piece + 0.25 * static_cast<double>(m)) / pieces, x = 2.0 * s - 1.0;
      const double weight = kWeights[m] / (90.0 * pieces) * f;
      A[0] += weight;
      A[1] += weight * x;
      A[2] += weight * (1.5 * x * x - 0.5);
    }
  return A;
}

}  // namespace

const LoadsOverStep& ShadowLoads::loads_of_substep(std::int64_t age, std::int32_t substep) noexcept {
  over_.jumps = !is_copied_;
  if (!is_copied_) {
    sum_slots();
    for (LoadPattern& pattern : over_.commands) set_pattern(shadow_.plan, group_rows_, now_, pattern);
    command_size_ = size_of(now_, arm_);
    is_copied_ = true;
  }
  sum_amplitudes(age, substep);
  if (substep == 0) sum_sizes(age);
  return over_;
}

/// Sets the amplitudes of the histories, as the scene gives them and not as the plan samples them
/// (THEORY 15.2).
void ShadowLoads::sum_amplitudes(std::int64_t age, std::int32_t substep) noexcept {
  const double period = plan_.period / shadow_.substeps;  // exact, a power of two
  const std::int64_t first = age * shadow_.substeps + substep;
  for (std::size_t k = 0; k < plan_.histories.size(); ++k) {
    const PlanHistory& history = plan_.histories[k];
    std::array<double, 3> stages{1.0, 1.0, 1.0};
    if (history.kind == PlanHistory::Kind::kPulse)
      stages = stages_of(moments_of_pulse(history, period, first, shadow_.ticks));
    else if (history.kind != PlanHistory::Kind::kConstant)
      stages = stages_of(moments_of_continuous(history, period, first, shadow_.ticks));
    over_.jumps = over_.jumps || stages[0] != over_.amplitudes[k][2];
    over_.amplitudes[k] = stages;
  }
}

/// Sums the sizes of the loads at the tick of the step at which they are largest.
void ShadowLoads::sum_sizes(std::int64_t age) noexcept {
  size_ = command_size_;
  for (std::size_t k = 0; k < history_sizes_.size(); ++k) {
    double most = 0.0;
    for (std::int64_t tick = age; tick < age + shadow_.ticks; ++tick) {
      const double amplitude = amplitude_right(plan_.histories[k], plan_.period, tick);
      most = std::max(most, amplitude < 0.0 ? -amplitude : amplitude);
    }
    size_ += history_sizes_[k] * most;
  }
}

double ShadowLoads::largest_histories(std::int64_t from_age, std::int64_t to_age) const noexcept {
  constexpr std::int64_t kSamples = 64;
  const double from = static_cast<double>(from_age) * plan_.period,
               to = static_cast<double>(to_age) * plan_.period;
  const auto size = [](double x) { return x < 0.0 ? -x : x; };
  double sum = 0.0;
  for (std::size_t k = 0; k < history_sizes_.size(); ++k) {
    const PlanHistory& history = plan_.histories[k];
    double most = 0.0;
    for (std::int64_t n = 0; n <= kSamples; ++n)
      most = std::max(
          most, size(amplitude_right(history, plan_.period, from_age + (to_age - from_age) * n / kSamples)));
    if (history.kind == PlanHistory::Kind::kPulse && history.pulse_start < to &&
        history.pulse_start + history.pulse_duration > from)
      most = 1.0;
    for (std::size_t row = 0; row < history.times.size(); ++row)
      if (history.times[row] > from && history.times[row] < to)
        most = std::max(most, size(history.values[row]));
    sum += history_sizes_[k] * most;
  }
  return sum;
}

void ShadowLoads::copy_slots(std::int64_t age, State& state) noexcept {
  if (!is_copied_) copy_slots(state);
  sum_sizes(age);
}

void ShadowLoads::copy_slots(State& state) noexcept {
  std::copy_n(slots_.begin(), num_slots_, state.slots.begin());
  for (std::int32_t i = 0; i < num_slots_; ++i) {
    state.slots[index(i)].end_tick = std::numeric_limits<std::int64_t>::max();
    state.slots[index(i)].command.lease_ticks = 0;
  }
  state.num_slots = num_slots_;
  state.slots_changed = true;
  sum_slots();
  command_size_ = size_of(now_, arm_);
  is_copied_ = true;
}

}  // namespace freeflex
