// Null spaces and condensation by rank-revealing QR.
#pragma once

#include <vector>

#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {

/// The null space of some rows. Every y = basis z satisfies rows y = 0, where z contains the free components
/// of y.
struct NullSpace {
  Eigen::MatrixXd basis;          // (n x nullity) unit matrix at the free components
  std::vector<int> pivots, free;  // indices of components of y
};
/// Returns the null space by column-pivoted QR: with rows P = Q (R11 R12; 0 0), basis = P (-R11^-1 R12; 1).
/// \param threshold  [-] fraction of the largest pivot; smaller pivots are treated as zero
NullSpace null_space(const Eigen::MatrixXd& rows, double threshold);

/// The rows that remain after static condensation of the coordinates without mass.
struct Condensed {
  Eigen::MatrixXd rows;      // (num_rows - rank x num_kept)
  Eigen::MatrixXd recovery;  // (num_condensed x num_kept), empty unless requested
  Eigen::Index rank = 0;
};
/// Condenses A_theta out of (A_V, A_theta): O^T (A_theta, A_V) = (Z, O_1^T A_V; 0, O_2^T A_V). The condensed
/// rows are O_2^T A_V (THEORY 3.21), and theta = -Z^+ O_1^T A_V V (THEORY 3.22).
/// \param rows        (num_rows x (num_kept + num_condensed)) A_V, then A_theta
/// \param known_rank  rank of A_theta; < 0: the rank is determined, with columns scaled to length one
Condensed condense(Eigen::MatrixXd rows, Eigen::Index num_kept, Eigen::Index known_rank, bool with_recovery);

}  // namespace freeflex
