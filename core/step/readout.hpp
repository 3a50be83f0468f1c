// What can be read from a state: points, groups, link forces, invariants. Same rules as the step.
#pragma once

#include <span>

#include "core/step/state.hpp"

namespace freeflex {

/// Rotation matrix of a unit quaternion, body to world.
Mat3 rotation_matrix(const Quat& q_WB) noexcept;

/// Momentum of the wheels, body axes [N m s], axes as at rest, on coupled rungs as their bodies have turned:
/// zero without any   (THEORY X167, X168).
Vec3 wheel_momentum_B(const Plan& plan, const MotionState& state) noexcept;

/// Angular velocity of the floating frame, body axes [rad/s]: w = I^-1 R_WB^T H_W (THEORY X6), H_W less the
/// momentum of wheels (THEORY X167).
Vec3 angular_velocity(const Plan& plan, const MotionState& state) noexcept;

struct PointState {
  Vec3 p_W{};  // [m]
  Vec3 v_W{};  // [m/s]
  Vec3 a_W{};  // [m/s^2] left limit at the tick
  Vec3 V_B{};  // [m] elastic displacement, body axes
};
/// Kinematics of one point with rows in the plan: p_i = p_WB + R_WB x_i, v_i = v_WB + R_WB (w cross x_i +
/// V_i'), x_i = r_i + V_i   (THEORY 2.3, 4.2).  \pre plan.points[point].row >= 0
PointState read_point(const Plan& plan, const MotionState& state, int point) noexcept;

struct BodyState {
  Quat q_WP{1.0, 0.0, 0.0, 0.0};  // attitude of the point: of the frame, and its elastic rotation
  Vec3 w_P{};                     // [rad/s] its rate, axes of the point
};
/// Attitude of a point that turns, whose axes are the scene's at rest: the frame's, turned by theta, Gibbs
/// vector theta / 2, and the rate of just that   (THEORY X165).  \pre turning_of(plan, point) >= 0
BodyState read_body(const Plan& plan, const MotionState& state, int point) noexcept;

struct GroupPose {
  Vec3 p_W{};                     // [m] centre of mass of the group
  Quat q_WG{1.0, 0.0, 0.0, 0.0};  // attitude of the group: frame plus mass-weighted mean elastic rotation
  Vec3 v_W{};                     // [m/s]
  Vec3 w_B{};                     // [rad/s] body axes
};
/// Pose of a group from its points (all with rows), first order in V: its centre r_g + sum m_i V_i / m_g,
/// turned by theta = J_g^-1 sum m_i d_i x V_i   (THEORY X14).
GroupPose read_group(const Plan& plan, const MotionState& state, int group) noexcept;

/// Forces of one published link, rows q + rate rows q' + load rows Q, into out (num_rows of
/// plan.link_outputs[output])   (THEORY X48, X49, X67).
void read_link(const Plan& plan, const MotionState& state, int output, std::span<double> out) noexcept;

/// Conserved quantities and residuals   (THEORY 2.2, 4.4, 5.5).
struct Invariants {
  double kinetic_rigid = 0.0;          // [J] M v_WB^2 / 2 + w^T I w / 2, wheels apart (THEORY 4.4)
  double kinetic_elastic = 0.0;        // [J] M sum q_l'^2 / 2
  double potential = 0.0;              // [J] elastic, M sum omega_l^2 q_l^2 / 2 (THEORY 5.5)
  Vec3 linear_momentum_W{};            // [kg m/s]
  Vec3 angular_momentum_W{};           // [kg m^2/s] about the centre of mass
  Vec3 eckart_translation{};           // [kg m] sum m V
  Vec3 eckart_rotation{};              // [kg m^2] sum m r x V
  double quaternion_norm_error = 0.0;  // |q| - 1
};
Invariants read_invariants(const Plan& plan, const MotionState& state) noexcept;

}  // namespace freeflex
