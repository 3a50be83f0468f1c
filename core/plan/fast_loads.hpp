// Loads that change faster than the ticks resolve.
#pragma once

#include "core/step/plan.hpp"

namespace freeflex {

/// Fills plan.unmodelled.fast_loads with the loads that change faster than the period of the plan resolves.
/// The step does not resolve such loads, because it takes loads as linear from tick to tick (THEORY X144).
/// \pre the modes and histories of the plan are filled
void find_fast_loads(Plan& plan);

}  // namespace freeflex
