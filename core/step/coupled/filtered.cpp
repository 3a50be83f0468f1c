#include "core/step/coupled/filtered.hpp"

#include <algorithm>
#include <limits>

#include "core/step/coupled/curve.hpp"

namespace freeflex {

void evaluate_curved(const StepLoads& step_loads, const double* q, const double* p, StageState stage,
                     Workspace& workspace, StageRate& rate) noexcept {
  CurveWorkspace& curve = workspace.coupled.curve;
  to_linear(step_loads.plan, q, p, curve);
  stage.q = curve.q.data();
  stage.p = curve.p.data();
  evaluate(step_loads, stage, workspace, rate);
  curve_rates(step_loads.plan, rate.rate_q, rate.rate_p, curve);
}

namespace {

// [-] The rates at a slow motion are used if its image is nearer than this share of what the slow motion
// moves in a substep. The rest acts like a delay of the force, which makes vibrations grow or decay
// (THEORY 12.96).
constexpr double kSlowMiss = 0.002;
// [-] A slow motion that moves by less than this share of itself counts as moving by this share. The joints
// are found to 1e-7 rad.
constexpr double kSlowFloor = 1e-7;
// [-] A miss below this share of the slow motion may be due to rounding, which more trials do not reduce.
constexpr double kRoundedShare = 1e-6;
constexpr int kMostTrials = 12;

}  // namespace

double pace_of_slow_motion(const StepPlan& plan, const CoupledWorkspace& w) noexcept {
  return std::max({distance_of_slow_motion(plan, w.curve, w.slow_start, 1.0), w.least_pace,
                   kSlowFloor * distance_of_slow_motion(plan, w.curve, w.slow_start, 0.0)});
}

void evaluate_filtered(const StepLoads& step_loads, const double* q, const double* p, const StageState& stage,
                       Workspace& workspace, StageRate& rate) noexcept {
  const StepPlan& plan = step_loads.plan;
  CoupledWorkspace& w = workspace.coupled;
  rate.rate_q_dot = w.rate_q_dot.data();
  double last = std::numeric_limits<double>::infinity(), least = last;  // last miss, least of those before
  for (w.curve.num_tried = 0; w.curve.num_tried < kMostTrials;) {
    filter(plan, q, p, w.filtered_q, w.filtered_p, w.curve);
    evaluate_curved(step_loads, w.filtered_q.data(), w.filtered_p.data(), stage, workspace, rate);
    const double miss = improve_slow_motion(plan, rate.rate_q, rate.rate_p, rate.rate_q_dot, w.curve);
    w.slow_pace = std::max(w.slow_pace, pace_of_slow_motion(plan, w));
    if (!(miss > kSlowMiss * w.slow_pace)) return;
    const double slow = distance_of_slow_motion(plan, w.curve, w.slow_start, 0.0);
    if (miss < kRoundedShare * slow + w.least_pace && std::min(last, miss) > 0.5 * least) return;
    least = std::min(least, last), last = miss;
  }
}

void set_filtered_rates(const StepLoads& step_loads, const StageState& result,
                        Workspace& workspace) noexcept {
  CoupledWorkspace& w = workspace.coupled;
  StageRate rate{w.next.curved_rate_q.data(), w.next.curved_rate_p.data()};
  evaluate_filtered(step_loads, w.next.curved_q.data(), w.next.curved_p.data(), result, workspace, rate);
  w.next.filtered_w_B = rate.w_B;
  w.next.filtered_moment_B = rate.moment_B;
  w.next.filtered_force_W = rate.force_W;
}

}  // namespace freeflex
