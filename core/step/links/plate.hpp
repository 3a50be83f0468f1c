// A triangular plate at true geometry: the linear plate of (THEORY 3.28 to 3.37) in axes that turn with the
// triangle.
#pragma once

#include <array>

#include "core/step/vector.hpp"

namespace freeflex {

/// Holds the constants of a plate. Local axes: x along the first side, z the normal.
struct PlateConstants {
  Vec3 axis_x{}, axis_y{};  // [-] rest axes in the plane
  Vec3 first{}, second{};   // [m] rest sides from the first corner to the other two
  std::array<std::array<double, 2>, 3>
      gradients{};                   // [1/m] gradients of the barycentric coordinates, local x and y
  std::array<double, 3> membrane{};  // [N m] stiffness of exx + eyy, exx - eyy, gxy
  std::array<double, 81>
      bending{};  // [N m] (9 x 9) stiffness over the tilts and rolls of the corners, local axes
  std::array<double, 27>
      curvature{};  // [N m] (3 x 9) sums over the sides of the natural forces of (THEORY 3.33)
};

/// Holds the derivatives of the strain energy of a plate, by displacements and small rotations of its
/// corners.
struct PlateGradient {
  double energy = 0.0;  // [J]
  Vec3 force[3] = {};   // [N]
  Vec3 moment[3] = {};  // [N m]
  Vec3 membrane{};      // [N m] natural forces of exx + eyy, exx - eyy, gxy
  Vec3 theta[3] = {};   // [rad] tilts about x and y, and roll
};

/// Computes the gradient of the energy   (THEORY 12.65 to 12.68):
///   F = sum p_i g_i^T = R U,   E = sum D_k eps_k^2 / 2 + theta^T D_b theta / 2
/// with p_i the corners, g_i the gradients, R the axes in the plane, eps the strains of the stretch U - 1,
/// and theta the tilts of the normals of the corners about x and y, and their rolls about the normal,
/// relative to the axes of the plate. \param d  [m] displacement of each corner \param ends  local axes of
/// each corner as columns: its rotation times the rest axes
PlateGradient gradient_of(const PlateConstants& plate, const Vec3 (&d)[3], const Mat3 (&ends)[3]) noexcept;

/// Computes the same derivatives for small displacements and rotations   (THEORY 3.30 to 3.36).
/// \param theta  [rad] small rotations of the corners, in the axes of the displacements
PlateGradient linear_gradient_of(const PlateConstants& plate, const Vec3 (&d)[3],
                                 const Vec3 (&theta)[3]) noexcept;

}  // namespace freeflex
