// These functions change the rate of a plan. They set the members that depend on the period.
#pragma once

#include <cstdint>
#include <string>

#include "core/plan.hpp"

namespace freeflex {

/// Sets the rate [Hz] of a plan, its fallback plan and its shadows. This changes propagators, modal coupling,
/// ticks of histories, and substeps.
/// \pre rate finite, > 0
void set_rate(Plan& plan, double rate);
/// The same for the part of a plan that the step reads.
void set_rate(StepPlan& plan, double rate);

/// Converts a horizon [s] to ticks. Returns at least 1.
std::int64_t horizon_in_ticks(double horizon, double period);

/// Returns a warning if a frequency of the plan is above a thousand times the rate of the plan, because
/// masses or stiffnesses are then likely to be in a wrong unit. Returns an empty text otherwise.
std::string find_fast_modes(const Plan& plan);

}  // namespace freeflex
