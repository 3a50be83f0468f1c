#include "core/plan/rungs/rates.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "core/faults.hpp"
#include "core/plan/integration/choose_method.hpp"
#include "core/plan/loads/histories.hpp"
#include "core/plan/modes/modal_coupling.hpp"
#include "core/plan/modes/propagator.hpp"
#include "core/plan/rungs/rungs.hpp"
#include "core/plan/rungs/shadow.hpp"

namespace freeflex {
std::int64_t horizon_in_ticks(double horizon, double period) {
  constexpr double kForever = 1e15;  // far within 64 bits, also when multiplied by the number of substeps
  return std::max<std::int64_t>(1, std::llround(std::min(horizon / period, kForever)));
}

namespace {

// Sets the rate of one plan, but not of its fallback plan and its shadows.
void set_own_rate(StepPlan& plan, double rate) {
  plan.period = 1.0 / rate;
  plan.propagator.undamped.clear();
  plan.propagator.lanes.assign(index(plan.num_moving) / kLanes, {});
  for (int mode = 0; mode < plan.num_elastic; ++mode) {
    const auto l = index(mode);
    set_mode(plan.propagator, mode, plan.omega[l], plan.decay[l], plan.period, plan.mass);
  }
  set_modal_coupling_period(plan);
  set_coupled_period(plan);
  set_points_period(plan);
  if (!plan.has_damping) drop_damping(plan.propagator);
  for (PlanHistory& history : plan.histories) set_history_ticks(history, plan.period);
}

}  // namespace

void set_rate(StepPlan& plan, double rate) {
  assert(std::isfinite(rate) && rate > 0.0);
  set_own_rate(plan, rate);
  for (StepPlan& fallback : plan.fallback) set_own_rate(fallback, rate);
}

void set_rate(Plan& plan, double rate) {
  set_rate(static_cast<StepPlan&>(plan), rate);
  set_shadow_rate(plan);
}

std::string find_fast_modes(const Plan& plan) {
  constexpr double kMostOfRate = 1000.0;  // [-] the stiffest shipped truss has a ratio of 107
  const auto fastest = std::max_element(plan.omega.begin(), plan.omega.end());
  const double highest = fastest == plan.omega.end() ? 0.0 : *fastest / (2.0 * std::numbers::pi);
  if (highest * plan.period <= kMostOfRate) return {};
  return join_text("the highest frequency, ", highest, " Hz, is ", highest * plan.period,
                   " times the rate of ", 1.0 / plan.period,
                   " Hz; check that masses are in kg, lengths in m, and stiffnesses in N/m, N or N m^2");
}

}  // namespace freeflex
