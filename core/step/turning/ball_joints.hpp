// Ball joints between rigid bodies that turn by any angle: constraints on a complete set of modes of the
// bodies without the joints   (THEORY 12.123 to 12.126).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/step/array.hpp"
#include "core/step/plan.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

struct CoupledWorkspace;
struct StageRate;
struct StageState;

/// Holds a point that two bodies share.
struct BallJoint {
  std::array<std::int32_t, 2> bodies{-1, -1};  // the first one is that of PlanTurning::of_points
  std::int32_t point = -1;
};
/// Returns the ball joints of a plan, in the order of PlanTurning::points, where the point of a joint is in
/// the lists of both bodies.
std::vector<BallJoint> find_ball_joints(const StepPlan& plan);

/// Holds scratch memory for ball joints. Empty without them.
struct BallJoints {
  std::vector<BallJoint> all;
  double size = 0.0;  // [m] largest distance of a point from the centre of mass
  // [m], [m/s] (num_padded) coordinates and momenta over the mass, of a stage, with those of the joints
  Array q, p;
  // [m/s^2] (num_padded) rate of p by forces on points and bodies, which add_joint_forces() replaces by the
  // rate of p by everything else except joints
  Array mode_rate;
  std::vector<double> matrix;  // (3J x 3J) row-major; its factor after factor_of_joints()
  // (3J x 3J) rates of the gaps by the rates of their coordinates, in the rest shape
  std::vector<double> at_rest;
  std::vector<double> right;         // (3J) right side of a linear system, then its solution
  std::vector<std::int32_t> pivots;  // (3J) rows that factor_dense() exchanged
  std::int32_t widest = 0;           // index into `all` of the joint with the widest gap
  bool is_open = false;              // true: a joint was not closed at the last step
  bool empty() const noexcept { return all.empty(); }
};
/// Returns scratch memory for the ball joints of a plan.
BallJoints make_ball_joints(const StepPlan& plan);

/// Sets the coordinates of the joints so that they are closed in the initial shape, and their rates so that
/// they stay closed   (THEORY 12.124). Does nothing if this is so already, otherwise allocates. They are NaN
/// if the joints cannot be closed. \param q, q_dot  [m], [m/s] (num_padded)
void close_at_start(const StepPlan& plan, double* q, double* q_dot);

/// Takes the coordinates of a stage, and closes the joints from those of the last stage   (THEORY 12.124).
void close_joints(const StepPlan& plan, StageState& stage, CoupledWorkspace& w) noexcept;
/// Adds to the momenta of a stage those of the joints, at which they stay closed   (THEORY 12.125).
/// \param alpha  [rad/s] that of the momenta without the joints  \pre w.frame, and W and S of bodies, are set
void add_joint_momenta(const StepPlan& plan, const Vec3& alpha, CoupledWorkspace& w) noexcept;
/// Adds the forces of the joints to the rates, after all other forces   (THEORY 12.126).
/// \pre nothing is damped
void add_joint_forces(const StepPlan& plan, CoupledWorkspace& w, StageRate& rate) noexcept;

}  // namespace freeflex
