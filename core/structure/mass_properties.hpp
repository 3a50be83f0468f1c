// Mass properties of the rest shape and the number of its rigid freedoms.
#pragma once

#include <vector>

#include "core/structure/structure.hpp"

namespace freeflex {

/// Mass, centre of mass, inertia and principal axes (THEORY 1.1, 1.3, 1.4, X40, X41), and whether the shape
/// is one point, a line or a body (THEORY X42). Points all in one place are an error, a shape nearly on a
/// line is a warning. \pre at least one point; masses finite, their sum > 0; positions finite
MassProperties find_mass_properties(const Scene& scene, Faults& faults);

/// Rigid motions of the rest shape, displacement per unit motion: translations V_i = e_a, then rotations
/// V_i = u_k x r_i about the principal axes (without the line of a collinear shape), each of unit length
/// (THEORY X43).
/// \return [-] (3N x rigid_freedoms)
Eigen::MatrixXd rigid_motions(const MassProperties& properties);

}  // namespace freeflex
