// The loads of one step are the loads of commands and the loads of built-in histories. The loads of commands
// are constant over the step, unless the step is longer than a tick.
#pragma once

#include <cstdint>
#include <span>

#include "core/step/rigid/frame.hpp"

namespace freeflex {

/// Lists the times in a step at which loads are evaluated. kStart is the right limit at the start of the
/// step, and kEnd the left limit at its end.
enum class StageTime { kStart, kMiddle, kEnd };

/// Adds amplitude times the resultant and the moment of a pattern (THEORY 8.1, 8.3, 8.7). On coupled rungs a
/// pattern holds its loads in body axes without their resultant, so this function computes the resultant.
void add_resultant(const StepPlan& plan, const LoadPattern& pattern, double amplitude,
                   RigidLoad& load) noexcept;

/// Holds the loads of one step. If the plan divides the step, these are the loads of one substep.
struct StepLoads {
  const StepPlan& plan;
  const LoadPattern& slots;  // sum of the loads in slots
  std::int64_t tick;         // index of the step since the epoch began
  std::int32_t substep = 0;  // index of the substep in the step; stage times are those of the substep
  // loads in place of those of slots and of histories; nullptr: none
  // \pre the plan does not divide the step
  const LoadsOverStep* over = nullptr;

  /// Returns the loads of commands at a stage time.
  const LoadPattern& commands(StageTime stage_time) const noexcept {
    return over == nullptr ? slots : over->commands[static_cast<std::size_t>(stage_time)];
  }

  /// Returns the amplitude of a history at a stage time [-].
  double amplitude(const PlanHistory& history, StageTime stage_time) const noexcept;

  /// Returns true if a history jumps at the start of the step.
  bool jumps() const noexcept;
  /// Returns true if the slope of a history jumps at the start of the step.
  bool bends() const noexcept;

  /// Returns the resultants and moments of the loads on the rigid body, without followers and feedback.
  RigidLoads rigid() const noexcept;

  /// Returns the length of the substep [s].
  double period() const noexcept { return plan.period / plan.coupled.num_substeps; }
  /// Returns the torque that the motor exerts on a wheel [N m].
  double wheel_torque(std::size_t wheel, StageTime stage_time) const noexcept;
  /// Holds the torque of a motor over the substep as the parabola start + s slope + s^2 bend through the
  /// torques at start, middle and end. Here s runs from 0 to 1   (THEORY 16.21).
  struct TorqueOverStep {
    double start, slope, bend;
  };
  TorqueOverStep wheel_torques(std::size_t wheel) const noexcept;
  /// Returns the change of the momentum of a wheel over the substep [N m s], from h_w' = tau_w
  /// (THEORY 16.21).
  double wheel_gain(std::size_t wheel) const noexcept;
  /// Returns the momentum of all wheels over the substep.
  /// \param momentum  [N m s] (num_wheels) momenta of the wheels at the start of the substep
  WheelMomentum wheels(std::span<const double> momentum) const noexcept;
  /// Returns the momentum of one wheel at a stage time [N m s], from h_w' = tau_w   (THEORY 16.21).
  double wheel_momentum(std::size_t wheel, double at_start, StageTime stage_time) const noexcept;

  /// Below the coupled rungs, computes the generalized forces Q [N] (num_padded) without the forces of
  /// followers, dashpots and feedback.
  /// \param momentum  [N m s] (num_wheels) momenta of the wheels at the start of the step
  void generalized(StageTime stage_time, const Frame& frame, const Mat3& R_WB,
                   std::span<const double> momentum, Array& Q) const noexcept;

  /// On the coupled rungs, computes the forces on the points [N] (num_points), body axes, without the forces
  /// of followers, dashpots and feedback.
  /// \param x  [m] present positions of points and particles for the torques on groups; empty: those at rest
  void on_points(StageTime stage_time, const Mat3& R_WB, std::span<const Vec3> x,
                 std::span<Vec3> forces) const noexcept;
  /// Returns whether a command or a built-in load has a torque on a group.
  bool turn_groups() const noexcept;
};

}  // namespace freeflex
