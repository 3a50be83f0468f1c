#include "core/plan/rungs/rates.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "core/faults.hpp"
#include "core/plan/loads/fast_loads.hpp"
#include "core/plan/loads/histories.hpp"
#include "core/plan/modes/modal_coupling.hpp"
#include "core/plan/modes/propagator.hpp"
#include "core/plan/rungs/rungs.hpp"

namespace freeflex {
namespace {

// [rad] The largest phase of a mode in a substep of a shadow that resolves the mode. With this limit,
// estimates are 1.25 times the true error (budget_test).
constexpr double kSubstepPhase = 1.0;
// [1/s] Largest number of substeps per second of simulated time for up to kFewModes modes. A substep then
// takes some 15 us. With more modes the limit is lower, because a substep costs more.
constexpr double kMaxSubstepRate = 16384.0, kFewModes = 64.0;

}  // namespace

std::int32_t resolving_substeps(std::span<const double> omega, double period) {
  const double crowd = std::max(1.0, static_cast<double>(omega.size()) / kFewModes);
  const double most =
      std::clamp(kMaxSubstepRate / (crowd * crowd) * period, 1.0, static_cast<double>(kMaxSubsteps));
  std::int32_t substeps = 1;
  while (2 * substeps <= most) substeps *= 2;
  double phase = 0.0, fastest = 0.0;
  for (const double each : omega) {
    fastest = std::max(fastest, each * period);
    if (each * period <= kSubstepPhase * substeps) phase = std::max(phase, each * period);
  }
  while (substeps > 1 && phase <= 0.5 * kSubstepPhase * substeps && fastest <= 0.5 * kMaxBarPhase * substeps)
    substeps /= 2;
  return substeps;
}
std::int32_t shadow_substeps(PlanShadow::Kind kind, Fidelity rung, std::int32_t substeps) {
  if (kind == PlanShadow::Kind::kFull) return 1;
  if (traits_of(rung).divides_tick) return 2;  // true: the rung divides its own tick
  const bool is_halved = kind == PlanShadow::Kind::kFine || traits_of(rung).couples;
  return std::max(substeps, is_halved ? 2 : 1);
}

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
  const auto update = [](const StepPlan& stepped, PlanUnmodelled& unmodelled) {
    if (unmodelled.is_known) unmodelled.fast_loads = find_fast_loads(stepped);
  };
  update(plan, plan.unmodelled);
  for (std::size_t k = 0; k < plan.fallback.size(); ++k)
    update(plan.fallback[k], plan.fallback_unmodelled[k]);
  PlanBudget& budget = plan.budget;
  if (budget.shadows.empty()) return;
  const StepPlan& best = budget.shadows.front().plan;
  const std::int32_t substeps = resolving_substeps({best.omega.data(), index(best.num_elastic)}, plan.period);
  for (PlanShadow& shadow : budget.shadows) {
    shadow.substeps = shadow_substeps(shadow.kind, plan.fidelity, substeps);
    set_own_rate(shadow.plan, shadow.substeps / plan.period);
  }
  budget.horizon_ticks = horizon_in_ticks(budget.horizon, plan.period);
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
