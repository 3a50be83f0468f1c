#include "core/structure/modes/dense/mechanisms.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SparseCore>
#include <algorithm>
#include <numeric>

#include "core/structure/modes/dense/decompositions.hpp"
#include "core/structure/modes/dense/null_space.hpp"

namespace freeflex {
namespace {

// [-] fraction of the largest displacement in a motion: a point that moves by less than this is at rest
constexpr double kRestingBelow = 1e-6;

// largest number of sample points for which every pair of points is compared
constexpr Eigen::Index kMostCompared = 2000;

// returns an orthonormal basis of the column space of independent columns
Eigen::MatrixXd orthonormal(const Eigen::MatrixXd& columns) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(columns);
  Eigen::MatrixXd basis = Eigen::MatrixXd::Identity(columns.rows(), columns.cols());
  basis.applyOnTheLeft(qr.householderQ());
  return basis;
}

// returns the indices of the rows that contain the displacements of some points
std::vector<Eigen::Index> rows_of(const std::vector<int>& points) {
  std::vector<Eigen::Index> rows;
  for (const int point : points)
    for (Eigen::Index axis = 0; axis < 3; ++axis) rows.push_back(3 * Eigen::Index{point} + axis);
  return rows;
}

// returns, for each motion, the coefficients of the rigid motion that is nearest to the motion of some points
// (6 x motions)
Eigen::MatrixXd rigid_part(const Eigen::MatrixXd& motions, const Eigen::MatrixXd& rigid,
                           const std::vector<int>& points) {
  const auto rows = rows_of(points);
  return Eigen::MatrixXd(rigid(rows, Eigen::all))
      .completeOrthogonalDecomposition()
      .solve(motions(rows, Eigen::all));
}

// Returns whether some points move as one body in every motion. Constant distances are not sufficient,
// because to first order a point may leave the line or plane of other points and still keep its distances
// from them (THEORY 4.4).
bool moves_as_one(const Eigen::MatrixXd& motions, const Eigen::MatrixXd& rigid,
                  const std::vector<int>& points) {
  const auto rows = rows_of(points);
  const Eigen::MatrixXd left =
      motions(rows, Eigen::all) - rigid(rows, Eigen::all) * rigid_part(motions, rigid, points);
  return left.cwiseAbs().maxCoeff() < kRestingBelow;
}

// Returns the core. The core is a large set of points that moves as one body in every motion. The motion of
// all other points is described relative to the core. The search is greedy. It tries the points in descending
// order of the number of other points to which their distance stays the same. Mechanisms are correct with any
// core, but a larger core makes their names more specific (THEORY 4.4).
std::vector<int> find_core(const Eigen::MatrixXd& motions, const Eigen::MatrixXd& rigid,
                           const Eigen::Matrix3Xd& r) {
  const auto num_points = static_cast<int>(r.cols());
  Eigen::MatrixXi keeps = Eigen::MatrixXi::Zero(num_points, num_points);
  for (int i = 0; i < num_points; ++i)
    for (int j = 0; j < i; ++j) {
      const Eigen::Vector3d direction = (r.col(j) - r.col(i)).stableNormalized();
      const Eigen::RowVectorXd stretch = direction.transpose() * (motions.middleRows<3>(3 * Eigen::Index{j}) -
                                                                  motions.middleRows<3>(3 * Eigen::Index{i}));
      keeps(i, j) = keeps(j, i) = stretch.norm() < kRestingBelow ? 1 : 0;
    }
  const Eigen::VectorXi count = keeps.rowwise().sum();
  std::vector<int> order(index(num_points)), core;
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return count[a] > count[b]; });
  for (const int point : order) {
    if (!std::all_of(core.begin(), core.end(), [&](int other) { return keeps(point, other) == 1; })) continue;
    core.push_back(point);
    if (!moves_as_one(motions, rigid, core)) core.pop_back();
  }
  return core;
}

// Returns a core for many points without comparing every pair. For each of 64 neighbourhoods, finds the
// points that move as one body with it. Returns the largest of these sets   (THEORY 4.4).
std::vector<int> find_large_core(const Eigen::MatrixXd& motions, const Eigen::MatrixXd& rigid,
                                 const Eigen::Matrix3Xd& r) {
  constexpr Eigen::Index kStarts = 64, kNeighbours = 12;
  std::vector<int> largest;
  std::vector<int> order(index(r.cols()));
  for (Eigen::Index start = 0; start < kStarts; ++start) {
    const Eigen::Vector3d from = r.col(start * r.cols() / kStarts);
    std::iota(order.begin(), order.end(), 0);
    std::partial_sort(order.begin(), order.begin() + kNeighbours, order.end(), [&](int a, int b) {
      return (r.col(a) - from).squaredNorm() < (r.col(b) - from).squaredNorm();
    });
    // nearest points that move as one body
    std::vector<int> near;
    for (Eigen::Index k = 0; k < kNeighbours; ++k) {
      near.push_back(order[index(k)]);
      if (!moves_as_one(motions, rigid, near)) near.pop_back();
    }
    const Eigen::MatrixXd left = motions - rigid * rigid_part(motions, rigid, near);
    std::vector<int> resting;
    for (int point = 0; point < static_cast<int>(r.cols()); ++point)
      if (left.middleRows<3>(3 * Eigen::Index{point}).cwiseAbs().maxCoeff() < kRestingBelow)
        resting.push_back(point);
    if (resting.size() > largest.size()) largest = std::move(resting);
  }
  return largest;
}

// returns a basis of the space of the given motions. Each motion of the basis has one coordinate that is 1 in
// this motion and 0 in all other motions of the basis
Eigen::MatrixXd localise(const Eigen::MatrixXd& motions) {
  const Eigen::MatrixXd basis = orthonormal(motions);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(basis.transpose());
  Eigen::MatrixXd own(basis.cols(), basis.cols());
  for (Eigen::Index k = 0; k < basis.cols(); ++k) own.row(k) = basis.row(qr.colsPermutation().indices()[k]);
  return own.transpose().fullPivLu().solve(basis.transpose()).transpose();
}

// Returns whether no singular value of (B; C; T^T) is below kSafe, that is, whether B^T B + C^T C + T T^T -
// kSafe^2 1 has a Cholesky factor   (THEORY 4.6). `unit_rows` contains B and C. The test is cheap compared
// with the rank-revealing QR. The QR is needed only if the test fails.
bool has_full_rank(const Eigen::MatrixXd& unit_rows, const Eigen::MatrixXd& rigid) {
  constexpr double kSafe = 1e-5;  // [-] its square, 1e-10, is far above the rounding error of B^T B, which is
                                  // about 1e-12 for 3000 columns
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
  std::stable_sort(points.begin(), points.end(), [&](int a, int b) { return size[a] > size[b]; });
  // points with displacements of equal size, except for rounding errors, keep the order of the scene
  for (auto first = points.begin(); first != points.end();) {
    const auto last = std::find_if(
        first, points.end(), [&](int point) { return size[*first] > size[point] * (1.0 + kRestingBelow); });
    std::sort(first, last);
    first = last;
  }
  return points;
}

}  // namespace

// the mechanisms are the null space of (B; C; T^T)   (THEORY 4.4); a pivot is treated as zero if it is below
// 4 n `rounding` times the largest pivot (THEORY 4.5)
Mechanisms find_mechanisms(const Eigen::MatrixXd& unit_rows, const Eigen::MatrixXd& rigid_motions,
                           const SamplePoints& samples, double rounding) {
  const Eigen::MatrixXd rigid = orthonormal(rigid_motions);
  Mechanisms mechanisms;
  mechanisms.motions.resize(unit_rows.cols(), 0);
  if (has_full_rank(unit_rows, rigid)) return mechanisms;

  Eigen::MatrixXd all_rows(unit_rows.rows() + rigid.cols(), unit_rows.cols());
  all_rows << unit_rows, rigid.transpose();
  const double threshold = 4.0 * static_cast<double>(all_rows.cols()) * rounding;
  const Eigen::MatrixXd null = null_space(all_rows, threshold).basis;
  if (null.cols() == 0) return mechanisms;

  const auto displacements_of = [&](const Eigen::MatrixXd& moving) -> Eigen::MatrixXd {
    return samples.rows.size() > 0 ? Eigen::MatrixXd(samples.rows * moving) : moving;
  };
  return name_mechanisms(orthonormal(null), rigid, samples, displacements_of);
}

Mechanisms name_mechanisms(const Eigen::MatrixXd& motions, const Eigen::MatrixXd& rigid,
                           const SamplePoints& samples, const SampleDisplacements& displacements_of) {
  Mechanisms mechanisms;
  // subtracts the rigid motion of the core, so that the core is at rest
  const Eigen::MatrixXd moved = displacements_of(motions), carried = displacements_of(rigid);
  const std::vector<int> core = samples.r.cols() > kMostCompared ? find_large_core(moved, carried, samples.r)
                                                                 : find_core(moved, carried, samples.r);
  mechanisms.motions = localise(motions - rigid * rigid_part(moved, carried, core));
  for (Eigen::Index k = 0; k < mechanisms.motions.cols(); ++k) {
    mechanisms.motions.col(k) /= mechanisms.motions.col(k).cwiseAbs().maxCoeff();
    std::vector<int> points;
    for (const int sample : moved_points(displacements_of(mechanisms.motions.col(k)))) {
      const int point = samples.point_of.empty() ? sample : samples.point_of[index(sample)];
      if (std::find(points.begin(), points.end(), point) == points.end()) points.push_back(point);
    }
    mechanisms.names.push_back({std::move(points)});
  }
  return mechanisms;
}

}  // namespace freeflex
