#include "core/plan/rates.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/plan/fast_loads.hpp"
#include "core/plan/histories.hpp"
#include "core/plan/mixing.hpp"
#include "core/plan/propagator.hpp"
#include "core/plan/rungs.hpp"
#include "core/scene/faults.hpp"

namespace freeflex {
namespace {

// [rad] of a mode in a part of a tick that resolves it: estimates are 1.25 of the truth (budget_test)
constexpr double kPartTurn = 1.0;
// parts a second with up to kFewModes modes, some 15 us each; beyond, in proportion to what a part costs
constexpr double kMostPartRate = 16384.0, kFewModes = 64.0;

}  // namespace

std::int32_t resolving_parts(std::span<const double> omega, double period) {
  const double crowd = std::max(1.0, static_cast<double>(omega.size()) / kFewModes);
  const double most =
      std::clamp(kMostPartRate / (crowd * crowd) * period, 1.0, static_cast<double>(kMaxParts));
  std::int32_t parts = 1;
  while (2 * parts <= most) parts *= 2;
  double turn = 0.0, fastest = 0.0;
  for (const double each : omega) {
    fastest = std::max(fastest, each * period);
    if (each * period <= kPartTurn * parts) turn = std::max(turn, each * period);
  }
  while (parts > 1 && turn <= 0.5 * kPartTurn * parts && fastest <= 0.5 * kMaxBarPhase * parts) parts /= 2;
  return parts;
}
std::int32_t shadow_steps(PlanShadow::Kind kind, Fidelity rung, std::int32_t parts) {
  if (kind == PlanShadow::Kind::kWhole) return 1;
  if (traits_of(rung).divides_tick) return 2;  // it divides its own step
  const bool is_halved = kind == PlanShadow::Kind::kFine || traits_of(rung).couples;
  return std::max(parts, is_halved ? 2 : 1);
}

std::int64_t horizon_in_ticks(double horizon, double period) {
  constexpr double kForever = 1e15;  // far inside 64 bits, also times substeps
  return std::max<std::int64_t>(1, std::llround(std::min(horizon / period, kForever)));
}

namespace {

// of one plan, its wide one and its shadows apart
void set_own_rate(Plan& plan, double rate) {
  plan.period = 1.0 / rate;
  plan.propagator.undamped.clear();
  plan.propagator.lanes.assign(static_cast<std::size_t>(plan.num_moving) / kLanes, {});
  for (int mode = 0; mode < plan.num_elastic; ++mode) {
    const auto l = static_cast<std::size_t>(mode);
    set_mode(plan.propagator, mode, plan.omega[l], plan.decay[l], plan.period, plan.mass);
  }
  set_mixing_period(plan);
  set_coupled_period(plan);
  if (!plan.damps) drop_damping(plan.propagator);
  for (PlanHistory& history : plan.histories) set_history_ticks(history, plan.period);
  if (plan.neglect.is_known) find_fast_loads(plan);
}

}  // namespace

void set_rate(Plan& plan, double rate) {
  set_own_rate(plan, rate);
  for (Plan& wide : plan.wide) set_own_rate(wide, rate);
  PlanBudget& budget = plan.budget;
  if (budget.shadows.empty()) return;
  const Plan& best = budget.shadows.front().plan;
  const std::int32_t parts =
      resolving_parts({best.omega.data(), static_cast<std::size_t>(best.num_elastic)}, plan.period);
  for (PlanShadow& shadow : budget.shadows) {
    shadow.substeps = shadow_steps(shadow.kind, plan.fidelity, parts);
    set_own_rate(shadow.plan, shadow.substeps / plan.period);
  }
  budget.horizon_ticks = horizon_in_ticks(budget.horizon, plan.period);
}

std::string find_fast_modes(const Plan& plan) {
  constexpr double kMostOfRate = 1000.0;  // [-] the stiffest of the shipped trusses has 107
  const auto fastest = std::max_element(plan.omega.begin(), plan.omega.end());
  const double highest = fastest == plan.omega.end() ? 0.0 : *fastest / (2.0 * std::numbers::pi);
  if (highest * plan.period <= kMostOfRate) return {};
  return join_text("the highest frequency, ", highest, " Hz, is ", highest * plan.period,
                   " times the rate of ", 1.0 / plan.period,
                   " Hz; masses are in kg, lengths in m, stiffnesses in N/m, N or N m^2");
}

}  // namespace freeflex
