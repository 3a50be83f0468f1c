// The motion of the points on a plan that integrates them, and what its method keeps of the past.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/step/array.hpp"
#include "core/step/plan/points.hpp"
#include "core/step/points/multistep.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

/// Holds the motion of the points at a tick, in axes that do not rotate, relative to the centre of mass; the
/// last point is the centre of mass itself, in world axes. Empty on plans that integrate modes.
struct PointsAtTick {
  Array x, v, a;        // [m], [m/s], [m/s^2] (3 (num_points + 1) and padding)
  bool is_set = false;  // false: the motion of the points is that of the frame and the modes
  bool operator==(const PointsAtTick&) const = default;
};

/// Holds the motion of the points up to the end of the last step, and the past that the next step reads. All
/// arrays have the size of PointsAtTick. Empty on plans that integrate modes.
struct PointHistory {
  Array x, x_low;  // [m] positions at the end of the last step, with their rounding errors
  // at the end of the last extrapolated step: displacement since the loads changed [m], velocity [m/s] and
  // acceleration [m/s^2]
  Array d, v, a;
  // the same at the nodes, and the number of extrapolated steps since the last one
  std::array<Array, kStartNodes> node_d, node_v, node_a;
  std::int32_t num_nodes = 0, steps_since_node = 0;  // no node: the motion is that of the frame and the modes
  bool is_multistep = false;                         // true: the last step was one of the multistep method
  // differences of positions [m] and accelerations [m/s^2] over the last steps, rings with `earliest` first
  std::array<Array, kPastSteps> changes, accelerations;
  std::int32_t earliest = 0;
  std::int32_t ticks_left = 0;        // number of ticks by which the last step is ahead of the motion
  std::int64_t steps_made = 0;        // of the multistep method
  Quat attitude{1.0, 0.0, 0.0, 0.0};  // of the frame at most some steps ago
  Array load;                         // [m/s^2] accelerations by the loads, if these are constant
  bool has_constant_loads = true;     // false: the loads are found at each evaluation of the springs
  // true: the steps did not resolve the motion, or the last one failed, so the next tick begins anew
  bool begins_anew = false;
};
PointsAtTick make_points_at_tick(const PlanPoints& plan);
PointHistory make_point_history(const PlanPoints& plan);

/// Holds scratch memory of a step of the points.
struct PointsWorkspace {
  // the motion at the end of a step, swapped with that of the history once it is known to be finite
  Array x, x_low, d, v, a;
  Array other_x, other_low;  // [m] positions at every other step
  Array start_v, start_a;    // [m/s], [m/s^2] at the start of a tick of many steps
  // The first kPastSteps steps of a tick overwrite values of earlier ticks. These arrays hold copies of the
  // overwritten values, from which a tick that fails restores them. Later steps write to the last array
  std::vector<Array> changes, accelerations;
  ExtrapolationWorkspace extrapolation;
  Array force;                // [N] (4 (num_points + 1))
  Array load;                 // [m/s^2] accelerations by loads at one time
  std::vector<Vec3> forces;   // [N] (num_points) of the loads
  std::vector<Vec3> x_B;      // [m] (num_points) positions in the axes of the frame
  std::vector<Vec3> u, rate;  // [m], [m/s] (num_points) displacements and velocities in these axes
};
PointsWorkspace make_points_workspace(const PlanPoints& plan);

/// Returns the size of arrays over points: three numbers for each point and for the centre of mass, and at
/// least one more, because vectors of four numbers are loaded at each point.
inline std::size_t size_over_points(const PlanPoints& plan) noexcept {
  return plan.inverse_mass.empty() ? 0 : pad(3 * plan.inverse_mass.size() + 1);
}

/// Returns the arrays of a ring, the earliest first.
inline Past past_of(const std::array<Array, kPastSteps>& ring, std::int32_t earliest) noexcept {
  Past past;
  for (std::size_t k = 0; k < kPastSteps; ++k) past[k] = ring[(index(earliest) + k) % kPastSteps].data();
  return past;
}

/// Returns the vector of a point in an array over points.
inline Vec3 of_point(const double* values, std::size_t point) noexcept {
  return {values[3 * point], values[3 * point + 1], values[3 * point + 2]};
}

}  // namespace freeflex
