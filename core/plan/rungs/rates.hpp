// These functions change the rate of a plan. They set the members that depend on the period.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/plan.hpp"

namespace freeflex {

/// Sets the rate [Hz] of a plan, its fallback plan and its shadows. This changes propagators, modal coupling,
/// ticks of histories, and substeps.
/// \pre rate finite, > 0
void set_rate(Plan& plan, double rate);
/// The same for the part of a plan that the step reads.
void set_rate(StepPlan& plan, double rate);

/// Returns the number of substeps per tick that resolve the vibration. It is n_max or, if smaller, the
/// smallest power of two n with
///   omega_l h / n <= 1 for all modes with omega_l h <= n_max, omega_max h / n <= 1000,
///   n_max = 16384 h / max(1, num_modes / 64)^2, rounded down to a power of two   (THEORY 12.22).
/// A step that does not resolve the vibration misses the effect of the spin on the vibration.
/// \param omega  [rad/s] frequencies of all modes
/// \param period  [s] length h of a tick
std::int32_t resolving_substeps(std::span<const double> omega, double period);

/// Returns the number of substeps of a shadow of a plan on `rung`. The argument `resolving` is the result of
/// resolving_substeps(). The full shadow makes 1 substep. If the rung divides its own tick, the shadow makes
/// 2 substeps. Otherwise it makes `resolving` substeps, but at least 2 if the shadow is the fine shadow or
/// `rung` is a coupled rung (THEORY 12.22).
std::int32_t shadow_substeps(PlanShadow::Kind kind, Fidelity rung, std::int32_t resolving);

/// Converts a horizon [s] to ticks. Returns at least 1.
std::int64_t horizon_in_ticks(double horizon, double period);

/// Returns a warning if a frequency of the plan is above a thousand times the rate of the plan, because
/// masses or stiffnesses are then likely to be in a wrong unit. Returns an empty text otherwise.
std::string find_fast_modes(const Plan& plan);

}  // namespace freeflex
