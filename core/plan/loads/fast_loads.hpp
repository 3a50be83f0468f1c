// Loads that change faster than the ticks resolve.
#pragma once

#include "core/plan.hpp"

namespace freeflex {

/// Returns the loads that change faster than the period of the plan resolves.
/// The step does not resolve such loads, because it takes loads as linear from tick to tick (THEORY X144).
/// \pre the modes and histories of the plan are filled
std::vector<std::int32_t> find_fast_loads(const StepPlan& plan);

}  // namespace freeflex
