#include "core/structure/modes/dense/null_space.hpp"

#include "core/rounding.hpp"
#include "core/structure/modes/dense/graded_svd.hpp"

namespace freeflex {

NullSpace null_space(const Eigen::MatrixXd& rows, double threshold) {
  NullSpace null;
  if (rows.rows() == 0 || rows.cols() == 0) {
    null.basis = Eigen::MatrixXd::Identity(rows.cols(), rows.cols());
    for (int k = 0; k < static_cast<int>(rows.cols()); ++k) null.free.push_back(k);
    return null;
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(rows);
  qr.setThreshold(threshold);
  const Eigen::Index rank = qr.rank();
  const Eigen::Index nullity = rows.cols() - rank;
  const auto& order = qr.colsPermutation().indices();
  null.pivots.assign(order.data(), order.data() + rank);
  null.free.assign(order.data() + rank, order.data() + order.size());
  null.basis.resize(rows.cols(), nullity);
  if (nullity == 0) return null;
  null.basis.topRows(rank) = -qr.matrixR()
                                  .topLeftCorner(rank, rank)
                                  .triangularView<Eigen::Upper>()
                                  .solve(qr.matrixR().topRightCorner(rank, nullity));
  null.basis.bottomRows(nullity).setIdentity();
  null.basis = (qr.colsPermutation() * null.basis).eval();
  return null;
}

// O_2^T A_V   (THEORY 3.21)
Condensed condense(Eigen::MatrixXd rows, Eigen::Index num_kept, Eigen::Index known_rank, bool with_recovery) {
  sort_rows(rows);
  const Eigen::Index num_condensed = rows.cols() - num_kept;
  // Eigen's QR needs at least one row and one column
  if (num_condensed == 0 || rows.rows() == 0)
    return {rows.leftCols(num_kept), Eigen::MatrixXd::Zero(num_condensed, num_kept), 0};
  Eigen::MatrixXd rotation_columns = rows.rightCols(num_condensed);
  // the column of a rotation that a rigid body determines has norm zero, because no row acts on the rotation
  const Eigen::RowVectorXd scale =
      rotation_columns.colwise().norm().unaryExpr([](double norm) { return norm > 0.0 ? 1.0 / norm : 0.0; });
  rotation_columns *= scale.asDiagonal();
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(rotation_columns);
  // The columns have length one. The pivots of free rotations are therefore a few eps, but the pivots of a
  // chain of n beams decrease only as 1/n
  qr.setThreshold(8.0 * static_cast<double>(rows.rows()) * kEpsilon);
  Condensed condensed;
  condensed.rank = known_rank < 0 ? qr.rank() : known_rank;
  Eigen::MatrixXd rotated = rows.leftCols(num_kept);
  rotated.applyOnTheLeft(qr.householderQ().adjoint());
  condensed.rows = rotated.bottomRows(rows.rows() - condensed.rank);
  if (with_recovery) {
    // theta = -Z^+ O_1^T A_V V   (THEORY 3.22); undetermined rotations are zero
    Eigen::MatrixXd solution = Eigen::MatrixXd::Zero(num_condensed, num_kept);
    solution.topRows(condensed.rank) = -qr.matrixR()
                                            .topLeftCorner(condensed.rank, condensed.rank)
                                            .triangularView<Eigen::Upper>()
                                            .solve(rotated.topRows(condensed.rank));
    condensed.recovery = scale.asDiagonal() * (qr.colsPermutation() * solution);
  }
  return condensed;
}

}  // namespace freeflex
