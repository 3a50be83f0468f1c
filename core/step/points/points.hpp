// The step of a plan that integrates the points   (THEORY 12.127 to 12.135).
#pragma once

#include "core/step/loads/step_loads.hpp"
#include "core/step/points/history.hpp"
#include "core/step/points/multistep.hpp"
#include "core/step/state.hpp"

namespace freeflex {

/// Advances the points by one tick.  \param is_fresh  the loads may have changed at the start of the tick
/// Returns false if the motion is not finite. The motion is then that at the start of the tick, and its past
/// may be lost.
bool advance_points(const StepLoads& step_loads, bool is_fresh, State& state, Workspace& workspace) noexcept;

}  // namespace freeflex
