// Superelements are matrix links with rotations, inner coordinates or a mass matrix   (THEORY 16.17).
#pragma once

#include "core/structure/links/link_factor.hpp"

namespace freeflex {

/// Returns the natural deformations of a superelement, which contain no rigid motion
/// (THEORY 3.11 to 3.14, 16.17). The function adds an error for a zero matrix, resistance to rigid motion,
/// and negative eigenvalues.
/// \param limits  accuracy is raised to the error of the link
DeformationRows superelement_rows(const Scene& scene, int link, const Freedoms& freedoms,
                                  MatrixLimits& limits, Faults& faults);

/// Returns the mass rows of a superelement. The result is empty if the superelement has no mass matrix
/// (THEORY 16.17).
/// \pre mass_matrix_problem() is empty
DeformationRows superelement_mass_rows(const Scene& scene, int link, const Freedoms& freedoms);

/// Returns the coordinates of a superelement in the unit motions of the modes, in the order of its matrices
/// (num_rows x num modes).  \pre structure.shapes and rotations are filled
Eigen::MatrixXd superelement_motions(const Scene& scene, int link, const Freedoms& freedoms,
                                     const Structure& structure);

}  // namespace freeflex
