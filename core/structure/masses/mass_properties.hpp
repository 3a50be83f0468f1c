// Mass properties of the rest shape and the number of its rigid freedoms.
#pragma once

#include <vector>

#include "core/structure/structure.hpp"

namespace freeflex {

/// Returns mass, centre of mass, inertia and principal axes (THEORY 2.1 to 2.7), and the number of rigid
/// freedoms of the shape (THEORY 2.9, 2.10). If all points coincide, the function adds an error. If the
/// points are nearly on a line, it adds a warning.
/// \pre there is at least one point; masses and positions are finite; the sum of masses is > 0
MassProperties find_mass_properties(const Scene& scene, Faults& faults);

/// Returns the rigid motions of the rest shape as columns of unit length. Translations come first, then
/// rotations about the principal axes. The rotation about the line of a collinear shape is omitted
/// (THEORY 2.11).
/// \return [-] (3N x rigid_freedoms)
Eigen::MatrixXd rigid_motions(const MassProperties& properties);

}  // namespace freeflex
