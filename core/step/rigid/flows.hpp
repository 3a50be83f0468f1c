// The step of the frame for long ticks: a composition of order 8 of rotations about one axis, free fall and
// impulses, each of which is exact (THEORY 7.14 to 7.19, 7.26 to 7.31).
#pragma once

#include "core/step/rigid/frame.hpp"

namespace freeflex {

/// Returns the frame one period later, advanced in `substeps` substeps (see substeps_for)   (THEORY 7.18).
/// The result is exact for free spin about a principal axis, for free rotation of a body with two equal
/// principal moments, and for orbits without loads. For other motions the method has order 8.
Frame advance_by_flows(const StepPlan& plan, const Frame& from, const Mat3& R_WB, const RigidLoads& loads,
                       int substeps) noexcept;

}  // namespace freeflex
