// The coupled rungs: elastic motion acts back on the body, and links may be taken at true length and
// direction (THEORY section 12).
#pragma once

#include "core/step/external.hpp"

namespace freeflex {

/// Momenta of the coupled rungs from the motion (X91).  \pre state.q, q_dot, q_WB stand
/// \param w_B  [rad/s] angular velocity of the frame, body axes
void set_coupled_motion(const Plan& plan, const Vec3& w_B, MotionState& state) noexcept;

/// Scratch for advance_coupled_rung, sized for the plan.
CoupledWorkspace make_coupled_workspace(const Plan& plan);

/// The state one period later, or one part of it (X93, X100), in `frame`, workspace.next_q, next_q_dot,
/// Q_left and workspace.coupled.next; the state is left alone. True when everything is finite. Order 4,
/// whatever the stiffest mode is. \param is_fresh  loads jumped at this tick: the rates of the state are not
/// those of its right limit
bool advance_coupled_rung(const External& external, const MotionState& state, bool is_fresh,
                          Workspace& workspace, Frame& frame, Vec3& force_W, Vec3& moment_B) noexcept;

/// Tension of a bar at true length over an elongation from its ends' displacements, d = V_second - V_first,
/// and its vector from second to first point less that of the linear bar [N]   (X94).
struct BarForce {
  double tension = 0.0;  // [N]
  Vec3 excess{};         // [N] on the first point
};
BarForce bar_force(const PlanBar& bar, const Vec3& d) noexcept;
/// The same of its damping, from the rate of d in body axes: a spin of the body has no part in it.
BarForce damper_force(const PlanBar& bar, const Vec3& d, const Vec3& d_dot) noexcept;

}  // namespace freeflex
