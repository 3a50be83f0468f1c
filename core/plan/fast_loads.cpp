#include "core/plan/fast_loads.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace freeflex {
namespace {

// [-] of the rate: a sine of a higher frequency is not followed from tick to tick
constexpr double kMostCycles = 0.1;

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
    if (table.values[k] != table.values[k - 1] && end - begin < kClose &&
        (is_between(begin) || is_between(end)))
      return true;
  }
  return false;
}

bool is_empty(const LoadPattern& pattern) {
  return !pattern.has_world && !pattern.has_body &&
         std::all_of(pattern.wheels.torque.begin(), pattern.wheels.torque.end(),
                     [](double torque) { return torque == 0.0; });
}

bool outruns_ticks(const PlanHistory& history, const Plan& plan) {
  if (history.kind == PlanHistory::Kind::kSine)
    return history.frequency * plan.period > kMostCycles || meets_image(history.frequency, plan);
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
