#include "core/structure/block_lanczos.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "core/structure/decompositions.hpp"
#include "core/structure/sparse_system.hpp"

namespace freeflex {
namespace {

// [-] of a column's length before what is known was taken out: what is left is rounding
constexpr double kNothingNew = 1e-11;

}  // namespace

BlockLanczos::BlockLanczos(const MassSymmetric& op, Eigen::Index size, int block, unsigned seed)
    : op_(op), block_(block), seed_(seed) {
  basis_.resize(size, 0);
  start_anew();
}

// X172: random columns through the operator once, so that they have what it leaves of massless freedoms
bool BlockLanczos::start_anew() {
  std::mt19937_64 engine(seed_++);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd columns(basis_.rows(), block_);
  for (double& value : columns.reshaped()) value = normal(engine);
  columns = op_.apply(op_.weigh(columns));
  if (columns.cols() == 0) {
    has_failed_ = true;
    return false;
  }
  Eigen::MatrixXd shares;
  orthonormalise(columns, shares);
  append(columns);
  return columns.cols() > 0;
}

Eigen::MatrixXd BlockLanczos::orthonormalise(Eigen::MatrixXd& columns, Eigen::MatrixXd& shares) {
  const auto gram = [&] {
    const Eigen::MatrixXd weighed = op_.weigh(columns);
    return Eigen::MatrixXd(columns.transpose() * weighed);
  };
  const Eigen::VectorXd before = gram().diagonal().cwiseMax(0.0).cwiseSqrt();
  shares = Eigen::MatrixXd::Zero(count_, columns.cols());
  for (int pass = 0; pass < 2; ++pass) {
    const Eigen::MatrixXd weighed = op_.weigh(columns);
    subtract(op_.known, op_.known.cols(), products(op_.known, op_.known.cols(), weighed), columns);
    const Eigen::MatrixXd h = products(basis_, count_, weighed);
    subtract(basis_, count_, h, columns);
    shares += h;
  }
  // directions of the block by eigenvectors of its Gram matrix, columns scaled by what they were, twice
  const Eigen::VectorXd scale = before.unaryExpr([](double size) { return size > 0.0 ? 1.0 / size : 0.0; });
  Eigen::MatrixXd block = columns * scale.asDiagonal();
  Eigen::MatrixXd R = before.asDiagonal();
  columns = block;
  for (int pass = 0; pass < 2 && columns.cols() > 0; ++pass) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(gram());
    std::vector<Eigen::Index> kept;
    const double least = pass == 0 ? kNothingNew * kNothingNew : 0.25;
    for (Eigen::Index k = 0; k < columns.cols(); ++k)
      if (eigen.eigenvalues()[k] > least) kept.push_back(k);
    const Eigen::VectorXd roots = eigen.eigenvalues()(kept).cwiseSqrt();
    const Eigen::MatrixXd turn = eigen.eigenvectors()(Eigen::all, kept);
    columns = (columns * turn * roots.cwiseInverse().asDiagonal()).eval();
    R = (roots.asDiagonal() * turn.transpose() * R).eval();
    // small directions carry the rounding of the large ones against what is known
    const Eigen::MatrixXd weighed = op_.weigh(columns);
    subtract(op_.known, op_.known.cols(), products(op_.known, op_.known.cols(), weighed), columns);
    subtract(basis_, count_, products(basis_, count_, weighed), columns);
  }
  return R;
}

void BlockLanczos::append(const Eigen::MatrixXd& columns) {
  if (count_ + columns.cols() > basis_.cols()) {
    const Eigen::Index room = std::max<Eigen::Index>(8 * block_, count_ + count_ / 4 + columns.cols());
    basis_.conservativeResize(basis_.rows(), room);
  }
  basis_.middleCols(count_, columns.cols()) = columns;
  count_ += columns.cols();
}

bool BlockLanczos::step() {
  if (has_failed_ || is_complete_) return false;
  if (last_ == count_ && !start_anew()) {
    is_complete_ = !has_failed_;
    return false;
  }
  const Eigen::Index size = count_ - last_;
  Eigen::MatrixXd columns = op_.apply(op_.weigh(basis_.middleCols(last_, size)));
  if (columns.cols() == 0) {
    has_failed_ = true;
    return false;
  }
  Eigen::MatrixXd shares;
  next_ = orthonormalise(columns, shares);
  if (projected_.rows() < count_)
    projected_.conservativeResizeLike(Eigen::MatrixXd::Zero(2 * count_, 2 * count_));
  projected_.block(0, last_, count_, size) = shares;
  last_begin_ = last_;
  last_ = count_;
  append(columns);
  if (projected_.rows() < count_)
    projected_.conservativeResizeLike(Eigen::MatrixXd::Zero(2 * count_, 2 * count_));
  projected_.block(last_, last_begin_, next_.rows(), size) = next_;
  return true;
}

RitzPairs BlockLanczos::pairs(double tolerance, Eigen::Index count) const {
  RitzPairs found;
  const Eigen::Index known = last_;
  Eigen::MatrixXd T = projected_.topLeftCorner(known, known);
  // symmetric but for rounding; shares above the diagonal were found twice
  T = (0.5 * (T + T.transpose())).eval();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(T);
  found.theta = eigen.eigenvalues().reverse();
  const Eigen::MatrixXd S = eigen.eigenvectors().rowwise().reverse();
  found.error = next_.rows() == 0
                    ? Eigen::VectorXd::Zero(known)
                    : Eigen::VectorXd((next_ * S.middleRows(last_begin_, next_.cols())).colwise().norm());
  found.is_complete = is_complete_;
  const double rounding = 16.0 * std::numeric_limits<double>::epsilon() * (known > 0 ? found.theta[0] : 0.0);
  while (found.num_converged < known &&
         found.error[found.num_converged] <= std::max(tolerance * found.theta[found.num_converged], rounding))
    ++found.num_converged;
  count = std::min(count, known);
  if (count <= 0) return found;
  found.vectors = Eigen::MatrixXd::Zero(basis_.rows(), count);
  subtract(basis_, known, -S.leftCols(count), found.vectors);
  return found;
}

RitzPairs BlockLanczos::values(double tolerance) const { return pairs(tolerance, 0); }

}  // namespace freeflex
