// The frame over long ticks: turns about one axis, fall and kicks, each exact, in a composition of order 8
// (THEORY X200 to X204).
#pragma once

#include "core/step/frame.hpp"

namespace freeflex {

/// The frame one period later, in so many substeps (substeps_for). Exact for spin about a principal
/// axis, for bodies with equal moments across the spin, and for orbits without loads; order 8 else.
Frame advance_by_flows(const Plan& plan, const Frame& from, const Mat3& R_WB, const StepLoads& loads,
                       int substeps) noexcept;

}  // namespace freeflex
