// Computes the modes of structures with bodies, massless points or links with mass. Rigid links may join
// them.
#pragma once

#include "core/structure/links/link_factor.hpp"

namespace freeflex {

/// Returns the rigid motions V_i = e_a, V_i = u_k x r_i (num_all x 6) over all freedoms (THEORY 2.11), with
/// rotations about the axes of the largest moments first.
/// \param length  [m] factor of the rotational freedoms
Eigen::MatrixXd rigid_motions_of(const Scene& scene, const Freedoms& freedoms, const MassProperties& body,
                                 double length);

/// Fills omega, shapes, rotations, particles, matrix_sums, mechanisms, frequency_accuracy and conditioning
/// (THEORY 16.6 to 16.9). The function adds an error if links do not hold a massless point in every
/// direction.
/// \pre structure.mass_properties is filled; factor is from factor_links()
void find_body_modes(const Scene& scene, const LinkFactor& factor, Structure& structure, Faults& faults);

}  // namespace freeflex
