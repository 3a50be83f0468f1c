// Loads that change faster than the ticks resolve.
#pragma once

#include "core/plan.hpp"

namespace freeflex {

/// Returns the loads that change faster than the period of the plan resolves.
/// The step does not resolve such loads, because it takes loads as linear from tick to tick (THEORY 15.10).
/// \pre the modes and histories of the plan are filled
std::vector<std::int32_t> find_fast_loads(const StepPlan& plan);

/// Returns the loads that change faster than a shadow resolves that takes them as the scene gives them. It
/// samples a load 16 times a tick (THEORY 15.2).
/// \pre as above
std::vector<std::int32_t> find_unseen_loads(const StepPlan& plan);

}  // namespace freeflex
