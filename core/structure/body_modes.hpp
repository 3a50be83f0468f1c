// Modes of structures that are more than point masses: bodies, massless points, rigid links between them.
#pragma once

#include "core/structure/link_factor.hpp"

namespace freeflex {

/// The rotation of each freedom beyond the displacements per unit turn of the whole about an axis [-]
/// (num_rotations).
Eigen::VectorXd turned_freedoms(const Scene& scene, const Freedoms& freedoms, const Eigen::Vector3d& axis);

/// Fills omega, shapes, turns, particles, mechanisms and what is stated of them   (THEORY section 16).
/// Errors: massless points that nothing holds. \pre structure.mass_properties; factor of the scene
void find_body_modes(const Scene& scene, const LinkFactor& factor, Structure& structure, Faults& faults);

}  // namespace freeflex
