// Compares one mode with its closed form in 150 digits, computed from the exact doubles of the plan, at any
// step, at any damping and over many ticks.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tools/verification/reference/closed_form.hpp"
#include "tools/verification/stability/ride.hpp"
#include "tools/verification/stability/scenes.hpp"

namespace freeflex::tools {
namespace {

constexpr double kRate = 1000.0;  // [Hz]

/// Returns the norm |(omega dq, dq_dot)| of the error of the state, divided by the largest |(omega q, q_dot)|
/// of the motion, which occurs at the start.
double error_of(const Ride& ride, std::int64_t ticks) {
  const Plan& plan = ride.plan;
  const Real w(plan.omega[0]), t = Real(ticks) * Real(plan.period);
  const OscillatorMotion exact =
      oscillate(w, Real(plan.decay[0]), Real(plan.initial.q[0]), Real(plan.initial.q_dot[0]), 0, 0, t);
  const Real dq = w * (Real(ride.state().q[0]) - exact.q), dv = Real(ride.state().q_dot[0]) - exact.q_dot;
  const double size = std::hypot(plan.omega[0] * plan.initial.q[0], plan.initial.q_dot[0]);
  return sqrt(dq * dq + dv * dv).convert_to<double>() / size;
}

/// Returns the largest error at the ticks 1, 10, 100 and 1000, or NaN if a state is not finite.
double worst_error(Scene scene, std::string& why) {
  scene.verdict.is_off = true;  // a shadow that resolves omega h = 1e8 would take most of the time
  Ride ride(scene);
  if (!ride.has_plan()) {
    why = ride.faults_text();
    return NAN;
  }
  double worst = 0.0;
  std::int64_t done = 0;
  for (const std::int64_t ticks : {1, 10, 100, 1000}) {
    if (!ride.run(ticks - done)) {
      why = "a state is not finite";
      return NAN;
    }
    done = ticks;
    worst = std::max(worst, error_of(ride, ticks));
  }
  return worst;
}

/// Compares the elongation of the pair at the end, as other methods compute it, with the closed form of the
/// mode.
std::vector<PeerFigure> pair_peers(double omega, double ratio, double end, const StabilityOptions& options) {
  Scene scene = oscillating_pair(omega, kRate);
  scene.damping.beta = 2.0 * ratio / omega;
  const double stretch = 1e-3;  // [m] at the start
  const Real w(omega);
  const OscillatorMotion exact = oscillate(w, Real(ratio) * w, Real(stretch), 0, 0, 0, Real(end));
  return run_peers(scene, 1.0 / kRate, end, options, [&](const CartesianState& state) {
    const double now = (state.p_W.col(1) - state.p_W.col(0)).norm() - 1.0;
    return std::abs((Real(now) - exact.q).convert_to<double>()) / stretch;
  });
}

Outcome at_step(double phase, const StabilityOptions& options) {
  const double omega = phase * kRate;
  Outcome outcome;
  outcome.measured = worst_error(oscillating_pair(omega, kRate), outcome.message);
  if (outcome.message.empty())
    outcome.message = format_text(
        "the rounding error of omega alone causes a phase error of %.0e after 1000 ticks", 1.1e-13 * phase);
  outcome.peers = pair_peers(omega, 0.0, 0.1, options);
  return outcome;
}

/// Measures the largest error for omega h from 1e-8 to 1e8.
Outcome at_damping(double ratio, const StabilityOptions& options) {
  Outcome outcome;
  outcome.measured = 0.0;
  double at = 0.0;
  for (int decade = -8; decade <= 8; ++decade) {
    const double phase = std::pow(10.0, decade);
    Scene scene = oscillating_pair(phase * kRate, kRate);
    scene.damping.modal_ratio = ratio;
    std::string why;
    const double error = worst_error(scene, why);
    if (!why.empty()) return no_answer(why);
    if (error >= outcome.measured) at = phase;
    outcome.measured = std::max(outcome.measured, error);
  }
  outcome.message = format_text("worst of 17 steps, at omega h %.0e; the other methods at omega h 1", at);
  outcome.peers = pair_peers(kRate, ratio, 0.1, options);
  return outcome;
}

/// Measures the error after many ticks.  \param count  number of ticks; a quick run executes fewer
Outcome many_ticks(std::int64_t count, const StabilityOptions& options) {
  const std::int64_t ticks = options.is_quick ? 200'000 : count;
  Scene scene = oscillating_pair(300.0, kRate);
  scene.initial.angular_velocity = {0.0, 0.0, 0.3};
  Ride ride(scene);
  if (!ride.has_plan()) return no_answer(ride.faults_text());
  for (std::int64_t done = 0; done < ticks; done += 10'000) {
    if (options.is_stopped()) return no_answer("interrupted");
    if (!ride.run(std::min<std::int64_t>(10'000, ticks - done))) return no_answer("a state is not finite");
  }
  Outcome outcome;
  outcome.measured = error_of(ride, ticks);
  // the body rotates about a principal axis, and the quaternion contains half the angle
  const Real half = Real(ride.plan.initial.w_B[2]) * Real(ticks) * Real(ride.plan.period) / 2;
  const Real difference = Real(ride.state().q_WB[0]) * sin(half) - Real(ride.state().q_WB[3]) * cos(half);
  const double angle = 2.0 * std::abs(difference.convert_to<double>());
  outcome.message =
      format_text("%lld ticks; attitude error %.1e rad after %.3g revolutions", static_cast<long long>(ticks),
                  angle, half.convert_to<double>() / std::numbers::pi);
  outcome.peers = pair_peers(300.0, 0.0, static_cast<double>(ticks) / kRate, options);
  return outcome;
}

}  // namespace

void add_oscillator_cases(std::vector<StabilityCase>& cases) {
  constexpr const char* kQuantity = "largest error in 1000 ticks over the amplitude, against 150 digits";
  struct Step {
    const char* name;
    double phase;
  };
  constexpr double kPi = std::numbers::pi;
  for (const Step& step : {Step{"omega h 1e-8", 1e-8}, Step{"omega h 1e-4", 1e-4}, Step{"omega h 1", 1.0},
                           Step{"omega h pi", kPi}, Step{"omega h 1000 pi", 1000.0 * kPi},
                           Step{"omega h 1e4", 1e4}, Step{"omega h 1e8", 1e8}})
    cases.push_back({"step against frequency", step.name, kQuantity, 1e-15, false,
                     [step](const StabilityOptions& options) { return at_step(step.phase, options); }});
  for (const double ratio : {0.0, 1e-9, 0.02, 1.0 - 1e-12, 1.0, 1e3, 1e6})
    cases.push_back(
        {"damping", ratio == 1.0 - 1e-12 ? "damping ratio 1 - 1e-12" : format_text("damping ratio %g", ratio),
         kQuantity, 1e-15, false,
         [ratio](const StabilityOptions& options) { return at_damping(ratio, options); }});
  cases.push_back({"many ticks", "1e8 ticks of a pair that rotates and vibrates, omega h 0.3",
                   "error at the end over the amplitude, against 150 digits", 1e-12, false,
                   [](const StabilityOptions& options) { return many_ticks(100'000'000, options); }});
}

}  // namespace freeflex::tools
