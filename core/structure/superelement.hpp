// Matrix links that are bodies of their own: with rows of rotations, inner coordinates or a mass matrix
// (THEORY X166).
#pragma once

#include "core/structure/link_factor.hpp"

namespace freeflex {

/// Natural deformations of such a link from its stiffness matrix, freed of rigid motion. Errors: symmetry,
/// rigid motion, negative eigenvalues. \param limits  accuracy is raised to the link's
DeformationRows superelement_rows(const Scene& scene, int link, const Freedoms& freedoms,
                                  MatrixLimits& limits, Faults& faults);

/// Rows of its mass matrix, M = N^T N, none without one.  \pre mass_matrix_problem found nothing
DeformationRows superelement_mass_rows(const Scene& scene, int link, const Freedoms& freedoms);

/// Structure::matrix_sums.  \pre structure.shapes and turns
MatrixSums matrix_sums(const Scene& scene, const Freedoms& freedoms, const Structure& structure);

}  // namespace freeflex
