// Beams and plates at true geometry: strain energy and its gradient over places of points and spins of ends
// (THEORY X152, X153). Written anew: nothing of core/structure is in it.
#pragma once

#include <Eigen/Core>
#include <array>

#include "core/scene/scene.hpp"

namespace freeflex {

/// Strain energy of a link, and what it changes by with places of points and spins of ends.
struct TurnResult {
  double energy = 0.0;                    // [J]
  std::array<Eigen::Vector3d, 3> place;   // [N] energy per displacement of each point
  std::array<Eigen::Vector3d, 3> moment;  // [N m] energy per spin of each end
  // [N m] energy per spins twice, without the terms of moments; filled when asked for
  Eigen::Matrix<double, 9, 9> stiffness;
};

/// Beam whose end rotations are small against its chord, which may turn at will   (THEORY X152).
struct TrueBeam {
  TrueBeam(const Beam& beam, const Eigen::Vector3d& span);
  Eigen::Matrix3d rest;                            // local axes at rest as columns
  Eigen::Vector3d span;                            // [m]
  double length;                                   // [m]
  double EA;                                       // [N]
  double torsion;                                  // [N m] GJ / L
  std::array<double, 2> symmetric, antisymmetric;  // [N m] EI / L, 3 EI / (L (1 + phi)), about y and about z

  /// \param d [m] relative displacement of its ends  \param ends  local axes of each end as columns
  void evaluate(const Eigen::Vector3d& d, const std::array<Eigen::Matrix3d, 2>& ends, bool with_stiffness,
                TurnResult& result) const;
};

/// Triangular plate whose own axes turn with it, rotations of its corners small against them (THEORY X153).
struct TruePlate {
  TruePlate(const Plate& plate, const std::array<Eigen::Vector3d, 3>& corners);
  Eigen::Matrix3d rest;                   // local axes at rest as columns
  Eigen::Matrix<double, 3, 2> edges;      // [m] from the first corner to the others
  Eigen::Matrix<double, 2, 3> gradients;  // [1/m] of barycentric coordinates, local axes
  Eigen::Vector3d membrane;               // [N m] stiffness of exx + eyy, exx - eyy, gxy
  Eigen::Matrix<double, 9, 9> bending;    // [N m] over the rotations of the corners, local axes

  /// \param d [m] displacement of each corner  \param ends  local axes of each corner as columns
  void evaluate(const std::array<Eigen::Vector3d, 3>& d, const std::array<Eigen::Matrix3d, 3>& ends,
                bool with_stiffness, TurnResult& result) const;
};

}  // namespace freeflex
