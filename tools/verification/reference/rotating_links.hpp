// Beams and plates at true geometry. Computes their strain energy, and the derivatives of this energy by
// positions of points and rotations of ends. Nothing here uses core/structure, so this code can check
// core/structure   (THEORY 10.16 to 10.19).
#pragma once

#include <Eigen/Core>
#include <array>

#include "core/scene/scene.hpp"

namespace freeflex {

/// The strain energy of a link, and the derivatives of this energy with respect to displacements of points
/// and small rotations of ends, in axes fixed in space.
struct LinkGradient {
  double energy = 0.0;                    // [J]
  std::array<Eigen::Vector3d, 3> force;   // [N] derivative with respect to the displacement of each point
  std::array<Eigen::Vector3d, 3> moment;  // [N m] derivative with respect to the rotation of each end
  // [N m] second derivative with respect to rotations of ends, without the terms that contain moments; filled
  // on request
  Eigen::Matrix<double, 9, 9> stiffness;
};

/// A beam whose ends rotate little relative to its chord. The chord itself may rotate by any angle
/// (THEORY 10.16, 10.17).
struct TrueBeam {
  TrueBeam(const Beam& beam, const Eigen::Vector3d& span);
  Eigen::Matrix3d rest;                            // local axes of the undeformed beam as columns
  Eigen::Vector3d span;                            // [m]
  double length;                                   // [m]
  double EA;                                       // [N]
  double torsion;                                  // [N m] GJ / L
  std::array<double, 2> symmetric, antisymmetric;  // [N m] EI / L, 3 EI / (L (1 + phi)), about y and about z
  std::array<double, 2> phi;                       // [-] ratio of shear, about y and about z

  /// Computes the energy and its derivatives   (THEORY 10.17):
  ///   E = EA e^2 / (2 L) + GJ t_x^2 / (2 L) + sum_{a = y, z} (EI_a (t_2a - t_1a)^2 / (2 L)
  ///       + 3 EI_a (t_1a + t_2a)^2 / (2 L (1 + phi_a)))
  ///   e = (l - L) + L sum_a (2 t_1a^2 - t_1a t_2a + 2 t_2a^2) / 30
  /// with t_1, t_2 [rad] the rotations of the ends relative to the chord and t_x the twist   (THEORY 10.16).
  /// \param d [m] displacement of the second end relative to the first
  /// \param ends  local axes of each end as columns
  void evaluate(const Eigen::Vector3d& d, const std::array<Eigen::Matrix3d, 2>& ends, bool with_stiffness,
                LinkGradient& result) const;
};

/// A triangular plate in axes that rotate with the plate. The corners rotate little relative to these axes
/// (THEORY 10.18, 10.19).
struct TruePlate {
  TruePlate(const Plate& plate, const std::array<Eigen::Vector3d, 3>& corners);
  Eigen::Matrix3d rest;                   // local axes of the undeformed plate as columns
  Eigen::Matrix<double, 3, 2> edges;      // [m] edges from the first corner to the other two
  Eigen::Matrix<double, 2, 3> gradients;  // [1/m] gradients of barycentric coordinates, local axes
  Eigen::Vector3d membrane;               // [N m] stiffness of exx + eyy, exx - eyy, gxy
  Eigen::Matrix<double, 9, 9> bending;    // [N m] stiffness over the rotations of the corners, local axes

  /// Computes the energy and its derivatives   (THEORY 10.18, 10.19):
  ///   F = sum_i p_i g_i^T = R U,   E = sum_k D_k eps_k^2 / 2 + sum_m D_m (B_m theta)^2 / 2
  /// with p_i [m] the corners, g_i the gradients, R the axes in the plane, U the stretch, eps the strains of
  /// U - 1 and theta [rad] the tilts of the normals of the corners, and their rolls, relative to the axes of
  /// the plate.
  /// \param d [m] displacement of each corner  \param ends  local axes of each corner as columns
  void evaluate(const std::array<Eigen::Vector3d, 3>& d, const std::array<Eigen::Matrix3d, 3>& ends,
                bool with_stiffness, LinkGradient& result) const;
};

}  // namespace freeflex
