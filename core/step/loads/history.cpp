#include "core/step/loads/history.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/step/exact.hpp"

namespace freeflex {
namespace {

/// Returns x minus the nearest whole number, for x below 2^52.
double wrap(double x) noexcept {
  constexpr double kShift = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to a whole number
  return x - ((x + kShift) - kShift);
}

/// Returns sin(2 pi (frequency t + phase)) at the time t of half_ticks / 2 + fraction periods (THEORY 8.12).
/// Whole cycles are subtracted before the phase is rounded, so the error of the phase stays below 1e-16
/// cycles as long as half_ticks times period times frequency is below 2^52.
double sine(const PlanHistory& history, double period, std::int64_t half_ticks, double fraction) noexcept {
  const Sum2 per_tick = exact_product(period, history.frequency);
  const double ticks = 0.5 * static_cast<double>(half_ticks);
  const Sum2 cycles = exact_product(ticks, per_tick.hi);
  const double rest = cycles.lo + ticks * per_tick.lo + fraction * per_tick.hi;
  return sine_of_cycles(wrap(wrap(cycles.hi) + rest + wrap(history.phase)));
}

/// Returns the value of the table at a time [s]. The table is linear between rows and constant outside them
/// (THEORY 8.13):
///   y_k + (y_(k+1) - y_k) (t - t_k) / (t_(k+1) - t_k)
double table(const PlanHistory& history, double time) noexcept {
  const auto& t = history.times;
  const auto& y = history.values;
  if (time <= t.front()) return y.front();
  if (time >= t.back()) return y.back();
  std::size_t below = 0, above = t.size() - 1;
  while (above - below > 1) {
    const std::size_t middle = (below + above) / 2;
    (t[middle] <= time ? below : above) = middle;
  }
  return y[below] + (y[above] - y[below]) * ((time - t[below]) / (t[above] - t[below]));
}

double continuous(const PlanHistory& history, double period, std::int64_t half_ticks,
                  double fraction = 0.0) noexcept {
  switch (history.kind) {
    case PlanHistory::Kind::kSine:
      return sine(history, period, half_ticks, fraction);
    case PlanHistory::Kind::kTable:
      return table(history, (0.5 * static_cast<double>(half_ticks) + fraction) * period);
    case PlanHistory::Kind::kConstant:
    case PlanHistory::Kind::kPulse:
      break;
  }
  return 1.0;
}

/// Returns the height of a pulse. A pulse lasts a whole number of ticks h, so its height is changed such that
/// its impulse is that of the duration in the scene:
///   duration / ((end_tick - start_tick) h)   (THEORY 8.11)
double pulse_height(const PlanHistory& history, double period) noexcept {
  const double wanted = history.pulse_duration / period;
  const auto given = static_cast<double>(history.end_tick - history.start_tick);
  constexpr double kOnTick = 1e-6, kForEver = 1e12;  // [ticks]
  const double off = wanted - given;
  const bool fits = (off <= kOnTick && off >= -kOnTick) || wanted > kForEver;
  return fits || history.pulse_duration == 0.0 || given == 0.0 ? 1.0 : wanted / given;
}

}  // namespace

double sine_of_cycles(double cycles) noexcept {
  // Fold the argument into a quarter cycle: sin(2 pi x) = sin(2 pi (1/2 - x)). Both subtractions are exact.
  double x = cycles;
  if (x > 0.25) x = 0.5 - x;
  if (x < -0.25) x = -0.5 - x;
  // Taylor series of sin(2 pi x), |2 pi x| <= pi/2. The first omitted term is below 2e-18.
  static constexpr std::array<double, 10> kCoefficient = {
      -41.341702240399755,   81.60524927607504,    -76.70585975306136,   42.058693944897655,
      -15.094642576822984,   3.8199525848482822,   -0.71812230177850059, 0.10422916220813984,
      -0.012031585942120624, 0.0011309237482517961};
  const double s = x * x;
  double sum = 0.0;
  for (std::size_t k = kCoefficient.size(); k-- > 0;) sum = sum * s + kCoefficient[k];
  constexpr double kTwoPi = 6.2831853071795862, kTwoPiLow = 2.4492935982947064e-16;
  return kTwoPi * x + (kTwoPiLow * x + x * (s * sum));
}

double amplitude_right(const PlanHistory& history, double period, std::int64_t tick) noexcept {
  if (history.kind == PlanHistory::Kind::kPulse)
    return history.start_tick <= tick && tick < history.end_tick ? pulse_height(history, period) : 0.0;
  return continuous(history, period, 2 * tick);
}

double amplitude_left(const PlanHistory& history, double period, std::int64_t tick) noexcept {
  if (history.kind == PlanHistory::Kind::kPulse)
    return history.start_tick < tick && tick <= history.end_tick ? pulse_height(history, period) : 0.0;
  return continuous(history, period, 2 * tick);
}

double amplitude_middle(const PlanHistory& history, double period, std::int64_t tick) noexcept {
  if (history.kind == PlanHistory::Kind::kPulse) return amplitude_right(history, period, tick);
  return continuous(history, period, 2 * tick + 1);
}

double amplitude_at(const PlanHistory& history, double period, std::int64_t tick, double fraction) noexcept {
  if (history.kind == PlanHistory::Kind::kPulse) return amplitude_right(history, period, tick);
  return continuous(history, period, 2 * tick, fraction);
}

bool bends_at(const PlanHistory& history, double period, std::int64_t tick) noexcept {
  if (history.kind != PlanHistory::Kind::kTable) return false;
  const double time = static_cast<double>(tick) * period;
  const auto above = std::lower_bound(history.times.begin(), history.times.end(), time - 0.5 * period);
  return above != history.times.end() && *above < time + 0.5 * period;
}

}  // namespace freeflex
