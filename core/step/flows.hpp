// The step of the frame over long ticks is a composition of order 8. The parts of the composition are
// rotations about one axis, free fall and impulses, and each part is exact (THEORY 7.14 to 7.19, 7.26 to
// 7.31).
#pragma once

#include "core/step/frame.hpp"

namespace freeflex {

/// Returns the frame one period later, advanced in `substeps` substeps (see substeps_for)   (THEORY 7.18).
/// The result is exact for spin about a principal axis, for bodies whose two moments of inertia normal to the
/// spin are equal, and for orbits without loads. For other motions the method has order 8.
Frame advance_by_flows(const Plan& plan, const Frame& from, const Mat3& R_WB, const RigidLoads& loads,
                       int substeps) noexcept;

}  // namespace freeflex
