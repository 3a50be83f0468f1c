// Mass of links: how its parts move with the points and joints that it is spread between   (THEORY X164).
#pragma once

#include "core/scene/bodies.hpp"
#include "core/structure/link_factor.hpp"

namespace freeflex {

/// Coefficients of freedoms, as those of a DeformationRow.
using Displacement = std::vector<std::pair<int, double>>;

/// How a part of a link's mass is displaced along each scene axis: a beam's along it as between its ends,
/// across it as it bends under loads at them, by Hermite's polynomials and, with shear, Przemieniecki's
/// (1968, section 11.3); a bar's as between its points; a plate's in its plane so too, across it by a cubic
/// of deflections and slopes at its corners [-], [m].
std::array<Displacement, 3> displacement_of(const Scene& scene, const Freedoms& freedoms,
                                            const SpreadMass& part);

/// Rows sqrt(m) V of the mass of a link. Those of MassSpread::kMeanAxial along the link stand for
/// m [5 1; 1 5] / 12 on its ends in place of m [4 2; 2 4] / 12.
DeformationRows spread_rows(const Scene& scene, const Freedoms& freedoms, int link);

}  // namespace freeflex
