// The distributed mass of links. The displacements of parts of the mass are computed from the displacements
// of points and joints (THEORY 16.10).
#pragma once

#include "core/scene/bodies.hpp"
#include "core/structure/links/link_factor.hpp"

namespace freeflex {

/// Coefficients of freedoms, as in a DeformationRow.
using Displacement = std::vector<std::pair<int, double>>;

/// Returns the displacement of a part of the mass of a link along each scene axis, as coefficients of
/// displacements [-] and rotations [m]   (THEORY 16.10). Displacements of bars, of beams along their axis and
/// of plates in their plane are linear between the points. The deflection of a beam is the deflection under
/// loads at its ends. It is given by Hermite's polynomials or, with shear stiffness, by the polynomials of
/// Przemieniecki (1968, section 11.3). The deflection of a plate is a cubic that depends on the deflections
/// and slopes at its corners.
std::array<Displacement, 3> displacement_of(const Scene& scene, const Freedoms& freedoms,
                                            const DistributedMass& part);

/// Returns the mass rows sqrt(m_g) V_g of a link   (THEORY 16.10 to 16.12). For displacements along the link,
/// MassDistribution::kMeanAxial gives the mass matrix m [5 1; 1 5] / 12 of the two ends instead of
/// m [4 2; 2 4] / 12.
DeformationRows distributed_mass_rows(const Scene& scene, const Freedoms& freedoms, int link);

}  // namespace freeflex
