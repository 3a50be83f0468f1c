// The part of a plan that integrates the motion of the points in place of that of the modes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/step/array.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

/// Numbers of the multistep method (THEORY 12.128): differences of positions and accelerations that a step
/// reads, and positions that start it.
inline constexpr std::size_t kPastSteps = 11, kStartNodes = 12;

/// Holds how one of the positions that start the multistep method follows from the motion at four nodes, by
/// Hermite's interpolation   (THEORY 12.131).
struct PlanStartValue {
  std::int32_t first_node = 0;  // the first of the four nodes
  std::int32_t node = -1;       // the node at which the position is; -1: none
  // [-], [s], [s^2] of the positions, velocities and accelerations at the four nodes
  std::array<double, 12> weights{};
};

/// Holds what integrates the motion of the points in axes that do not rotate, relative to the centre of mass
/// (THEORY 12.127). The arrays over the components of points have three numbers for each point, then three
/// for the centre of mass, and padding.
struct PlanPoints {
  // Number of steps in a tick, and number of ticks in a step; one of the two is 1. 0 steps: the plan
  // integrates its modes
  std::int32_t steps = 0, ticks = 1;
  // after a change of the loads, a tick has this number of extrapolated steps of so many columns
  // (THEORY 12.130)
  std::int32_t pieces = 1, columns = 2;
  double accuracy = 0.0;  // [-] of the fastest vibration after 1000 rad; it determined the steps
  // springs and bars, padded with springs of no stiffness to a multiple of four
  std::vector<std::int32_t> first, second;   // indices of the two points that each spring joins
  Array stiffness, inverse_square, tension;  // [N/m] D; [1/m^2] 1 / L^2; [N] D L
  // [N s/m] c, empty if nothing is damped. Steps are then extrapolated, by the midpoint rule (THEORY 12.137)
  Array damping;
  Array inverse_mass;  // [1/kg] (num_points + 1), 0 for the centre of mass
  Array share;         // [-] m / M of each component, 0 for the centre of mass and padding
  // [m/s^2] rms over the mass of the differences of order 10 of accelerations that rounding errors cause, and
  // [-] their largest ratio to accelerations that the steps resolve   (THEORY 12.135)
  double noise = 0.0, resolved = 0.0;
  // the positions that start the multistep method, the earliest first, from nodes that are `spacing`
  // extrapolated steps apart   (THEORY 12.131)
  std::vector<PlanStartValue> starts;
  std::int32_t spacing = 1, num_nodes = 0;
  // [-] (3 x ticks x kPastSteps) weights of the accelerations, the latest first, in position over h^2,
  // velocity over h and acceleration at the ticks of the last step   (THEORY 12.132)
  Array weights;
};

}  // namespace freeflex
