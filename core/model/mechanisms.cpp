#include "core/model/mechanisms.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SparseCore>
#include <algorithm>
#include <numeric>

#include "core/model/mass_properties.hpp"

namespace freeflex {
namespace {

// [-] of a motion's largest displacement: what moves less counts as resting
constexpr double kRestingBelow = 1e-6;

// orthonormal basis of the column space, full column rank given
Eigen::MatrixXd orthonormal(const Eigen::MatrixXd& columns) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(columns);
  Eigen::MatrixXd basis = Eigen::MatrixXd::Identity(columns.rows(), columns.cols());
  basis.applyOnTheLeft(qr.householderQ());
  return basis;
}

// Null space (columns) of the rows, by rank-revealing QR: [R11 R12] P' = 0 gives P [-R11^-1 R12; 1].
Eigen::MatrixXd null_space(const Eigen::MatrixXd& rows, double threshold) {
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(rows);
  qr.setThreshold(threshold);
  const Eigen::Index rank = qr.rank();
  const Eigen::Index nullity = rows.cols() - rank;
  Eigen::MatrixXd basis(rows.cols(), nullity);
  if (nullity == 0) return basis;
  basis.topRows(rank) = -qr.matrixR()
                             .topLeftCorner(rank, rank)
                             .triangularView<Eigen::Upper>()
                             .solve(qr.matrixR().topRightCorner(rank, nullity));
  basis.bottomRows(nullity).setIdentity();
  return qr.colsPermutation() * basis;
}

// Basis of the same space in which each motion is 1 in a coordinate of its own where all others are 0. With rigid
// motions included this clamps one part of the structure, so that a loose part moves alone.
Eigen::MatrixXd localise(const Eigen::MatrixXd& space) {
  const Eigen::MatrixXd basis = orthonormal(space);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(basis.transpose());
  Eigen::MatrixXd own(basis.cols(), basis.cols());
  for (Eigen::Index k = 0; k < basis.cols(); ++k) own.row(k) = basis.row(qr.colsPermutation().indices()[k]);
  return own.transpose().fullPivLu().solve(basis.transpose()).transpose();
}

// True when no singular value of the rows is anywhere near zero: B'B - kSafe^2 has a Cholesky factor. Cheap beside the
// rank-revealing QR, which decides where this does not.
bool has_full_rank(const Eigen::MatrixXd& unit_rows, const Eigen::MatrixXd& rigid) {
  constexpr double kSafe = 1e-5;  // [-] its square is far above the rounding of B'B, some 1e-12 at 3000 columns
  const Eigen::SparseMatrix<double> sparse = unit_rows.sparseView();
  Eigen::MatrixXd gram = rigid * rigid.transpose() + Eigen::MatrixXd(sparse.transpose() * sparse);
  gram.diagonal().array() -= kSafe * kSafe;
  return gram.llt().info() == Eigen::Success;
}

std::vector<int> moved_points(const Eigen::VectorXd& motion) {
  const Eigen::Index num_points = motion.size() / 3;
  Eigen::VectorXd size(num_points);
  for (Eigen::Index i = 0; i < num_points; ++i) size[i] = motion.segment<3>(3 * i).norm();
  std::vector<int> points;
  for (int i = 0; i < num_points; ++i)
    if (size[i] > kRestingBelow * size.maxCoeff()) points.push_back(i);
  // equal movers stay in the order of the scene, rounding apart
  std::stable_sort(points.begin(), points.end(),
                   [&](int a, int b) { return size[a] > size[b] * (1.0 + kRestingBelow); });
  return points;
}

}  // namespace

Mechanisms find_mechanisms(const Eigen::MatrixXd& unit_rows, const MassProperties& properties, double rounding) {
  const Eigen::MatrixXd rigid = orthonormal(rigid_motions(properties));
  Mechanisms mechanisms;
  mechanisms.motions.resize(unit_rows.cols(), 0);
  if (has_full_rank(unit_rows, rigid)) return mechanisms;

  Eigen::MatrixXd all_rows(unit_rows.rows() + rigid.cols(), unit_rows.cols());
  all_rows << unit_rows, rigid.transpose();
  const double threshold = 4.0 * static_cast<double>(all_rows.cols()) * rounding;
  const Eigen::MatrixXd null = null_space(all_rows, threshold);
  if (null.cols() == 0) return mechanisms;

  Eigen::MatrixXd space(rigid.rows(), rigid.cols() + null.cols());
  space << rigid, null;
  const Eigen::MatrixXd local = localise(space);
  std::vector<std::vector<int>> moved;
  for (Eigen::Index k = 0; k < local.cols(); ++k) moved.push_back(moved_points(local.col(k)));
  std::vector<int> order(moved.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return moved[static_cast<std::size_t>(a)].size() < moved[static_cast<std::size_t>(b)].size();
  });

  // fewest points first, as long as each is new besides rigid motion and those already taken
  Eigen::MatrixXd taken = rigid;
  mechanisms.motions.resize(unit_rows.cols(), null.cols());
  Eigen::Index num_taken = 0;
  for (const int k : order) {
    if (num_taken == null.cols()) break;
    Eigen::VectorXd rest = local.col(k).normalized();
    for (int pass = 0; pass < 2; ++pass) rest -= taken * (taken.transpose() * rest);
    if (rest.norm() < kRestingBelow) continue;
    taken.conservativeResize(Eigen::NoChange, taken.cols() + 1);
    taken.rightCols(1) = rest.normalized();
    mechanisms.motions.col(num_taken++) = local.col(k) / local.col(k).cwiseAbs().maxCoeff();
    mechanisms.names.push_back({moved[static_cast<std::size_t>(k)]});
  }
  mechanisms.motions.conservativeResize(Eigen::NoChange, num_taken);
  return mechanisms;
}

}  // namespace freeflex
