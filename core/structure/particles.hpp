// What sums over the mass run over: point masses, or the particles that bodies count as.
#pragma once

#include "core/structure/link_factor.hpp"

namespace freeflex {

/// A part of the mass that one point carries on a rigid arm.
struct CarriedMass {
  int point = -1;
  double mass = 0.0;                              // [kg] > 0
  Eigen::Vector3d arm = Eigen::Vector3d::Zero();  // [m] from the point, scene axes
};

/// Each point's own mass, or four of a body with inertia: m / 4 at the corners +-a_k of a tetrahedron about
/// its centre, a_k^2 = S_k / m along the principal axes of its second moment S   (THEORY X160).
std::vector<CarriedMass> carried_masses(const std::vector<PointMass>& points);

/// Rows of the mass over all freedoms, M = N^T N: sqrt(m) (V + theta x d) and sqrt(J_k) theta . e_k
/// (THEORY X160). \param length  [m] that makes the unit rows of rotations of order one
DeformationRows mass_rows(const Scene& scene, const Freedoms& freedoms, double length);

/// The particles of a structure with bodies, moving as its points do.  \pre structure.shapes and turns
Particles find_particles(const Scene& scene, const Freedoms& freedoms, const Structure& structure);

}  // namespace freeflex
