// Loads that depend on the elastic motion, and the step of modes that dashpots and feedback couple.
#pragma once

#include <cstdint>
#include <span>

#include "core/step/linear/kernels.hpp"
#include "core/step/rigid/frame.hpp"

namespace freeflex {

/// Returns true if followers, torques in local axes or feedback exert a load on the body that depends on the
/// elastic motion.
bool has_dependent_loads(const StepPlan& plan) noexcept;

/// Holds the resultant force and torque, in body axes, of the loads that depend on the elastic motion.
struct DependentLoad {
  Vec3 force_B{};   // [N]
  Vec3 torque_B{};  // [N m] about the centre of mass
};
void add(const DependentLoad& dependent, RigidLoad& load) noexcept;

/// Holds resultant forces and torques that are linear in time over one step.
struct DependentStep {
  DependentLoad start, end;
};
/// Adds these resultants to the loads over a step.
/// \pre loads.later is set
void add(const DependentStep& dependent, RigidLoads& loads) noexcept;

/// Adds to Q the forces of geometric stiffness by a load: Q_l -= sum_k c_k sum_u E_k,lu q_u [N]
/// (THEORY 8.49). The coefficients c_k are the amplitude, times R_WB if a force or torque is in world axes.
void stiffen(const PlanHistory& history, double amplitude, const Mat3& R_WB, const double* q,
             double* Q) noexcept;

/// Adds to Q the forces of geometric stiffness by the commands of a pattern [N]   (THEORY 8.49). Each
/// component that acts costs one product with a matrix over the stiffened modes. \pre the rung has a
/// stiffness by commands only if it is coupled
void stiffen_by_commands(const StepPlan& plan, const LoadPattern& commands, const Mat3& R_WB, const double* q,
                         double* Q) noexcept;

/// The energy of the geometric stiffness by fields, and its derivative with respect to the angular momentum.
struct FieldStiffness {
  Vec3 w_B{};           // [rad/s] change of the angular velocity of the frame, body axes   (THEORY 8.52)
  double energy = 0.0;  // [J] sum_k c_k q^T E_k q / 2
};
/// Adds to Q the forces of geometric stiffness by the fields of the spin and the attractor   (THEORY 8.49).
/// \param H_B  [kg m^2/s] angular momentum with the wheels, body axes
/// \param wheels  [N m s] (num_wheels) momenta of the wheels
/// \param Q    nullptr: the forces are not wanted
FieldStiffness stiffen_by_fields(const StepPlan& plan, const Mat3& R_WB, const Vec3& H_B,
                                 std::span<const double> wheels, const Vec3& p_W, const double* q,
                                 double* Q) noexcept;

/// Returns the load on the body that followers add to their loads in body axes, because they rotate with
/// their points. Adds its generalized forces to Q, and those of geometric stiffness. A is the amplitude,
/// theta the elastic rotation at the point, and f or T the force or torque at amplitude 1:
///   force: A theta x f, moment A r x (theta x f), Q_l += A b_l . (theta x f)   (THEORY 8.24, 8.25)
///   torque: A theta x T, Q_l += A theta_l . (theta x T)   (THEORY 16.14)
DependentLoad follow(const StepPlan& plan, const double* q, std::int64_t tick, bool at_end,
                     double* Q) noexcept;

/// Returns the force of feedback on the body at one time, f = F_q q + F_v q' + F_Q Q   (THEORY 8.28). The
/// propagator already includes the generalized forces of feedback.
/// \param Q  [N] (num_padded) generalized forces of the loads, including those of followers
DependentLoad feed_back(const StepPlan& plan, const double* q, const double* q_dot, const double* Q) noexcept;
/// Returns the moment of feedback on the displacements of its points, sum V_j x f [N m], body axes. With that
/// of feed_back it is the moment with deformed arms   (THEORY 12.12).
Vec3 feedback_on_displaced_points(const StepPlan& plan, const double* q, const double* q_dot,
                                  const double* Q) noexcept;

/// Returns the load of feedback on the body over a step that starts at q and q' under generalized forces that
/// go linearly from Q^0 to Q^1. The returned load is linear in time. Its impulse J and the integral K of the
/// impulse are exact, however fast the force of feedback changes. The load is zero unless the path is kExact:
///   F^0 = 6 K / h^2 - 2 J / h,   F^1 = 4 J / h - 6 K / h^2   (THEORY 8.37)
DependentStep feed_back_over_step(const StepPlan& plan, const double* q, const double* q_dot,
                                  const double* Q0, const double* Q1) noexcept;

/// Adds to Q the generalized forces of dashpots and feedback. Accelerations and forces of rigid links are
/// computed from this sum:
///   Q += B^T f - R^T R q',   B the mode-shape rows of the points on which feedback acts   (THEORY 8.29)
void add_modal_coupling_forces(const StepPlan& plan, const double* q, const double* q_dot, Array& scratch,
                               double* Q) noexcept;

/// Applies one splitting impulse of dashpots and feedback. q_dot_out may be the same array as q_dot:
///   q_dot_out = q' + (h / 2) U phi_1((h / 2) W_v U) (W_v q' + W_q q)   (THEORY 8.40)
/// Returns the load of feedback on the body, (2 / h) J, which is constant and has the impulse J over half a
/// step   (THEORY 8.41).
DependentLoad apply_half_impulse(const StepPlan& plan, const double* q, const double* q_dot, Array& scratch,
                                 double* q_dot_out) noexcept;

/// Advances the coupled modes by one period, and overwrites the results of the single-mode propagator for
/// these modes:
///   y^1 = phi_0 y^0 + h phi_1 (0, E Q^0) + h phi_2 (0, E (Q^1 - Q^0)),   y = (q, q')   (THEORY 8.34)
/// Returns true if the result is finite.
bool advance_coupled_modes(const StepPlan& plan, const ModalState& from, const double* Q0, const double* Q1,
                           Array& scratch, const ModalResult& to) noexcept;

/// Advances every mode by one period under a load linear from Q^0 to Q^1, including dashpots and feedback.
/// Modes that are not coupled are advanced one by one (THEORY 6.1). Coupled modes are advanced by their
/// matrix exponential (THEORY 8.34), or one by one between two splitting impulses (THEORY 8.38). Returns true
/// if the result is finite.
/// \param q_dot_after_impulse  [m/s] (num_padded) scratch, used if the path is kSplit
/// \param last_impulse  if the path is kSplit, set to the load of feedback on the body over the second half
/// of the step
bool advance_linear(const StepPlan& plan, const ModalState& from, const double* Q0, const double* Q1,
                    Array& q_dot_after_impulse, Array& scratch, const ModalResult& to,
                    DependentLoad& last_impulse) noexcept;

/// Returns the number of doubles for which the argument `scratch` of the functions above must have room.
std::size_t modal_coupling_scratch_size(const StepPlan& plan) noexcept;

}  // namespace freeflex
