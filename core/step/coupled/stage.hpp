// One stage of a step on the coupled rungs: the state at the stage and its rate (THEORY 12.5 to 12.15).
#pragma once

#include "core/step/loads/step_loads.hpp"
#include "core/step/state.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

/// Holds the state at one stage.
struct StageState {
  const double *q, *p;  // [m], [m/s] (num_padded) elastic coordinates; elastic momenta over the mass
  Vec3 H_B;             // [kg m^2/s] angular momentum about the centre of mass
  Mat3 R_WB;
  Vec3 p_WB;  // [m] position of the centre of mass
  StageTime stage_time;
  std::span<const double> wheels;  // [N m s] (num_wheels) momenta of the wheels
};

/// Holds the rate of the state at one stage. The arrays belong to the caller.
struct StageRate {
  // [m/s], [m/s^2] (num_padded) Rates of q and p minus the linear motion of each mode: N in (THEORY 12.13)
  double *rate_q, *rate_p;
  double* Q = nullptr;   // [N] (num_padded) generalized forces; nullptr: not needed
  Vec3 w_B{};            // [rad/s] angular velocity of the frame
  Vec3 moment_B{};       // [N m] moment of the loads with deformed arms, r + V
  Vec3 rest_moment_B{};  // [N m] moment of the loads with rest arms, r
  Vec3 force_W{};        // [N] resultant of the loads
  // [N m] sum r x F over points and of torques in the axes of bodies, those of links included; set with Q for
  // complete sets of modes
  Vec3 balance_B{};
  double* q_ddot = nullptr;  // [m/s^2] (num_padded) accelerations of the coordinates; written if Q is
                             // set and the modes are not a complete set
  Vec3 w_dot_B{};            // [rad/s^2] rate of w_B; set whenever q_ddot is written
  // [m/s^2] (num_padded) rate of rate_q due to the motion of the points; nullptr: not needed
  double* rate_q_dot = nullptr;
};

/// Computes the rate at a stage   (THEORY 12.5 to 12.13, 12.33 to 12.51).
void evaluate(const StepLoads& step_loads, const StageState& stage, Workspace& workspace,
              StageRate& rate) noexcept;

/// Computes the rate at a stage if the modes are not a complete set for point masses. E_kin is the kinetic
/// energy:
///   w = (I(q) - C C^T / M)^-1 (H_B - C p)   (THEORY 12.37)
///   q' = p - C^T w / M   (THEORY 12.38)
///   M p_l' = dE_kin/dq_l - M omega_l^2 q_l - 2 M decay_l q_l' + Q_l   (THEORY 12.39)
/// Here C_l = sum_i m_i V_i x b_il is the angular momentum per rate of coordinate l   (THEORY 12.35, 12.49).
void evaluate_incomplete(const StepLoads& step_loads, const StageState& stage, Workspace& workspace,
                         StageRate& rate) noexcept;

/// Computes the rate at a stage for a complete set of modes with bodies that turn by any angle
/// (THEORY 12.84 to 12.92).
void evaluate_turning(const StepLoads& step_loads, const StageState& stage, Workspace& workspace,
                      StageRate& rate) noexcept;

/// Takes the loads on massless points from those of a stage. Overwrites w.force.
void load_massless(const StepLoads& step_loads, const StageState& stage, CoupledWorkspace& w) noexcept;
/// Finds the rotations of joints without inertia and the massless points at the displacements w.V and the
/// bodies' rotations in w.bodies. If they are not found, the rates that follow are NaN. \pre load_massless()
/// was called, and if there are bodies, their displacements are set
void relax_links(const StepPlan& plan, const double* q, CoupledWorkspace& w) noexcept;
/// Adds to w.force and w.linear the forces on points of links at true geometry and of the linear links, and
/// puts into w.Q the work of the moments that joints still carry.  \pre relax_links() was called
void add_links(const StepPlan& plan, CoupledWorkspace& w) noexcept;
/// Adds the moments of joints, which add_links() left in w.Q, to the rates and to Q.
void add_link_moments(const StepPlan& plan, const CoupledWorkspace& w, StageRate& rate) noexcept;

/// Returns the angular momentum H_B of a motion, computed from tables. On entry p holds q', and on return p
/// holds the elastic momenta divided by the mass:
///   H_B = I(q) w + C q'   (THEORY 12.34),   p = q' + C^T w / M   (THEORY 12.33)
Vec3 momenta_by_tables(const StepPlan& plan, const Vec3& w_B, const double* q, const double* q_dot,
                       double* p) noexcept;

/// Adds to rate_p and Q the loads that the acceleration a = F / M of the whole body causes on bodies with an
/// offset d:
///   Q_l -= m theta_l . (d x (a x theta) + (theta x d) x a) / 2   (THEORY 12.55)
/// \pre rate.force_W is set
void add_offset_loads(const StepPlan& plan, const StageState& stage, StageRate& rate) noexcept;

/// Returns the momentum of the wheels, sum_w h_w a_theta [N m s], body axes. a_theta is the axis a of a
/// wheel, rotated with its body by theta:
///   a_theta = a + theta x a + theta x (theta x a) / 2   (THEORY 16.27, 16.29)
Vec3 rotated_wheel_momentum(const StepPlan& plan, std::span<const double> momentum, const double* q) noexcept;
/// Returns the contribution of the wheels to twice the kinetic energy [J], 1/2 sum_w h_w theta' . (a_w x
/// theta) (THEORY 16.32).
double wheel_energy(const StepPlan& plan, std::span<const double> momentum, const double* q,
                    const double* q_dot) noexcept;
/// Adds sign times the contribution of the wheels to the elastic momenta. The contribution follows from the
/// Lagrangian of a wheel, h_w (w . a_theta + a . (theta' - theta x theta' / 2)) (THEORY 16.28) minus a total
/// derivative:
///   p_l += sign h_w theta_l . (a_w x theta) / (2 M) [m/s] (num_padded)   (THEORY 16.30)
void add_wheel_momenta(const StepPlan& plan, std::span<const double> momentum, const double* q, double sign,
                       double* p) noexcept;
/// Adds the generalized forces of the wheels to Q [N] (num_padded). w is the angular velocity of the frame,
/// and tau_w the torque of the motor on a wheel:
///   Q_l += theta_l . (h_w (a x w + ((theta x a) x w + a x (w x theta) - theta' x a) / 2) - tau_w a)
/// (THEORY 16.31)
void add_wheel_forces(const StepLoads& step_loads, const StageState& stage, const Vec3& w,
                      const double* q_dot, double* Q) noexcept;
/// Returns the rate of rotated_wheel_momentum [N m]. Adds to Q [N] the mass M times the rate of the term that
/// add_wheel_momenta adds (THEORY 16.29, 16.30).
Vec3 add_wheel_rates(const StepLoads& step_loads, const StageState& stage, const double* q_dot,
                     double* Q) noexcept;

/// Sets w.force to the loads on points and particles: the loads of histories and commands, and for each
/// follower the additional force A theta x f (THEORY 8.25).
void gather_forces(const StepLoads& step_loads, const StageState& stage, CoupledWorkspace& w) noexcept;

/// Adds the loads on the modes that are not sums over points: those of fields, dashpots and feedback, and
/// those of the geometric stiffness due to followers. Call this function after rate holds the sums over
/// points.
void add_modal_loads(const StepLoads& step_loads, const StageState& stage, Workspace& workspace,
                     StageRate& rate) noexcept;

/// Returns the matrix that solve_for_spin needs for an inertia J. For a collinear body, which has no spin
/// about its line, the matrix contains the two equations normal to the line and a third equation that makes
/// the matrix regular.
Mat3 spin_matrix(const StepPlan& plan, const Mat3& J) noexcept;
/// Returns J^-1 b. For a collinear body, returns the solution normal to the line of the body.
/// \param matrix  result of spin_matrix for J
Vec3 solve_for_spin(const StepPlan& plan, const Mat3& matrix, const Vec3& b) noexcept;

}  // namespace freeflex
