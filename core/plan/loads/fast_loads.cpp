#include "core/plan/loads/fast_loads.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace freeflex {
namespace {

// [cycles/tick] Largest frequency at which a sine is resolved. If a sine of n ticks per cycle is taken as
// linear from tick to tick, its amplitude is too small by the fraction (pi / n)^2 / 3. For 13 ticks this is
// 2 % (THEORY 15.10).
constexpr double kMostCycles = 1.0 / 13.0;

// Returns true if an image frequency of a sine excites a mode. A sine of frequency f that is linear from tick
// to tick also has components at k rate -+ f, whose amplitudes are (f / (k rate -+ f))^2 of that of the sine
// (THEORY 15.10).
bool meets_image(double frequency, const StepPlan& plan) {
  // [-] Largest error, as a fraction of the quasi-static response, with which a verdict is `good`. Without
  // damping, a sine at the distance `apart` [Hz] from a mode is amplified by mode / (2 apart).
  constexpr double kGoodError = 0.02;
  const double rate = 1.0 / plan.period;
  return std::any_of(plan.omega.begin(), plan.omega.end(), [&](double omega) {
    const double mode = omega / (2.0 * std::numbers::pi), whole_cycles = std::round(mode / rate);
    const auto is_excited = [&](double image) {
      const double apart = std::abs(mode - image), share = frequency / image * frequency / image;
      return image > 0.5 * rate && share * mode > 2.0 * kGoodError * apart;
    };
    return is_excited(whole_cycles * rate - frequency) || is_excited(whole_cycles * rate + frequency);
  });
}

// Returns true if a table has a kink between ticks at an end of a rise or fall that takes less than ten
// ticks, or if it has a jump. Linear interpolation between ticks cuts the kink off, so a rise over n ticks
// has an error of up to 1 / (4 n) of its height within a tick. For ten ticks this is 2.5 %.
bool bends_between_ticks(const PlanHistory& table, double period) {
  constexpr double kClose = 10.0, kOnTick = 1e-6;  // [ticks]
  for (std::size_t k = 1; k < table.times.size(); ++k) {
    const double begin = table.times[k - 1] / period, end = table.times[k] / period;
    const auto is_between = [](double tick) { return std::abs(tick - std::round(tick)) > kOnTick; };
    // two rows less than a tick apart are a jump, whether or not they are on ticks
    if (table.values[k] != table.values[k - 1] && end - begin < kClose &&
        (is_between(begin) || is_between(end) || end - begin < 1.0 - kOnTick))
      return true;
  }
  return false;
}

// Returns true if the plan moves the ends of a pulse to ticks (THEORY 8.10).
bool is_moved(const PlanHistory& pulse, const StepPlan& plan) {
  constexpr double kOnTick = 1e-6;  // [ticks]
  const auto shift = [&](std::int64_t tick, double time) {
    return std::abs(static_cast<double>(tick) - time / plan.period);
  };
  constexpr double kForEver = 1e12;  // [ticks] a longer pulse is taken as a pulse that never ends
  if (pulse.pulse_duration == 0.0 || pulse.pulse_duration > kForEver * plan.period) return false;
  return std::max(shift(pulse.start_tick, pulse.pulse_start),
                  shift(pulse.end_tick, pulse.pulse_start + pulse.pulse_duration)) > kOnTick;
}

bool is_empty(const LoadPattern& pattern) {
  return !pattern.has_world && !pattern.has_body &&
         std::all_of(pattern.wheel_torques.begin(), pattern.wheel_torques.end(),
                     [](double torque) { return torque == 0.0; });
}

// Returns true if a load changes within a quarter of a tick. Boole's rule over a quarter of a tick takes a
// sine of half a cycle there with an error of 1e-3; a table must not rise and fall there.
bool is_faster_than_samples(const PlanHistory& history, const StepPlan& plan) {
  if (history.kind == PlanHistory::Kind::kSine) return history.frequency * plan.period > 2.0;
  if (history.kind != PlanHistory::Kind::kTable) return false;
  const std::vector<double>&times = history.times, &values = history.values;
  for (std::size_t k = 0; k < times.size(); ++k) {
    double variation = 0.0;
    for (std::size_t j = k + 1; j < times.size() && times[j] - times[k] < 0.25 * plan.period; ++j) {
      variation += std::abs(values[j] - values[j - 1]);
      if (variation > (1.0 + 1e-9) * std::abs(values[j] - values[k])) return true;
    }
  }
  return false;
}

bool is_faster_than_ticks(const PlanHistory& history, const StepPlan& plan) {
  if (history.kind == PlanHistory::Kind::kSine)
    return history.frequency * plan.period > kMostCycles || meets_image(history.frequency, plan);
  if (history.kind == PlanHistory::Kind::kPulse) return is_moved(history, plan);
  return history.kind == PlanHistory::Kind::kTable && bends_between_ticks(history, plan.period);
}

template <typename Predicate>
std::vector<std::int32_t> find_loads(const StepPlan& plan, const Predicate& is_fast) {
  std::vector<std::int32_t> found;
  for (std::size_t k = 0; k < plan.histories.size(); ++k)
    if (!is_empty(plan.histories[k].pattern) && is_fast(plan.histories[k], plan))
      found.push_back(static_cast<std::int32_t>(k));
  return found;
}

}  // namespace

std::vector<std::int32_t> find_fast_loads(const StepPlan& plan) {
  return find_loads(plan, is_faster_than_ticks);
}

std::vector<std::int32_t> find_unseen_loads(const StepPlan& plan) {
  return find_loads(plan, is_faster_than_samples);
}

}  // namespace freeflex
