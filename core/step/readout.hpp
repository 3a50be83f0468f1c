// The read-out of a state: points, groups, link forces, invariants. Like the step, these functions allocate
// nothing, do not call libm, and give the same bits everywhere.
#pragma once

#include <span>

#include "core/step/state.hpp"

namespace freeflex {

/// Returns the rotation matrix of a unit quaternion, from body to world axes.
Mat3 rotation_matrix(const Quat& q_WB) noexcept;

/// Returns the sum of h_w a_w over the wheels [N m s], body axes. The sum is zero without wheels. Below the
/// coupled rungs, a_w are the axes of the wheels in the undeformed structure. On coupled rungs, a_w are the
/// axes rotated with their bodies (THEORY 16.22, 16.29).
Vec3 wheel_momentum_B(const StepPlan& plan, const MotionState& state) noexcept;

/// Returns the angular velocity of the floating frame, body axes [rad/s]. Below the coupled rungs it is
///   w = I^-1 (R_WB^T H_W - sum_w h_w a_w)   (THEORY 7.4, 16.22)
Vec3 angular_velocity(const StepPlan& plan, const MotionState& state) noexcept;

struct PointState {
  Vec3 p_W{};  // [m] position
  Vec3 v_W{};  // [m/s] velocity
  Vec3 a_W{};  // [m/s^2] acceleration at the left limit of the tick
  Vec3 V_B{};  // [m] elastic displacement, body axes
};
/// Returns position, velocity and acceleration of a point, x_i = r_i + V_i:
///   p_i = p_WB + R_WB x_i   (THEORY 9.1)
///   v_i = v_WB + R_WB (w x x_i + V_i')   (THEORY 9.2)
///   a_i = g_W + F_W / M + R_WB (w' x x_i + w x (w x x_i) + 2 w x V_i' + V_i'')   (THEORY 9.3)
/// On the coupled rungs, the acceleration is given by (THEORY 12.21, 12.43) instead.
/// \pre plan.points[point].row >= 0
PointState read_point(const StepPlan& plan, const MotionState& state, int point) noexcept;

/// Reads points in several states at once, which reads each row of mode shapes once for all states. The
/// results have the bits of read_point.
class PointsReader {
 public:
  static constexpr std::size_t kMostStates = 8;
  explicit PointsReader(const StepPlan& plan);
  /// Sets to[i * states.size() + k] to the motion of point i of `points` in state k.
  /// \pre 1 to kMostStates states, all on the same one of the plan and its fallback
  void read(std::span<const MotionState* const> states, std::span<const std::int32_t> points,
            PointState* to) noexcept;

 private:
  const StepPlan& given_;
  Array vectors_;  // [m], [m/s], [m/s^2] (states x 3 x num_padded) q, q' and q'' of each state
};

/// Holds the motion of a point relative to the centre of mass of the structure, axes of the frame.
struct FrameMotion {
  Vec3 x{}, v{}, a{};  // [m], [m/s], [m/s^2]
  Vec3 V{};            // [m] elastic displacement
};
FrameMotion read_in_frame(const StepPlan& plan, const MotionState& state, int point) noexcept;
/// Holds the spin of a turning body [rad/s] and its rate [rad/s^2], axes of the body   (THEORY 12.93).
struct BodyRates {
  Vec3 s, s_dot;
};
BodyRates read_body_rates(const StepPlan& plan, const MotionState& state, std::int32_t number) noexcept;

struct BodyState {
  Quat q_WP{1.0, 0.0, 0.0, 0.0};  // attitude of the body at the point
  Vec3 w_P{};  // [rad/s] angular velocity of the body at the point, in the axes of this body
};
/// Returns the attitude and the angular velocity of the body at a point. In the undeformed structure, the
/// axes of this body are the axes of the scene. theta is the elastic rotation of the body, and g = theta / 2
/// the Gibbs vector:
///   q_WP = q_WB o (1, g) / sqrt(1 + g.g)   (THEORY 16.15)
///   w_P = G(g)^T w + 2 (g' - g x g') / (1 + g.g)   (THEORY 16.16)
/// \pre attitude_index_of(plan, point) >= 0
BodyState read_body(const StepPlan& plan, const MotionState& state, int point) noexcept;

struct GroupPose {
  Vec3 p_W{};                     // [m] centre of mass of the group
  Quat q_WG{1.0, 0.0, 0.0, 0.0};  // attitude of the floating frame, followed by the mean elastic rotation of
                                  // the group
  Vec3 v_W{};                     // [m/s] velocity of the centre of mass of the group
  Vec3 w_B{};                     // [rad/s] angular velocity of the group, body axes
};
/// Returns the pose and the velocities of a group, computed from its points to first order in V:
///   p_g = p_WB + R_WB x_g,   x_g = r_g + sum_i m_i V_i / m_g   (THEORY 9.5)
///   theta_g = J_g^-1 sum_i m_i d_i x V_i   (THEORY 9.6)
///   q_WG = q_WB o (1, theta_g / 2) / sqrt(1 + |theta_g|^2 / 4)   (THEORY 9.7)
///   v_g = v_WB + R_WB (w x x_g + x_g'),   w_g = w + theta_g'   (THEORY 9.8, 9.9)
GroupPose read_group(const StepPlan& plan, const MotionState& state, int group) noexcept;

/// Writes the forces of one published link, rows q + rate rows q' + load rows Q, into out (num_rows of
/// plan.link_outputs[output])   (THEORY 5.1 to 5.6). The force of a bar in PlanCoupled::bars is that at true
/// length (THEORY 12.17).
void read_link(const StepPlan& plan, const MotionState& state, int output, std::span<double> out) noexcept;

/// Holds momenta, energies without the kinetic energy of wheels, and residuals of the conditions on the
/// coordinates.
struct Invariants {
  double kinetic_rigid = 0.0;  // [J] M v_WB^2 / 2 + w^T I w / 2   (THEORY 7.1)
  // [J] M sum q_l'^2 / 2   (THEORY 7.1); on coupled rungs, kinetic_rigid + kinetic_elastic is E_kin + M
  // v_WB^2 / 2 (THEORY 12.1, 12.4)
  double kinetic_elastic = 0.0;
  double potential = 0.0;              // [J] elastic energy, M sum omega_l^2 q_l^2 / 2   (THEORY 4.18, 4.19)
  Vec3 linear_momentum_W{};            // [kg m/s]
  Vec3 angular_momentum_W{};           // [kg m^2/s] about the centre of mass
  Vec3 eckart_translation{};           // [kg m] sum m V   (THEORY 2.12)
  Vec3 eckart_rotation{};              // [kg m^2] sum m r x V   (THEORY 2.12)
  double quaternion_norm_error = 0.0;  // [-] norm of q_WB minus 1
};
Invariants read_invariants(const StepPlan& plan, const MotionState& state) noexcept;

}  // namespace freeflex
