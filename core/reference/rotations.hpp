// Finite rotations of the true-geometry reference: vectors, their matrices and tangents   (THEORY X150).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace freeflex {

/// [v x], the matrix of `v x`.
inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v[2], v[1], v[2], 0.0, -v[0], -v[1], v[0], 0.0;
  return m;
}

/// Unit quaternion of a rotation vector [rad].
inline Eigen::Quaterniond quaternion_of(const Eigen::Vector3d& turn) {
  const double half = 0.5 * turn.norm();
  const double share = half < 1e-8 ? 0.5 : 0.5 * std::sin(half) / half;
  return {std::cos(half), share * turn[0], share * turn[1], share * turn[2]};
}

/// Angle over its sine from both, 1 at zero; angles up to pi.
inline double angle_over_sine(double sine, double cosine) {
  return sine < 1e-9 && cosine > 0.0 ? 1.0 : std::atan2(sine, cosine) / sine;
}

/// Rotation vector [rad] of a rotation matrix of less than half a turn.
inline Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& R) {
  const Eigen::Vector3d w = 0.5 * Eigen::Vector3d(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
  return angle_over_sine(w.norm(), 0.5 * (R.trace() - 1.0)) * w;
}

/// Spin of a rotation per rate of its vector, in the axes that the vector is given in, before the turn:
/// R' R^T = [T(v) v' x].
inline Eigen::Matrix3d spin_per_rate(const Eigen::Vector3d& v) {
  const double square = v.squaredNorm(), angle = std::sqrt(square);
  // series below: what it leaves out is under a rounding
  const bool is_small = angle < 1e-2;
  const double first =
      is_small ? 0.5 - square / 24.0 + square * square / 720.0 : (1.0 - std::cos(angle)) / square;
  const double second = is_small ? 1.0 / 6.0 - square / 120.0 + square * square / 5040.0
                                 : (angle - std::sin(angle)) / (square * angle);
  const Eigen::Matrix3d cross = cross_matrix(v);
  return Eigen::Matrix3d::Identity() + first * cross + second * cross * cross;
}

/// The smallest rotation that takes unit vector `from` to unit vector `to`, not its opposite.
inline Eigen::Matrix3d smallest_rotation(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Matrix3d cross = cross_matrix(from.cross(to));
  return Eigen::Matrix3d::Identity() + cross + cross * cross / (1.0 + from.dot(to));
}

}  // namespace freeflex
