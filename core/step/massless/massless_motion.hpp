// Displacements, velocities and accelerations of massless points, which follow from the motion of the others.
#pragma once

#include "core/step/loads/step_loads.hpp"

namespace freeflex {

/// Returns the massless points of a plan, at rest.
std::vector<MasslessMotion> make_massless_motion(const StepPlan& plan);

/// Sets the motion of massless points at the start, where their rates are those of the linear structure. The
/// first step overwrites them.
/// \pre state.q, q_dot, coupled.joints and coupled.w_B are set
void start_massless_motion(const StepPlan& plan, MotionState& state) noexcept;

/// Sets the motion of massless points in a state whose other members are set, at the end of a step. The other
/// points and the bodies are moved along their velocities and accelerations to both sides, and the massless
/// points follow   (THEORY 12.117). Changes of the loads with time are not part of it.
/// \pre the workspace has evaluated the state
void set_massless_motion(const StepLoads& step_loads, CoupledWorkspace& workspace,
                         MotionState& state) noexcept;

}  // namespace freeflex
