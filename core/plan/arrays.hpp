// Conversion of Eigen's vectors and matrices to the arrays of a plan.
#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "core/plan.hpp"

namespace freeflex {

inline Vec3 to_array(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// Returns the entries in row-major order.
inline Mat3 to_array(const Eigen::Matrix3d& m) {
  return {m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)};
}

/// Returns a row of a matrix, or an empty row if the matrix has no columns. For such a matrix, Eigen's row()
/// adds an offset to a null pointer.
inline Eigen::RowVectorXd row_of(const Eigen::MatrixXd& matrix, Eigen::Index row) {
  return matrix.cols() == 0 ? Eigen::RowVectorXd(0) : Eigen::RowVectorXd(matrix.row(row));
}

/// Returns an array (num_padded) that holds the values of the modes, then the values of the constraint shapes
/// if there are any. Each of the two parts is padded with zeros.
inline Array padded(const StepPlan& plan, const Eigen::Ref<const Eigen::VectorXd>& values) {
  Array all(index(plan.num_padded), 0.0);
  const Eigen::Index num_modes = std::min<Eigen::Index>(values.size(), plan.num_elastic);
  std::copy(values.begin(), values.begin() + num_modes, all.begin());
  std::copy(values.begin() + num_modes, values.end(), all.begin() + plan.num_moving);
  return all;
}

/// Appends values over modes and constraint shapes to `rows` as one padded row.
inline void append_row(const StepPlan& plan, const Eigen::RowVectorXd& values, Array& rows) {
  const Array row = padded(plan, values.transpose());
  rows.insert(rows.end(), row.begin(), row.end());
}

/// Returns the number of blocks of three rows that the points and particles of the plan have. This is the
/// index of the next block that is appended.
inline std::int32_t num_row_blocks(const StepPlan& plan) {
  const auto count = std::count_if(plan.points.begin(), plan.points.end(),
                                   [](const PlanPoint& point) { return point.row >= 0; });
  return static_cast<std::int32_t>(count + static_cast<std::ptrdiff_t>(plan.particles.all.size()));
}

}  // namespace freeflex
