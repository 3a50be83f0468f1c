// Warnings about the rotation of the body within a tick, given at the start.
#pragma once

#include "core/plan.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// Warns if the body rotates further in a tick than its substeps resolve (THEORY 7.20, 7.21), and if loads
/// fixed in the world rotate far in body axes within a tick (THEORY 15.8). Each warning gives a rate that is
/// sufficient.
void warn_of_tick_rotations(const Scene& scene, const StepPlan& plan, Faults& faults);

}  // namespace freeflex
