// What is to be said at the start of how far ticks turn the body.
#pragma once

#include "core/scene/scene.hpp"
#include "core/step/plan.hpp"

namespace freeflex {

/// Warns where a tick turns the body further than its substeps resolve (THEORY X202), and where loads that
/// are fixed in the world turn by much in it (X144), with the rate that would do.
void warn_of_tick_turns(const Scene& scene, const Plan& plan, Faults& faults);

}  // namespace freeflex
