// Reads the motion at a tick of a plan that integrates the points   (THEORY 12.132 to 12.134).
#pragma once

#include "core/step/state.hpp"

namespace freeflex {

/// Sets x and v to the motion of the points at the present tick   (THEORY 12.132).
/// \pre the history has at least one node
void place_points(const StepPlan& plan, const PointHistory& history, double* x, double* v) noexcept;

/// Sets state.points to the motion of the points at the tick   (THEORY 12.132).
/// \pre the plan integrates points
void read_points(const StepPlan& plan, State& state) noexcept;

/// Sets the frame to that of the points at the tick   (THEORY 12.133).
void read_frame(const StepPlan& plan, State& state) noexcept;

/// Sets the frame, the coordinates of the modes and the loads on them to those of the points at the tick
/// (THEORY 12.133, 12.134).
void read_modes(const StepPlan& plan, State& state, Workspace& workspace) noexcept;

}  // namespace freeflex
