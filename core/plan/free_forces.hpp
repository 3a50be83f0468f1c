// Forces linear in the motion that act on it when it is free: what couples the modes   (THEORY X77).
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/step/plan.hpp"

namespace freeflex {

/// Coupling of the modes, and of the body's angular velocity where wheels couple it with them: columns are
/// the modes of the plan, then the body's principal axes, scaled so that each has the mass of the body.
struct FreeForces {
  Eigen::MatrixXd out;             // [1/kg] per unit of force, (forces x (n + num_body))
  Eigen::MatrixXd by_q, by_q_dot;  // likewise
  // those that a force acts on and that move one, ascending: others keep their own eigenvalues
  std::vector<std::int32_t> modes;
  Eigen::Index num_body = 0;  // axes of the body: 0 unless wheels couple it with the modes
};

/// Returns true where the step has gyroscopic forces of wheels between modes: on the coupled rungs, of wheels
/// that turn at the start.
bool has_gyroscopic_forces(const Plan& plan);

/// Returns the built-in loads that follow the elastic motion, as indices into Plan::histories: the constant
/// ones, or those whose amplitude varies.
std::vector<std::size_t> follower_loads(const Plan& plan, bool is_constant);

/// Returns the forces of dashpots, feedback and, unless left out, constant followers and wheels.
/// \pre unknown_coupling(plan) is empty
FreeForces free_forces(const Plan& plan, bool has_followers = true);

/// Returns why the linear forces of a plan are not known, in words; empty where they are.
std::string unknown_coupling(const Plan& plan);

}  // namespace freeflex
