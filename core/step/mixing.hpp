// Forces that follow the elastic motion, and modes that dashpots and feedback keep from being independent.
#pragma once

#include <cstdint>

#include "core/step/frame.hpp"
#include "core/step/kernels.hpp"

namespace freeflex {

/// True when a force on the body depends on the elastic motion: followers or feedback   (THEORY X73, X74).
bool has_dependent_loads(const Plan& plan) noexcept;

/// Resultant of the loads that depend on the elastic motion, body axes.
struct DependentLoad {
  Vec3 force_B{};   // [N]
  Vec3 torque_B{};  // [N m] about the centre of mass
};
void add(const DependentLoad& dependent, RigidLoad& load) noexcept;

/// Such loads over one step, linear in time.
struct DependentStep {
  DependentLoad start, end;
};
/// Adds them to the loads over a step.  \pre loads.later
void add(const DependentStep& dependent, StepLoads& loads) noexcept;

/// Takes from Q [N] what the internal forces of a load's followers add to the stiffness, amplitude * E q
/// (THEORY X145).
void stiffen(const PlanHistory& history, double amplitude, const double* q, double* Q) noexcept;

/// What followers add to the same forces in body axes, amplitude * theta x f; generalized forces go to Q
/// (X73).
DependentLoad follow(const Plan& plan, const double* q, std::int64_t tick, bool at_end, double* Q) noexcept;

/// Forces of feedback at an instant, f = F_q q + F_v q' + F_Q Q; their generalized forces are in the
/// propagator (X74). \param Q  [N] (num_padded) external generalized forces, followers among them
DependentLoad feed_back(const Plan& plan, const double* q, const double* q_dot, const double* Q) noexcept;

/// What feedback does to the body over a step from q, q' under Q^0 to Q^1, however fast the force changes:
/// the load linear in time with its exact impulse J and first moment K, 6 K / h^2 - 2 J / h at the start and
/// 4 J / h - 6 K / h^2 at the end   (X75). Nothing unless the path is kExact.
DependentStep feed_back_over_step(const Plan& plan, const double* q, const double* q_dot, const double* Q0,
                                  const double* Q1) noexcept;

/// Adds the generalized forces of dashpots and feedback, for accelerations and rigid links that are read out.
void add_mixing_forces(const Plan& plan, const double* q, const double* q_dot, Array& scratch,
                       double* Q) noexcept;

/// q_dot_out = q_dot + half a kick of dashpots and feedback, (h / 2) U phi_1((h / 2) W U) (W q' + W_q q)
/// (X76); the two may be one. Returns the force of feedback that has the kick's impulse in
/// half a step.
DependentLoad kick(const Plan& plan, const double* q, const double* q_dot, Array& scratch,
                   double* q_dot_out) noexcept;

/// Mixed modes one period later, y^1 = phi_0 y + h phi_1 (0, E Q^0) + h phi_2 (0, E (Q^1 - Q^0)), over what
/// the propagator of single modes left for them   (X75). True when finite.
bool advance_mixed(const Plan& plan, const ModalState& from, const double* Q0, const double* Q1,
                   Array& scratch, const ModalResult& to) noexcept;

/// Every mode one period on under a load linear from Q^0 to Q^1, with its dashpots and feedback (X10; X75
/// where they are exact, X76 where they are split). True when finite.  \param kicked  [m/s] (num_padded)
/// where the path is kSplit  \param last_kick  of feedback over the second half, where modes are split
bool advance_linear(const Plan& plan, const ModalState& from, const double* Q0, const double* Q1,
                    Array& kicked, Array& scratch, const ModalResult& to, DependentLoad& last_kick) noexcept;

/// Doubles that scratch needs, in all of these.
std::size_t mixing_scratch_size(const Plan& plan) noexcept;

}  // namespace freeflex
