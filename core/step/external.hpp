// Everything that loads the body during one step: commands, constant over it, and built-in histories.
#pragma once

#include <cstdint>
#include <span>

#include "core/step/frame.hpp"

namespace freeflex {

/// Where in a step: the right limit of its start, its middle, the left limit of its end.
enum class Instant { kStart, kMiddle, kEnd };

struct External {
  const Plan& plan;
  const LoadPattern& commands;
  std::int64_t tick;      // since the epoch began
  std::int32_t part = 0;  // of the step, where the plan divides it; instants are those of that part   (X100)

  double amplitude(const PlanHistory& history, Instant instant) const noexcept;

  /// True when a history jumps at the start of the step.
  bool jumps() const noexcept;

  /// What the loads do to the body as a whole, below the coupled rungs.
  StepLoads rigid() const noexcept;

  /// [s] of the part.
  double period() const noexcept { return plan.period / plan.coupled.num_parts; }
  /// Torque of the motor of a wheel [N m]; over the part, at its share s, start + s slope + s^2 bend, the
  /// parabola through start, middle and end; and what its momentum gains [N m s]   (THEORY X167).
  double wheel_torque(std::size_t wheel, Instant instant) const noexcept;
  struct TorqueOverStep {
    double start, slope, bend;
  };
  TorqueOverStep wheel_torques(std::size_t wheel) const noexcept;
  double wheel_gain(std::size_t wheel) const noexcept;
  /// Momentum of the wheels over the step.  \param momentum  [N m s] (num_wheels) at its start
  WheelMomentum wheels(std::span<const double> momentum) const noexcept;
  /// Of one wheel [N m s].
  double wheel_momentum(std::size_t wheel, double at_start, Instant instant) const noexcept;

  /// Generalized forces Q [N] (num_padded), below the coupled rungs; what depends on the elastic motion
  /// apart.  \param momentum  [N m s] (num_wheels) of wheels at the start of the step
  void generalized(Instant instant, const Frame& frame, const Mat3& R_WB, std::span<const double> momentum,
                   Array& Q) const noexcept;

  /// Forces on the points [N] (num_points), body axes, on coupled rungs; what depends on the elastic motion
  /// apart.
  void on_points(Instant instant, const Mat3& R_WB, std::span<Vec3> forces) const noexcept;
};

}  // namespace freeflex
