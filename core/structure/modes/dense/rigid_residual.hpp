// The size, origin and effect of rigid-body residuals. The set-up removes these residuals from matrix links.
#pragma once

#include <vector>

#include "core/structure/links/link_factor.hpp"

namespace freeflex {

/// Returns whether the rounding of the printed digits explains every entry of K T. Rounding changes an entry
/// of K by at most half a unit of its last digit, with either sign   (THEORY 3.18).
/// \param matrix   K as printed [N/m] (3 N_link x 3 N_link)
/// \param rigid    T, [-] (3 N_link x 3..6)
/// \param product  K T, with the mean of K and its transpose [N/m] (3 N_link x 3..6)
/// \param slack    [N/m] rounding error of the product itself
bool is_within_digits(const Eigen::SparseMatrix<double>& matrix, const Eigen::MatrixXd& rigid,
                      const Eigen::MatrixXd& product, double slack);

/// Raises Structure::frequency_accuracy to the bound on the relative difference between the elastic
/// frequencies and those of the matrices as given. The bound is 1 if a residual is as stiff as the links
/// (THEORY 4.17). Warns of a residual, with its frequencies in Hz, if it comes from a support or if a
/// frequency is above a tenth of the lowest elastic frequency (THEORY 3.20).  \pre omega, shapes and
/// mechanisms are filled
void account_for_rigid_residuals(const Scene& scene, const std::vector<RigidResidual>& residuals,
                                 Structure& structure, Faults& faults);

}  // namespace freeflex
