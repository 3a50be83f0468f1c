#include "core/structure/modes/dense/graded_svd.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <vector>

#include "core/rounding.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

// The Jacobi method converges quadratically at the end. After QR with pivoting the method usually needs six
// to ten sweeps.
constexpr int kMaxSweeps = 40;

// Rotates columns p and q of x so that they become orthogonal. The array norm2 holds the squared norms of all
// columns. Returns whether a rotation was needed.
bool rotate_pair(Eigen::MatrixXd& x, Eigen::VectorXd& norm2, Eigen::Index p, Eigen::Index q,
                 double tolerance) {
  const double product = x.col(p).dot(x.col(q));
  const double sizes = std::sqrt(norm2[p]) * std::sqrt(norm2[q]);
  if (std::abs(product) <= tolerance * sizes) return false;
  const double zeta = (norm2[q] - norm2[p]) / (2.0 * product);
  const double t = (zeta >= 0.0 ? 1.0 : -1.0) / (std::abs(zeta) + std::hypot(1.0, zeta));
  const double c = 1.0 / std::hypot(1.0, t);
  const double s = c * t;
  double* const column_p = x.col(p).data();
  double* const column_q = x.col(q).data();
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const double a = column_p[i], b = column_q[i];
    column_p[i] = c * a - s * b;
    column_q[i] = s * a + c * b;
  }
  const auto update = [&](Eigen::Index column, double change) {
    const double before = norm2[column];
    norm2[column] += change;
    // cancellation has lost digits, so the norm is computed again
    if (norm2[column] < 0.1 * before) norm2[column] = x.col(column).squaredNorm();
  };
  update(p, -t * product);
  update(q, t * product);
  return true;
}

// Makes the columns of x orthogonal by plane rotations from the right.
void orthogonalise_columns(Eigen::MatrixXd& x) {
  const double tolerance = kEpsilon * std::sqrt(static_cast<double>(x.rows()));
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    Eigen::VectorXd norm2 = x.colwise().squaredNorm();
    bool rotated = false;
    for (Eigen::Index p = 0; p + 1 < x.cols(); ++p) {
      for (Eigen::Index q = p + 1; q < x.cols(); ++q) {
        if (rotate_pair(x, norm2, p, q, tolerance)) rotated = true;
      }
      norm2[p] = x.col(p).squaredNorm();
    }
    if (!rotated) return;
  }
}

// Returns |Z_1^-1|_F, where Z_1 is the triangular factor Z (R in the code) with rows scaled to length one.
// One-sided Jacobi on Z^T has the relative error d omega_1 / omega_1 = 4 eps |Z_1^-1|_F   (THEORY 4.10).
double scaled_condition(const Eigen::MatrixXd& R) {
  const Eigen::VectorXd size = R.rowwise().norm();
  const Eigen::MatrixXd scaled = size.cwiseInverse().asDiagonal() * R;
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(R.rows(), R.cols());
  scaled.triangularView<Eigen::Upper>().solveInPlace(inverse);
  return inverse.norm();
}

}  // namespace

std::vector<int> sort_rows(Eigen::MatrixXd& matrix) {
  const Eigen::VectorXd size = matrix.rowwise().lpNorm<Eigen::Infinity>();
  std::vector<int> order(index(matrix.rows()));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return size[a] > size[b]; });
  matrix = matrix(order, Eigen::all).eval();
  return order;
}

// A m^-1/2 H = X diag(sigma) Y^T   (THEORY 4.8)
GradedSvd graded_svd(Eigen::MatrixXd matrix) {
  assert(matrix.rows() >= matrix.cols());
  GradedSvd svd;
  const Eigen::Index n = matrix.cols();
  if (n == 0) return svd;
  const std::vector<int> position = sort_rows(matrix);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(matrix);
  const Eigen::MatrixXd R = qr.matrixR().topRows(n).triangularView<Eigen::Upper>();

  const double limit = n > kLarge ? kMildLossLarge : kMildLoss;
  // d omega_1 / omega_1 = 8 eps omega_max / omega_1   (THEORY 4.11)
  const auto loss = [](double largest, double smallest) {
    return 8.0 * kEpsilon * std::abs(largest / smallest);
  };
  Eigen::MatrixXd left;  // left singular vectors of R^T
  Eigen::VectorXd values;
  bool is_done = false;
  if (n > kSmall && loss(R(0, 0), R(n - 1, n - 1)) < limit) {
    const Eigen::BDCSVD<Eigen::MatrixXd> divided(R.transpose(), Eigen::ComputeThinU);
    values = divided.singularValues();
    left = divided.matrixU();
    svd.accuracy = loss(values[0], values[n - 1]);
    // The ratio of diagonal entries of R may underestimate the loss, so the loss from the singular values is
    // compared with the limit. The comparison is false if the loss is NaN
    is_done = svd.accuracy < limit;
  }
  if (!is_done) {
    left = R.transpose();
    orthogonalise_columns(left);
    values = left.colwise().norm();
    left.array().rowwise() /= values.transpose().array();
    svd.accuracy = 4.0 * kEpsilon * scaled_condition(R);
  }
  std::vector<int> order(index(n));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return values[a] < values[b]; });
  svd.values = values(order);
  svd.vectors = qr.colsPermutation() * left(Eigen::all, order).eval();
  // The left singular vector is computed by solving R^T x = left * value, because the triangular solve keeps
  // the digits of small components next to large ones
  Eigen::VectorXd lowest = Eigen::VectorXd::Zero(matrix.rows());
  lowest.head(n) = left.col(order[0]) * svd.values[0];
  R.transpose().triangularView<Eigen::Lower>().solveInPlace(lowest.head(n));
  lowest.applyOnTheLeft(qr.householderQ());
  svd.lowest_left.resize(matrix.rows());
  for (std::size_t k = 0; k < position.size(); ++k)
    svd.lowest_left[position[k]] = lowest[static_cast<Eigen::Index>(k)];
  return svd;
}

}  // namespace freeflex
