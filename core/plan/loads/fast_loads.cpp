#include "core/plan/loads/fast_loads.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/plan/rungs/rungs.hpp"
#include "core/step/loads/step_loads.hpp"
#include "core/step/readout.hpp"
#include "core/step/vector.hpp"

namespace freeflex {
namespace {

// [cycles/tick] Largest frequency at which a sine is resolved. If a sine of n ticks per cycle is taken as
// linear from tick to tick, its amplitude is too small by the fraction (pi / n)^2 / 3. For 13 ticks this is
// 2 % (THEORY X144).
constexpr double kMostCycles = 1.0 / 13.0;

// Returns true if an image frequency of a sine excites a mode. A sine of frequency f that is linear from tick
// to tick also has components at k rate -+ f, whose amplitudes are (f / (k rate -+ f))^2 of that of the sine
// (THEORY X144).
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

// Returns the angular acceleration |I^-1 L| [rad/s^2] that a load at amplitude 1 gives the body at the
// attitude of the start. The motor of a wheel acts on the body with the opposite torque.
double acceleration_by(const LoadPattern& pattern, const StepPlan& plan) {
  RigidLoad load;
  add_resultant(plan, pattern, 1.0, load);
  Vec3 moment = moment_B(load, rotation_matrix(plan.initial.q_WB));
  for (std::size_t k = 0; k < pattern.wheel_torques.size(); ++k)
    moment = add_scaled(moment, -pattern.wheel_torques[k], plan.wheels[k].axis);
  return length(multiply(plan.inverse_inertia, moment));
}

// Returns how much spin [rad/s] the loads of the scene give the body up to a time [s], as if they all acted
// about one axis. World loads are taken at the attitude of the start.
double spin_by_loads(const StepPlan& plan, double time) {
  double spin = 0.0;
  for (const PlanHistory& history : plan.histories) {
    double seconds = time;  // [s] bound of the integral of the amplitude
    if (history.kind == PlanHistory::Kind::kPulse)
      seconds =
          history.pulse_start < time ? std::min(history.pulse_duration, time - history.pulse_start) : 0.0;
    if (history.kind == PlanHistory::Kind::kSine)
      seconds = std::min(time, 1.0 / (std::numbers::pi * history.frequency));
    if (history.kind == PlanHistory::Kind::kTable) {
      double most = 0.0;
      for (const double value : history.values) most = std::max(most, std::abs(value));
      seconds *= most;
    }
    if (seconds > 0.0) spin += seconds * acceleration_by(history.pattern, plan);
  }
  return spin;
}

// Returns true if moving the ends of a pulse to ticks (THEORY 8.10) shifts an end by more than 0.02 rad of
// the phase of a mode or of the rotation of the body. A shift of 0.02 rad changes the effect of the pulse by
// 2 %.
bool is_moved(const PlanHistory& pulse, const StepPlan& plan) {
  constexpr double kGoodError = 0.02;
  const auto shift = [&](std::int64_t tick, double time) {
    return std::abs(static_cast<double>(tick) * plan.period - time);
  };
  const double most = std::max(shift(pulse.start_tick, pulse.pulse_start),
                               shift(pulse.end_tick, pulse.pulse_start + pulse.pulse_duration));
  constexpr double kForEver = 1e12;  // [ticks] a longer pulse is taken as a pulse that never ends
  if (pulse.pulse_duration == 0.0 || pulse.pulse_duration > kForEver * plan.period) return false;
  double fastest = rotation_rate(plan) + spin_by_loads(plan, pulse.pulse_start + pulse.pulse_duration);
  for (const double omega : plan.omega) fastest = std::max(fastest, omega);
  return fastest * most > kGoodError;
}

bool is_empty(const LoadPattern& pattern) {
  return !pattern.has_world && !pattern.has_body &&
         std::all_of(pattern.wheel_torques.begin(), pattern.wheel_torques.end(),
                     [](double torque) { return torque == 0.0; });
}

bool is_faster_than_ticks(const PlanHistory& history, const StepPlan& plan) {
  if (history.kind == PlanHistory::Kind::kSine)
    return history.frequency * plan.period > kMostCycles || meets_image(history.frequency, plan);
  if (history.kind == PlanHistory::Kind::kPulse) return is_moved(history, plan);
  return history.kind == PlanHistory::Kind::kTable && bends_between_ticks(history, plan.period);
}

}  // namespace

std::vector<std::int32_t> find_fast_loads(const StepPlan& plan) {
  std::vector<std::int32_t> fast_loads;
  for (std::size_t k = 0; k < plan.histories.size(); ++k)
    if (!is_empty(plan.histories[k].pattern) && is_faster_than_ticks(plan.histories[k], plan))
      fast_loads.push_back(static_cast<std::int32_t>(k));
  return fast_loads;
}

}  // namespace freeflex
