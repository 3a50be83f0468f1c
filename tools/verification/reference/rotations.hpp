// The finite rotations of the true-geometry reference, as vectors, matrices and tangents   (THEORY 10.12).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace freeflex {

/// Returns [v x], the matrix of the cross product: [v x] a = v x a.
inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v[2], v[1], v[2], 0.0, -v[0], -v[1], v[0], 0.0;
  return m;
}

/// Returns the unit quaternion of a rotation vector [rad].
inline Eigen::Quaterniond quaternion_of(const Eigen::Vector3d& vector) {
  const double half = 0.5 * vector.norm();
  const double factor = half < 1e-8 ? 0.5 : 0.5 * std::sin(half) / half;
  return {std::cos(half), factor * vector[0], factor * vector[1], factor * vector[2]};
}

/// Returns the ratio of an angle in [0, pi] to its sine, computed from sine and cosine. The ratio is 1 at
/// angle 0.
inline double angle_over_sine(double sine, double cosine) {
  return sine < 1e-9 && cosine > 0.0 ? 1.0 : std::atan2(sine, cosine) / sine;
}

/// Returns the rotation vector [rad] of a rotation matrix whose angle is below pi.
inline Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& R) {
  const Eigen::Vector3d w = 0.5 * Eigen::Vector3d(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
  return angle_over_sine(w.norm(), 0.5 * (R.trace() - 1.0)) * w;
}

/// Returns T(v). This matrix maps the rate v' of a rotation vector v to the angular velocity of the rotation,
/// R' R^T = [T(v) v' x]. Rate and angular velocity are in the axes from which v rotates:
///   T(v) = 1 + (1 - cos a) / a^2 [v x] + (a - sin a) / a^3 [v x]^2,   a = |v|
inline Eigen::Matrix3d spin_per_rate(const Eigen::Vector3d& v) {
  const double square = v.squaredNorm(), angle = std::sqrt(square);
  // A series is used for small angles. The omitted terms are below rounding errors
  const bool is_small = angle < 1e-2;
  const double first =
      is_small ? 0.5 - square / 24.0 + square * square / 720.0 : (1.0 - std::cos(angle)) / square;
  const double second = is_small ? 1.0 / 6.0 - square / 120.0 + square * square / 5040.0
                                 : (angle - std::sin(angle)) / (square * angle);
  const Eigen::Matrix3d cross = cross_matrix(v);
  return Eigen::Matrix3d::Identity() + first * cross + second * cross * cross;
}

/// Returns the smallest rotation that takes unit vector `from` to unit vector `to`.  \pre to is not -from
inline Eigen::Matrix3d smallest_rotation(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Matrix3d cross = cross_matrix(from.cross(to));
  return Eigen::Matrix3d::Identity() + cross + cross * cross / (1.0 + from.dot(to));
}

}  // namespace freeflex
