// Sums over the mass are taken over particles. Particles are point masses, particles of bodies, and parts of
// links.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "core/structure/links/link_factor.hpp"

namespace freeflex {

/// A part of the mass and its motion, V = displacement . freedoms to first order.
struct CarriedMass {
  double mass = 0.0;                              // [kg] > 0
  int point = -1;                                 // the point that carries the part; -1: a link carries it
  int link = -1;                                  // the link that carries the part; -1: a point carries it
  Eigen::Vector3d arm = Eigen::Vector3d::Zero();  // [m] from the point, scene axes
  // pairs (point, weight [-]). The weighted mean of the points is the position of the part without its arm
  std::vector<std::pair<int, double>> shares;
  // coefficients of displacements [-] and rotations [m], for the displacement along each scene axis
  // (THEORY 16.4, 16.10)
  std::array<std::vector<std::pair<int, double>>, 3> displacement;
};

/// Returns the particles of points, one for a point mass, four for a body with inertia (THEORY 16.4), then
/// the parts of links with mass (THEORY 16.10). Mass matrices have no particles (THEORY 16.17).
std::vector<CarriedMass> carried_masses(const Scene& scene, const Freedoms& freedoms);

/// Returns the mass rows A_m over all freedoms, m = A_m^T A_m, of bodies (THEORY 16.2) and links
/// (THEORY 16.10).
/// \param length  [m] scale that makes the unit rows of rotations of order one
DeformationRows mass_rows(const Scene& scene, const Freedoms& freedoms, double length);

/// Returns the particles of a structure with bodies and their displacements in each mode; sum m b.b = M
/// (THEORY 16.9).  \pre structure.shapes and rotations are filled
Particles find_particles(const Scene& scene, const Freedoms& freedoms, const Structure& structure);

/// The data of a body for terms that are of second order in its rotation. A particle on the arm d_p has the
/// position x = r + V + theta x d_p + theta x (theta x d_p) / 2   (THEORY 12.45).
struct RotatingBody {
  Eigen::Matrix3Xd theta;  // [1/m] (3 x n) elastic rotation
  Eigen::Matrix3d arms;    // [kg m^2] sum m r d_p^T over the particles of the body
  Eigen::Vector3d arm;     // [kg m] sum m d_p over the particles of the body
};
/// Returns the bodies of a structure, that is, its points with an attitude.
std::vector<RotatingBody> rotating_bodies(const Scene& scene, const Structure& structure);

/// Returns the field moments Y_l,ab = sum m r_a b_l,b of a mode, symmetric   (THEORY 8.15).
Eigen::Matrix3d field_moments(const Structure& structure, Eigen::Index mode);

/// Returns sum m r_a g_kl,b over the particles of a body for all pairs of modes k and l (n x n), where a and
/// b are axes. The tables G_kl and Z_kl contain this sum   (THEORY 12.46 to 12.48).
Eigen::MatrixXd second_order(const RotatingBody& body, int a, int b);
}  // namespace freeflex
