// Null spaces and condensation by rank-revealing QR.
#pragma once

#include <vector>

#include "core/structure/decompositions.hpp"

namespace freeflex {

/// All y with rows y = 0: y = basis z, z the free components of y.
struct NullSpace {
  Eigen::MatrixXd basis;          // (n x nullity) the unit matrix at the free components
  std::vector<int> pivots, free;  // components of y
};
/// By [R11 R12] P^T = 0: P [-R11^-1 R12; 1]. \param threshold  [-] of the largest pivot: smaller ones are
/// zero
NullSpace null_space(const Eigen::MatrixXd& rows, double threshold);

/// Rows without the coordinates whose best values are known when the rest are: those without mass.
struct Condensed {
  Eigen::MatrixXd rows;      // (num_rows - rank x num_kept)
  Eigen::MatrixXd recovery;  // (num_condensed x num_kept), empty unless asked for
  Eigen::Index rank = 0;
};
/// X47: O^T A_theta = [Z; 0]; the rows of O^T A_V below the rank of A_theta are those of the condensed A, and
/// theta = -Z^+ (O^T A_V) V.
/// \param rows        (num_rows x (num_kept + num_condensed)) A_V beside A_theta
/// \param known_rank  of A_theta; < 0: found here, from columns scaled to one
Condensed condense(Eigen::MatrixXd rows, Eigen::Index num_kept, Eigen::Index known_rank, bool with_recovery);

}  // namespace freeflex
