// Loads that change faster than ticks follow.
#pragma once

#include "core/step/plan.hpp"

namespace freeflex {

/// Fills plan.neglect.fast_loads, for the plan's period: a load is straight from tick to tick   (THEORY
/// X144). \pre the plan has its modes and histories
void find_fast_loads(Plan& plan);

}  // namespace freeflex
