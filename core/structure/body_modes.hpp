// Computes the modes of structures with bodies, massless points or links with mass. Rigid links may join
// them.
#pragma once

#include "core/structure/links/link_factor.hpp"

namespace freeflex {

/// Returns the values of the rotational freedoms in a unit rigid rotation of the whole structure about an
/// axis [-] (num_rotations).
Eigen::VectorXd rigid_rotation(const Scene& scene, const Freedoms& freedoms, const Eigen::Vector3d& axis);

/// Fills omega, shapes, rotations, particles, matrix_sums, mechanisms, frequency_accuracy and conditioning
/// (THEORY 16.6 to 16.9). The function adds an error if links do not hold a massless point in every
/// direction.
/// \pre structure.mass_properties is filled; factor is from factor_links()
void find_body_modes(const Scene& scene, const LinkFactor& factor, Structure& structure, Faults& faults);

}  // namespace freeflex
