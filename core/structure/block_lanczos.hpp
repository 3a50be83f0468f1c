// The largest eigenvalues of a symmetric operator in the metric of a semidefinite mass matrix.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace freeflex {

/// Ritz values; the size of theta falls.
struct RitzPairs {
  Eigen::VectorXd theta;   // (count)
  Eigen::VectorXd error;   // (count) |T x - theta x| in the mass metric
  Eigen::MatrixXd shares;  // (columns x count) of each column of the basis in each vector
  int num_converged = 0;   // of the largest, without a gap
};

/// Columns that grow in number and are never moved: what is there already is not copied.
class GrowingColumns {
 public:
  Eigen::Index size() const { return count_; }
  void append(const Eigen::MatrixXd& columns);
  Eigen::MatrixXd range(Eigen::Index begin, Eigen::Index count) const;
  /// Of the columns from begin on, V: y -= V V^T weighed, and V^T weighed added to shares (size() x columns).
  void project_out(Eigen::Index begin, const Eigen::MatrixXd& weighed, Eigen::MatrixXd& y,
                   Eigen::MatrixXd& shares) const;
  /// The first S.rows() columns times S.
  Eigen::MatrixXd times(const Eigen::MatrixXd& S) const;

 private:
  std::vector<Eigen::MatrixXd> chunks_;
  Eigen::Index count_ = 0;
};

/// An operator that is symmetric in a mass metric: apply(M x), and the metric itself.
struct MassSymmetric {
  std::function<Eigen::MatrixXd(const Eigen::MatrixXd&)> apply;  // of M x; no columns: it failed
  std::function<Eigen::MatrixXd(const Eigen::MatrixXd&)> weigh;  // x -> M x
  GrowingColumns known;  // M-orthonormal columns that are projected out (n x count)
};

/// Block Lanczos with full reorthogonalisation in M (G. H. Golub, R. Underwood, in Mathematical Software III,
/// 1977; J. R. Grimes, R. J. Lewis, H. D. Simon, SIAM J. Matrix Anal. Appl. 15, 1994, 228-272): the projected
/// operator is kept whole, so that blocks may lose columns.   (THEORY X172)
class BlockLanczos {
 public:
  BlockLanczos(const MassSymmetric& op, Eigen::Index size, int block, unsigned seed);
  /// One block more; false when the operator failed or nothing is left to find.
  bool step();
  /// Number of columns so far.
  Eigen::Index num_columns() const { return basis_.size(); }
  bool is_complete() const { return is_complete_; }
  bool has_failed() const { return has_failed_; }
  /// Of those so far. \param tolerance  [-] of theta that counts as converged
  RitzPairs pairs(double tolerance) const;
  /// Of the first `count`, M-orthonormal (n x count).
  Eigen::MatrixXd vectors(const RitzPairs& pairs, Eigen::Index count) const {
    return basis_.times(pairs.shares.leftCols(count));
  }

 private:
  // makes columns M-orthonormal to all and to each other, drops those that are not new; first: where the
  // basis has most of them
  // \return what each of the columns was of those kept (kept x columns)
  Eigen::MatrixXd orthonormalise(Eigen::MatrixXd& columns, Eigen::MatrixXd& shares, Eigen::Index first);
  Eigen::VectorXd sizes(const Eigen::MatrixXd& columns) const;
  // what is known and the basis are taken out once
  void project_out(Eigen::MatrixXd& columns, Eigen::MatrixXd& shares) const;
  Eigen::MatrixXd orthonormalise_block(Eigen::MatrixXd& columns, const Eigen::VectorXd& before);
  bool start_anew();

  const MassSymmetric& op_;
  Eigen::Index size_;
  GrowingColumns basis_;         // V (n x count)
  Eigen::Index last_ = 0;        // first column of the block that was not yet multiplied
  Eigen::MatrixXd projected_;    // V^T M T V, columns below last_ known (room x room)
  Eigen::MatrixXd next_;         // what the last block gave beyond V: T V_last = V H + V_next R
  Eigen::Index last_begin_ = 0;  // of the block multiplied last
  int block_;
  unsigned seed_;
  bool is_complete_ = false, has_failed_ = false;
};

}  // namespace freeflex
