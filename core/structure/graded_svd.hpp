// Singular values of matrices whose rows and columns differ by many orders of magnitude.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace freeflex {

/// Reorders rows by falling largest entry. Householder QR with column pivoting is then accurate row by row,
/// so that a soft link keeps its digits beside a stiff one   (THEORY X52; Cox and Higham 1998, stability of
/// Householder QR). Returns where each row stood before.
std::vector<int> sort_rows(Eigen::MatrixXd& matrix);

struct GradedSvd {
  Eigen::VectorXd values;       // ascending (num_columns)
  Eigen::MatrixXd vectors;      // right singular vectors, one a column (num_columns x num_columns)
  Eigen::VectorXd lowest_left;  // left singular vector of the smallest value (num_rows)
  double accuracy = 0.0;        // [-] stated relative accuracy of the smallest value
};

/// Row-sorted, column-pivoted Householder QR, then one-sided Jacobi on Z^T, Z the triangular factor: each
/// singular value keeps its digits however the rows and columns are scaled   (THEORY X52; Drmac and Veselic
/// 2008, SIAM J. Matrix Anal. Appl. 29, 1322-1362). Above kSmall columns Jacobi takes seconds, above kLarge
/// minutes. There a bidiagonal divide and conquer on Z takes over as long as what it loses, 8 eps times the
/// ratio of the largest to the smallest value, stays below the two limits. \pre at least as many rows as
/// columns, full column rank
GradedSvd graded_svd(Eigen::MatrixXd matrix);

inline constexpr Eigen::Index kSmall = 200;      // columns
inline constexpr Eigen::Index kLarge = 700;      // columns
inline constexpr double kMildLoss = 1e-12;       // [-] allowed up to kLarge columns
inline constexpr double kMildLossLarge = 1e-10;  // [-] allowed beyond

}  // namespace freeflex
