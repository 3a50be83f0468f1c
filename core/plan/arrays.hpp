// Eigen's vectors and matrices as the plan keeps them.
#pragma once

#include <Eigen/Core>

#include "core/step/plan.hpp"

namespace freeflex {

inline Vec3 to_array(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// Row-major.
inline Mat3 to_array(const Eigen::Matrix3d& m) {
  return {m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)};
}

}  // namespace freeflex
