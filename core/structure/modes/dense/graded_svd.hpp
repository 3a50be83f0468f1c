// This code computes accurate singular values of a matrix whose rows and columns differ in size by many
// orders of magnitude.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace freeflex {

/// Sorts rows in descending order of the magnitude of their largest entry. Householder QR with column
/// pivoting is then accurate row by row, so the row of a soft link keeps its digits next to the row of a
/// stiff link   (THEORY 4.8; Cox and Higham 1998, stability of Householder QR). Returns the previous position
/// of each row.
std::vector<int> sort_rows(Eigen::MatrixXd& matrix);

struct GradedSvd {
  Eigen::VectorXd values;       // ascending (num_columns)
  Eigen::MatrixXd vectors;      // right singular vectors as columns (num_columns x num_columns)
  Eigen::VectorXd lowest_left;  // left singular vector of the smallest value (num_rows)
  double accuracy = 0.0;        // [-] stated relative accuracy of the smallest value
};

/// Returns the singular values of a matrix, accurate for any scaling of rows and columns. Uses Householder QR
/// with sorted rows and pivoted columns, then the one-sided Jacobi method on Z^T, where Z is the triangular
/// factor   (THEORY 4.8; Drmac and Veselic 2008, SIAM J. Matrix Anal. Appl. 29, 1322-1362). The Jacobi method
/// takes seconds above kSmall columns and minutes above kLarge columns. Above kSmall columns, bidiagonal
/// divide and conquer is used instead if its loss of accuracy, 8 eps times the ratio of the largest to the
/// smallest value, is below kMildLoss or kMildLossLarge (THEORY 4.11).
/// \pre at least as many rows as columns, full column rank
GradedSvd graded_svd(Eigen::MatrixXd matrix);

inline constexpr Eigen::Index kSmall = 200;      // columns
inline constexpr Eigen::Index kLarge = 700;      // columns
inline constexpr double kMildLoss = 1e-12;       // [-] allowed loss up to kLarge columns
inline constexpr double kMildLossLarge = 1e-10;  // [-] allowed loss above kLarge columns

}  // namespace freeflex
