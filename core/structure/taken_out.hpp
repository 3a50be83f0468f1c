// What the set-up takes out of matrix links that resist rigid motion: how large it is, what it moves.
#pragma once

#include <vector>

#include "core/structure/link_factor.hpp"

namespace freeflex {

/// True where no entry of K T is more than the last digits of a printed matrix explain, each half a unit off,
/// whatever their signs   (THEORY X127).
/// \param matrix   K, as it was printed [N/m] (3 N_link x 3 N_link)
/// \param rigid    T, [-] (3 N_link x 3..6)
/// \param product  K T, of the mean of K and its transpose [N/m] (3 N_link x 3..6)
/// \param slack    [N/m] rounding of the product itself
bool is_within_digits(const Eigen::SparseMatrix<double>& matrix, const Eigen::MatrixXd& rigid,
                      const Eigen::MatrixXd& product, double slack);

/// Raises Structure::frequency_accuracy to the relative distance of elastic frequencies from those of the
/// matrices as given   (THEORY X128), 1 where what was taken out holds the structure as stiffly as its links
/// do. Says what was taken out, in Hz, where it is a support or more than a tenth of the lowest elastic
/// frequency (THEORY X127). \pre omega, shapes and mechanisms are filled
void account_for_taken_out(const Scene& scene, const std::vector<TakenOut>& taken_out, Structure& structure,
                           Faults& faults);

}  // namespace freeflex
