// The step of the coupled rungs, on which elastic motion acts back on the body and links may have their true
// length and direction   (THEORY section 12).
#pragma once

#include "core/step/loads/step_loads.hpp"

namespace freeflex {

/// Sets the momenta of the coupled rungs from displacements and velocities. The momenta follow from the
/// kinetic energy, with x_i = r_i + V_i:
///   E_kin = sum_i m_i |V_i' + w x x_i|^2 / 2   (THEORY 12.1)
///   H_B = I(q) w + sum_i m_i V_i x V_i' = sum_i m_i (x_i x (w x x_i) + V_i x V_i')   (THEORY 12.2, 12.34)
///   p_l = q_l' + sum_i m_i b_il . (w x V_i) / M   (THEORY 12.3, 12.33)
/// \pre state.q, q_dot, q_WB are set
/// \param w_B  [rad/s] angular velocity of the frame, body axes
void set_coupled_motion(const StepPlan& plan, const Vec3& w_B, MotionState& state) noexcept;

/// Returns scratch memory for advance_coupled_rung, sized for the plan.
CoupledWorkspace make_coupled_workspace(const StepPlan& plan);

/// Computes the state one substep later by an exponential Runge-Kutta method of order 4. In y' = L y + N(y,
/// t)   (THEORY 12.13), the linear motion L of each mode is advanced by its exponential, so stiff modes do
/// not limit the step. The rest, N, is evaluated in four stages   (THEORY 12.15, 12.16). The result is in
/// `frame`, workspace.next_q, next_q_dot, Q_left and workspace.coupled.next, and the state is unchanged.
/// Returns true if all results are finite.
/// \param is_fresh  true: loads jumped at this tick, so the rates in the state, which are those just before
/// the tick, are not used
bool advance_coupled_rung(const StepLoads& step_loads, const MotionState& state, bool is_fresh,
                          Workspace& workspace, Frame& frame, Vec3& force_W, Vec3& moment_B) noexcept;

/// Returns the rotations of joints without inertia at coordinates q. They are NaN if no equilibrium is found.
JointState relaxed_joints(const StepPlan& plan, const Array& q);

}  // namespace freeflex
