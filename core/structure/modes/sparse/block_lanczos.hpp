// The block Lanczos method computes the largest eigenvalues of an operator that is symmetric in the mass
// metric. The mass matrix may be semidefinite.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "core/structure/modes/sparse/narrow_products.hpp"

namespace freeflex {

/// Ritz values in descending order of |theta|.
struct RitzPairs {
  Eigen::VectorXd theta;   // (count)
  Eigen::VectorXd error;   // (count) |T x - theta x| in the mass metric, T the operator
  Eigen::MatrixXd shares;  // (columns x count) coefficients of the Ritz vectors in the basis
  int num_converged = 0;   // number of Ritz values before the first that has not converged
};

/// Columns stored in chunks, so that appending columns does not copy the stored ones.
class GrowingColumns {
 public:
  Eigen::Index size() const { return count_; }
  void append(const Eigen::MatrixXd& columns);
  Eigen::MatrixXd range(Eigen::Index begin, Eigen::Index count) const;
  /// Removes from y the components along V: y -= V V^T weighed, where weighed is m y. V are the columns from
  /// the start of the chunk that contains column `begin`. Adds V^T weighed to the rows of shares for these
  /// columns (size() x columns).
  /// \pre y has at most kMostNarrow columns
  void project_out(Eigen::Index begin, const Eigen::MatrixXd& weighed, Eigen::MatrixXd& y,
                   Eigen::MatrixXd& shares, const ShareWork& share) const;
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
  ShareWork share;       // runs work that can be shared out; empty: one piece after another
  GrowingColumns known;  // (n x count) m-orthonormal columns that are projected out
};

/// Block Lanczos method with full reorthogonalisation in the mass metric   (THEORY 16.37; G. H. Golub,
/// R. Underwood, in Mathematical Software III, 1977; R. G. Grimes, J. G. Lewis, H. D. Simon, SIAM J. Matrix
/// Anal. Appl. 15, 1994, 228-272). The projected operator is stored as a full matrix, so a block may lose
/// dependent columns.
class BlockLanczos {
 public:
  BlockLanczos(const MassSymmetric& op, Eigen::Index size, int block, unsigned seed);
  /// Adds one block. Returns false if the operator failed or the space is exhausted.
  bool step();
  /// Returns the number of columns of the basis.
  Eigen::Index num_columns() const { return basis_.size(); }
  bool is_complete() const { return is_complete_; }
  bool has_failed() const { return has_failed_; }
  /// Returns the Ritz pairs of the basis.  \param tolerance  [-] largest error of a converged pair, as a
  /// fraction of its theta
  RitzPairs pairs(double tolerance) const;
  /// Returns the first `count` Ritz vectors, m-orthonormal (n x count).
  Eigen::MatrixXd vectors(const RitzPairs& pairs, Eigen::Index count) const {
    return basis_.times(pairs.shares.leftCols(count));
  }

 private:
  // makes the given columns m-orthogonal to the basis and m-orthonormal to each other, and removes dependent
  // columns
  // \param first  first column of the blocks of the basis along which the given columns have their largest
  // components
  // \return       coefficients of the given columns along the kept ones (kept x columns)
  Eigen::MatrixXd orthonormalise(Eigen::MatrixXd& columns, Eigen::MatrixXd& shares, Eigen::Index first);
  Eigen::VectorXd sizes(const Eigen::MatrixXd& columns) const;
  // removes from the given columns, in one pass, the components along the known columns and the basis; adds
  // the components along the basis to shares
  void project_out(Eigen::MatrixXd& columns, Eigen::MatrixXd& shares) const;
  Eigen::MatrixXd orthonormalise_block(Eigen::MatrixXd& columns, const Eigen::VectorXd& before);
  bool restart();

  const MassSymmetric& op_;
  Eigen::Index size_;
  GrowingColumns basis_;         // V (n x count)
  Eigen::Index last_ = 0;        // first column of the block to which the operator T is not yet applied
  Eigen::MatrixXd projected_;    // (capacity x capacity) V^T m T V; columns before last_ are computed
  Eigen::MatrixXd next_;         // R in T V_last = V H + V_next R, where V_next extends V
  Eigen::Index last_begin_ = 0;  // first column of the block to which T was applied last
  int block_;
  unsigned seed_;
  bool is_complete_ = false, has_failed_ = false;
};

}  // namespace freeflex
