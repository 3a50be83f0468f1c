// Forces that are linear in the free motion and couple the modes   (THEORY 8.42, 8.46 to 8.48).
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/plan.hpp"

namespace freeflex {

/// Holds the forces that couple the modes. The body's angular velocity is included if wheels couple it with
/// the modes. The columns are the modes of the plan, then the principal axes of the body, scaled so that the
/// generalized mass of each is the mass of the body.
struct FreeForces {
  Eigen::MatrixXd out;             // [1/kg] acceleration per unit of force (forces x (n + num_body))
  Eigen::MatrixXd by_q, by_q_dot;  // [N/m], [N s/m] forces per q and per q_dot, of the same size
  // The modes on which a force acts or whose motion changes a force, in ascending order. The other modes keep
  // their own eigenvalues.
  std::vector<std::int32_t> modes;
  Eigen::Index num_body = 0;  // number of axes of the body: 0 unless wheels couple it with the modes
};

/// Returns true if the step has gyroscopic forces between modes. The step has such forces on the coupled
/// rungs if a wheel has momentum at the start.
bool has_gyroscopic_forces(const StepPlan& plan);

/// Returns the built-in loads that follow the elastic motion, as indices into StepPlan::histories. If
/// is_constant is true, returns the loads of constant amplitude, otherwise the loads of varying amplitude.
std::vector<std::size_t> follower_loads(const StepPlan& plan, bool is_constant);

/// Returns the forces of dashpots, feedback and wheels, and those of constant followers if has_followers is
/// true.
/// \pre unknown_coupling(plan) returns an empty text
FreeForces free_forces(const StepPlan& plan, bool has_followers = true);

/// Returns why the linear forces of a plan are not known. If the forces are known, the text is empty.
std::string unknown_coupling(const StepPlan& plan);

}  // namespace freeflex
