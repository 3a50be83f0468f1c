// Links given by a stiffness matrix, which turn as one piece.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/step/array.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

inline constexpr std::size_t kMostMatrixPoints = 256;

/// Holds the stiffness of a matrix link over the displacements [m] of its points, or over a displacement and
/// a rotation [rad] of each.
struct MatrixConstants {
  bool has_rotations = false;
  // (n x n padded to lanes) rest axes; n is 3 per point, 6 with rotations. Rigid motions have no force
  Array stiffness;
  std::vector<Vec3> arms;  // [m] (num_points) from the mean of the points to each of them, at rest
  Mat3 inverse{};          // [1/m^2] inverse of A at rest   (THEORY 12.104)
  // unit vector n of (THEORY 12.102): with rotations, the direction in which the points lie farthest apart;
  // without, the line of points on a line, otherwise zero
  Vec3 line{};
  double turn_weight = 0.0;  // [m^2] kappa of (THEORY 12.102); 0 without rotations
};

/// Holds the derivatives of the energy with respect to displacements and rotations of the points, and the
/// rotation R of the link.
struct MatrixGradient {
  double energy = 0.0;                         // [J]
  std::array<Vec3, kMostMatrixPoints> force;   // [N]
  std::array<Vec3, kMostMatrixPoints> moment;  // [N m]
  Mat3 R{};
};

/// Computes the gradient at the positions x [m] of the points and the rotations of their ends
/// (THEORY 12.102 to 12.106).
/// \param rotations  (num_points), empty without rotations
/// \pre the link has at most kMostMatrixPoints points
void set_gradient(const MatrixConstants& matrix, std::span<const Vec3> x, std::span<const Mat3> rotations,
                  MatrixGradient& result) noexcept;

/// Computes the gradient of the linear structure, whose link does not turn: f = K (V, theta).
/// \param V  [m] (num_points) displacements  \param theta  [rad] (num_points), empty without rotations
void set_linear_gradient(const MatrixConstants& matrix, std::span<const Vec3> V, std::span<const Vec3> theta,
                         MatrixGradient& result) noexcept;

}  // namespace freeflex
