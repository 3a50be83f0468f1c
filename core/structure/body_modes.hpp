// Modes of structures with bodies, massless points, links with mass and rigid links between them.
#pragma once

#include "core/structure/link_factor.hpp"

namespace freeflex {

/// Returns the values of the rotational freedoms in a unit rigid rotation of the whole structure about an
/// axis [-] (num_rotations).
Eigen::VectorXd rigid_rotation(const Scene& scene, const Freedoms& freedoms, const Eigen::Vector3d& axis);

/// Fills omega, shapes, rotations, particles, matrix_sums, mechanisms, frequency_accuracy and conditioning
/// (THEORY 16.6 to 16.9). The function adds an error if no link holds a massless point.
/// \pre structure.mass_properties is filled; factor is that of the scene
void find_body_modes(const Scene& scene, const LinkFactor& factor, Structure& structure, Faults& faults);

}  // namespace freeflex
