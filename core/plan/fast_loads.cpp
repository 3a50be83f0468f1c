#include "core/plan/fast_loads.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/plan/rungs.hpp"

namespace freeflex {
namespace {

// [-] of the rate: straight from tick to tick a sine of n ticks a cycle is (pi / n)^2 / 3 too small, 2 % of
// 13
constexpr double kMostCycles = 1.0 / 13.0;

// X144. Beside its own frequency f a sine has parts at k rate -+ f, smaller by the square of the quotient, at
// which a mode may ring.
bool meets_image(double frequency, const Plan& plan) {
  // [-] of the static answer, which is what the word calls good; undamped: a resonance that is off by `apart`
  // is mode / (2 apart) as large
  constexpr double kHeard = 0.02;
  const double rate = 1.0 / plan.period;
  return std::any_of(plan.omega.begin(), plan.omega.end(), [&](double omega) {
    const double mode = omega / (2.0 * std::numbers::pi), turns = std::round(mode / rate);
    const auto is_heard = [&](double image) {
      const double apart = std::abs(mode - image), share = frequency / image * frequency / image;
      return image > 0.5 * rate && share * mode > 2.0 * kHeard * apart;
    };
    return is_heard(turns * rate - frequency) || is_heard(turns * rate + frequency);
  });
}

// What bends between ticks is cut off: of a rise over n ticks up to 1 / (4 n) within a tick, 2.5 % of ten.
bool bends_between_ticks(const PlanHistory& table, double period) {
  constexpr double kClose = 10.0, kOnTick = 1e-6;  // [ticks]
  for (std::size_t k = 1; k < table.times.size(); ++k) {
    const double begin = table.times[k - 1] / period, end = table.times[k] / period;
    const auto is_between = [](double tick) { return std::abs(tick - std::round(tick)) > kOnTick; };
    // two rows within a tick are a jump, wherever they stand
    if (table.values[k] != table.values[k - 1] && end - begin < kClose &&
        (is_between(begin) || is_between(end) || end - begin < 1.0 - kOnTick))
      return true;
  }
  return false;
}

// A pulse whose ends are no ticks is moved to ticks. Modes and a body that turns have gone on by then: 0.02
// rad is 2 % of what the pulse does.
bool is_moved(const PlanHistory& pulse, const Plan& plan) {
  constexpr double kHeard = 0.02;
  const auto shift = [&](std::int64_t tick, double time) {
    return std::abs(static_cast<double>(tick) * plan.period - time);
  };
  const double most = std::max(shift(pulse.start_tick, pulse.pulse_start),
                               shift(pulse.end_tick, pulse.pulse_start + pulse.pulse_duration));
  constexpr double kForEver = 1e12;  // [ticks] an end that never comes
  if (pulse.pulse_duration == 0.0 || pulse.pulse_duration > kForEver * plan.period) return false;
  double fastest = turn_rate(plan);
  for (const double omega : plan.omega) fastest = std::max(fastest, omega);
  return fastest * most > kHeard;
}

bool is_empty(const LoadPattern& pattern) {
  return !pattern.has_world && !pattern.has_body &&
         std::all_of(pattern.wheels.torque.begin(), pattern.wheels.torque.end(),
                     [](double torque) { return torque == 0.0; });
}

bool outruns_ticks(const PlanHistory& history, const Plan& plan) {
  if (history.kind == PlanHistory::Kind::kSine)
    return history.frequency * plan.period > kMostCycles || meets_image(history.frequency, plan);
  if (history.kind == PlanHistory::Kind::kPulse) return is_moved(history, plan);
  return history.kind == PlanHistory::Kind::kTable && bends_between_ticks(history, plan.period);
}

}  // namespace

void find_fast_loads(Plan& plan) {
  plan.neglect.fast_loads.clear();
  for (std::size_t k = 0; k < plan.histories.size(); ++k)
    if (!is_empty(plan.histories[k].pattern) && outruns_ticks(plan.histories[k], plan))
      plan.neglect.fast_loads.push_back(static_cast<std::int32_t>(k));
}

}  // namespace freeflex
