// The block Lanczos method computes the largest eigenvalues of an operator that is symmetric in the mass
// metric. The mass matrix may be semidefinite.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace freeflex {

/// Ritz values in descending order of |theta|.
struct RitzPairs {
  Eigen::VectorXd theta;   // (count)
  Eigen::VectorXd error;   // (count) |T x - theta x| in the mass metric
  Eigen::MatrixXd shares;  // (columns x count) coefficients of the vectors over the basis
  int num_converged = 0;   // number of consecutive converged values from the largest on
};

/// Columns stored in chunks, so that appending columns does not copy the stored ones.
class GrowingColumns {
 public:
  Eigen::Index size() const { return count_; }
  void append(const Eigen::MatrixXd& columns);
  Eigen::MatrixXd range(Eigen::Index begin, Eigen::Index count) const;
  /// Removes from y its content along V, the columns from the chunk of `begin` on: y -= V V^T weighed. Adds
  /// V^T weighed to shares (size() x columns).
  void project_out(Eigen::Index begin, const Eigen::MatrixXd& weighed, Eigen::MatrixXd& y,
                   Eigen::MatrixXd& shares) const;
  /// Returns the product of the first S.rows() columns and S.
  Eigen::MatrixXd times(const Eigen::MatrixXd& S) const;

 private:
  std::vector<Eigen::MatrixXd> chunks_;
  Eigen::Index count_ = 0;
};

/// An operator that is symmetric in a mass metric, and the metric.
struct MassSymmetric {
  std::function<Eigen::MatrixXd(const Eigen::MatrixXd&)> apply;  // m x -> operator times x; empty on failure
  std::function<Eigen::MatrixXd(const Eigen::MatrixXd&)> weigh;  // x -> m x, m the mass matrix
  GrowingColumns known;  // (n x count) m-orthonormal columns that are projected out
};

/// Block Lanczos method with full reorthogonalisation in the mass metric   (THEORY 16.37; G. H. Golub,
/// R. Underwood, in Mathematical Software III, 1977; J. R. Grimes, R. J. Lewis, H. D. Simon, SIAM J. Matrix
/// Anal. Appl. 15, 1994, 228-272). The projected operator is stored as a full matrix, so blocks may lose
/// columns.
class BlockLanczos {
 public:
  BlockLanczos(const MassSymmetric& op, Eigen::Index size, int block, unsigned seed);
  /// Adds one block. Returns false if the operator failed or the space is exhausted.
  bool step();
  /// Returns the number of columns of the basis.
  Eigen::Index num_columns() const { return basis_.size(); }
  bool is_complete() const { return is_complete_; }
  bool has_failed() const { return has_failed_; }
  /// Returns the Ritz pairs of the basis.  \param tolerance  [-] of theta: largest error of a converged pair
  RitzPairs pairs(double tolerance) const;
  /// Returns the first `count` Ritz vectors, m-orthonormal (n x count).
  Eigen::MatrixXd vectors(const RitzPairs& pairs, Eigen::Index count) const {
    return basis_.times(pairs.shares.leftCols(count));
  }

 private:
  // makes columns m-orthonormal to the basis and to each other, and removes dependent columns
  // \param first  first column of the blocks along which the columns have most of their content
  // \return       coefficients of the given columns along the kept ones (kept x columns)
  Eigen::MatrixXd orthonormalise(Eigen::MatrixXd& columns, Eigen::MatrixXd& shares, Eigen::Index first);
  Eigen::VectorXd sizes(const Eigen::MatrixXd& columns) const;
  // projects the known columns and the basis out of columns, once
  void project_out(Eigen::MatrixXd& columns, Eigen::MatrixXd& shares) const;
  Eigen::MatrixXd orthonormalise_block(Eigen::MatrixXd& columns, const Eigen::VectorXd& before);
  bool restart();

  const MassSymmetric& op_;
  Eigen::Index size_;
  GrowingColumns basis_;         // V (n x count)
  Eigen::Index last_ = 0;        // first column of the block that T has not yet multiplied
  Eigen::MatrixXd projected_;    // V^T m T V; columns below last_ are computed (capacity x capacity)
  Eigen::MatrixXd next_;         // R in T V_last = V H + V_next R, beyond the basis V
  Eigen::Index last_begin_ = 0;  // first column of the block that T multiplied last
  int block_;
  unsigned seed_;
  bool is_complete_ = false, has_failed_ = false;
};

}  // namespace freeflex
