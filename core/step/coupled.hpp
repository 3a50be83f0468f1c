// The coupled rungs: elastic motion acts back on the body, and links may be taken at true length and
// direction (THEORY section 12).
#pragma once

#include "core/step/external.hpp"

namespace freeflex {

/// Momenta of the coupled rungs from the motion (X91), x = r + V:
///   H = sum m x cross (w cross x) + sum m V cross V',   p_l = q_l' + sum m_i b_il . (w cross V_i) / M
/// \pre state.q, q_dot, q_WB stand
/// \param w_B  [rad/s] angular velocity of the frame, body axes
void set_coupled_motion(const Plan& plan, const Vec3& w_B, MotionState& state) noexcept;

/// Scratch for advance_coupled_rung, sized for the plan.
CoupledWorkspace make_coupled_workspace(const Plan& plan);

/// The state one period later, or one part of it (X93, X100): y' = L y + N(y, t), L the modes' own motion by
/// its exponential, N the rest in four stages. In `frame`, workspace.next_q, next_q_dot, Q_left and
/// workspace.coupled.next; the state is left alone. True when everything is finite. Order 4,
/// whatever the stiffest mode is. \param is_fresh  loads jumped at this tick: the rates of the state are not
/// those of its right limit
bool advance_coupled_rung(const External& external, const MotionState& state, bool is_fresh,
                          Workspace& workspace, Frame& frame, Vec3& force_W, Vec3& moment_B) noexcept;

/// A bar at true length and direction, d = V_second - V_first, rest length l_0 and direction e   (X94):
///   tension T = k (l - l_0),   l - l_0 = (2 l_0 e.d + d.d) / (l + l_0),   l = |l_0 e + d|,
///   excess over the linear bar  T (l_0 e + d) / l - k (e.d) e
struct BarForce {
  double tension = 0.0;  // [N]
  Vec3 excess{};         // [N] on the first point
};
BarForce bar_force(const PlanBar& bar, const Vec3& d) noexcept;
/// The same of its damping, from the rate of d in body axes, in which a spin of the body has no part:
///   T = c (l_0 e + d).d' / l,   excess  T (l_0 e + d) / l - c (e.d') e
BarForce damper_force(const PlanBar& bar, const Vec3& d, const Vec3& d_dot) noexcept;

}  // namespace freeflex
