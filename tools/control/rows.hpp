// Vectors and rows of a plan as Eigen's matrices.
#pragma once

#include <Eigen/Core>

#include "core/plan.hpp"
#include "core/step/linear/kernels.hpp"

namespace freeflex::control {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

inline Eigen::Vector3d vector_of(const Vec3& v) { return {v[0], v[1], v[2]}; }
inline Eigen::Matrix3d matrix_of(const Mat3& m) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(m.data());
}
/// Returns the matrix of v x.
inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  return (Eigen::Matrix3d() << 0.0, -v[2], v[1], v[2], 0.0, -v[0], -v[1], v[0], 0.0).finished();
}
/// Returns the displacement of a point, or the rotation of a body, by each coordinate (3 x num_padded).
inline Eigen::MatrixXd shapes_of_point(const Plan& plan, int row) {
  return Eigen::Map<const RowMatrix>(point_rows(plan, row), 3, plan.num_padded);
}
inline Eigen::MatrixXd rotations_of_body(const Plan& plan, int attitude) {
  return Eigen::Map<const RowMatrix>(rotation_rows(plan, attitude), 3, plan.num_padded);
}

}  // namespace freeflex::control
