// The factor of the stiffness over the rotations of joints without inertia.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "core/step/plan/links.hpp"

namespace freeflex {

/// Writes the factor K_tt = L D L^T to the plan, and the orthonormal rotations that strain no link
/// (THEORY 12.73, 12.76).
/// \param K  [N m] K_tt. It may hold zeros where a factor of the deformed structure has entries
/// \param sides  (num_rotations x n)
/// \return  K_tt^-1 sides, without rotations that strain no link
Eigen::MatrixXd factor_joints(const Eigen::SparseMatrix<double>& K, const Eigen::MatrixXd& sides,
                              PlanJoints& joints);

}  // namespace freeflex
