// What sums over the mass run over: point masses, or the particles that bodies count as.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "core/structure/link_factor.hpp"

namespace freeflex {

/// A part of the mass and how it moves, V = displacement . freedoms to first order.
struct CarriedMass {
  double mass = 0.0;                              // [kg] > 0
  int point = -1;                                 // that carries it; -1: a link does
  int link = -1;                                  // that has it; -1: a point does
  Eigen::Vector3d arm = Eigen::Vector3d::Zero();  // [m] from that point, scene axes
  std::vector<std::pair<int, double>> shares;     // [-] of points, between which it stands but for the arm
  // [-], [m] along each scene axis   (THEORY X160, X164)
  std::array<std::vector<std::pair<int, double>>, 3> displacement;
};

/// Each point's own mass, or four of a body with inertia: m / 4 at the corners +-a_k of a tetrahedron about
/// its centre, a_k^2 = S_k / m along the principal axes of its second moment S   (THEORY X160). Then the
/// parts of links that have mass, each displaced as its link deforms   (THEORY X164); a mass matrix has none
/// (THEORY X166).
std::vector<CarriedMass> carried_masses(const Scene& scene, const Freedoms& freedoms);

/// Rows of the mass over all freedoms, M = N^T N: of bodies sqrt(m) (V + theta x d) and sqrt(J_k) theta . e_k
/// (THEORY X160), of links sqrt(m) V of their parts   (THEORY X164).
/// \param length  [m] that makes the unit rows of rotations of order one
DeformationRows mass_rows(const Scene& scene, const Freedoms& freedoms, double length);

/// The particles of a structure with bodies, moving as its points do.  \pre structure.shapes and turns
Particles find_particles(const Scene& scene, const Freedoms& freedoms, const Structure& structure);

/// What the second order of a body's turn needs of it: a particle on the arm a moves by theta x a + theta x
/// (theta x a) / 2   (THEORY X194).
struct TurningBody {
  Eigen::Matrix3Xd theta;  // [1/m] (3 x n) its elastic rotation
  Eigen::Matrix3d arms;    // [kg m^2] sum m r a^T over its particles
  Eigen::Vector3d arm;     // [kg m] sum m a
};
std::vector<TurningBody> turning_bodies(const Scene& scene, const Structure& structure);

/// sum m r_a g_kl,b over a body's particles for all pairs of modes (n x n), g_kl = (theta_k x (theta_l x a) +
/// theta_l x (theta_k x a)) / 2   (THEORY X194).
Eigen::MatrixXd second_order(const TurningBody& body, int a, int b);
/// The same for one pair of modes, all axes: row a, column b.
Eigen::Matrix3d second_order_of_pair(const TurningBody& body, Eigen::Index k, Eigen::Index l);
/// sum m g_kl [kg] over a body's particles.
Eigen::Vector3d moved_centre(const TurningBody& body, Eigen::Index k, Eigen::Index l);

}  // namespace freeflex
