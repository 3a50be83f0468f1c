#include "core/structure/modes/sparse/block_lanczos.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "core/structure/modes/dense/decompositions.hpp"
#include "core/structure/modes/sparse/sparse_system.hpp"

namespace freeflex {
namespace {

// [-] fraction of the length that a column has before projection. If projection leaves less of the column,
// the remainder is a rounding error
constexpr double kNothingNew = 1e-11;
// [-] fraction of the length that a column has before a pass of projection. If the pass leaves less, another
// pass must remove the rounding error in the remainder (Daniel, Gragg, Kaufman, Stewart, Math. Comp. 30,
// 1976)
constexpr double kEnoughLeft = 0.5;
constexpr Eigen::Index kChunk = 96;  // number of columns in one chunk

}  // namespace

void GrowingColumns::append(const Eigen::MatrixXd& columns) {
  for (Eigen::Index done = 0; done < columns.cols();) {
    const Eigen::Index at = count_ % kChunk, part = std::min(columns.cols() - done, kChunk - at);
    if (at == 0) chunks_.emplace_back(columns.rows(), kChunk);
    chunks_.back().middleCols(at, part) = columns.middleCols(done, part);
    done += part;
    count_ += part;
  }
}

Eigen::MatrixXd GrowingColumns::range(Eigen::Index begin, Eigen::Index count) const {
  Eigen::MatrixXd columns(count > 0 ? chunks_.front().rows() : 0, count);
  for (Eigen::Index k = 0; k < count; ++k)
    columns.col(k) = chunks_[index((begin + k) / kChunk)].col((begin + k) % kChunk);
  return columns;
}

void GrowingColumns::project_out(Eigen::Index begin, const Eigen::MatrixXd& weighed, Eigen::MatrixXd& y,
                                 Eigen::MatrixXd& shares, const ShareWork& share) const {
  for (Eigen::Index at = begin / kChunk * kChunk; at < count_; at += kChunk) {
    const Eigen::MatrixXd& chunk = chunks_[index(at / kChunk)];
    const Eigen::Index size = std::min(kChunk, count_ - at);
    const Eigen::MatrixXd h = narrow_products(chunk, size, weighed, share);
    subtract_narrow(chunk, size, h, y, share);
    shares.middleRows(at, size) += h;
  }
}

Eigen::MatrixXd GrowingColumns::times(const Eigen::MatrixXd& S) const {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(count_ > 0 ? chunks_.front().rows() : 0, S.cols());
  for (Eigen::Index at = 0; at < S.rows(); at += kChunk) {
    const Eigen::Index size = std::min(kChunk, S.rows() - at);
    subtract(chunks_[index(at / kChunk)], size, -S.middleRows(at, size), result);
  }
  return result;
}

BlockLanczos::BlockLanczos(const MassSymmetric& op, Eigen::Index size, int block, unsigned seed)
    : op_(op), size_(size), block_(block), seed_(seed) {
  restart();
}

// Starts a block of random columns. The operator is applied to the columns once, so that massless freedoms
// get the values that the operator gives them   (THEORY 16.37).
bool BlockLanczos::restart() {
  std::mt19937_64 engine(seed_++);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd columns(size_, block_);
  for (double& value : columns.reshaped()) value = normal(engine);
  columns = op_.apply(op_.weigh(columns));
  if (columns.cols() == 0) {
    has_failed_ = true;
    return false;
  }
  Eigen::MatrixXd shares;
  orthonormalise(columns, shares, 0);
  basis_.append(columns);
  return columns.cols() > 0;
}

Eigen::VectorXd BlockLanczos::sizes(const Eigen::MatrixXd& columns) const {
  const Eigen::MatrixXd weighed = op_.weigh(columns);
  return columns.cwiseProduct(weighed).colwise().sum().cwiseMax(0.0).cwiseSqrt();
}

void BlockLanczos::project_out(Eigen::MatrixXd& columns, Eigen::MatrixXd& shares) const {
  const Eigen::MatrixXd weighed = op_.weigh(columns);
  Eigen::MatrixXd known = Eigen::MatrixXd::Zero(op_.known.size(), columns.cols());
  op_.known.project_out(0, weighed, columns, known, op_.share);
  basis_.project_out(0, weighed, columns, shares, op_.share);
}

// Projects the basis from column `first` on out of the given columns once. Then projects out the known
// columns and the whole basis, until a pass leaves at least half of the length of each column (THEORY 16.37).
Eigen::MatrixXd BlockLanczos::orthonormalise(Eigen::MatrixXd& columns, Eigen::MatrixXd& shares,
                                             Eigen::Index first) {
  constexpr int kMostPasses = 3;
  const Eigen::VectorXd before = sizes(columns);
  shares = Eigen::MatrixXd::Zero(basis_.size(), columns.cols());
  basis_.project_out(first, op_.weigh(columns), columns, shares, op_.share);
  Eigen::VectorXd left = sizes(columns);
  for (int pass = 0; pass < kMostPasses; ++pass) {
    project_out(columns, shares);
    const Eigen::VectorXd now = sizes(columns);
    const bool is_enough =
        (now.array() >= kEnoughLeft * left.array() || now.array() <= kNothingNew * before.array()).all();
    left = now;
    if (is_enough) break;
  }
  return orthonormalise_block(columns, before);
}

// Divides each column of a block by the length that the column had before projection. Then orthonormalises
// the block by the eigenvectors of its Gram matrix, in two passes.
Eigen::MatrixXd BlockLanczos::orthonormalise_block(Eigen::MatrixXd& columns, const Eigen::VectorXd& before) {
  constexpr double kGrown = 500.0;  // [-] largest ratio of two lengths in a block without another projection
  const Eigen::VectorXd scale = before.unaryExpr([](double size) { return size > 0.0 ? 1.0 / size : 0.0; });
  columns = (columns * scale.asDiagonal()).eval();
  Eigen::MatrixXd R = before.asDiagonal();
  for (int pass = 0; pass < 2 && columns.cols() > 0; ++pass) {
    const Eigen::MatrixXd weighed = op_.weigh(columns);
    const Eigen::MatrixXd gram = columns.transpose() * weighed;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(gram);
    std::vector<Eigen::Index> kept;
    const double least = pass == 0 ? kNothingNew * kNothingNew : 0.25;
    for (Eigen::Index k = 0; k < columns.cols(); ++k)
      if (eigen.eigenvalues()[k] > least) kept.push_back(k);
    const Eigen::VectorXd roots = eigen.eigenvalues()(kept).cwiseSqrt();
    const Eigen::MatrixXd rotation = eigen.eigenvectors()(Eigen::all, kept);
    columns = (columns * rotation * roots.cwiseInverse().asDiagonal()).eval();
    R = (roots.asDiagonal() * rotation.transpose() * R).eval();
    // after division by its length, a short direction contains enlarged rounding errors of the long
    // directions, which lie along the known columns and the basis and are projected out
    if (pass == 0 && !kept.empty() && roots[roots.size() - 1] > kGrown * roots[0]) {
      Eigen::MatrixXd shares = Eigen::MatrixXd::Zero(basis_.size(), columns.cols());
      project_out(columns, shares);
    }
  }
  return R;
}

bool BlockLanczos::step() {
  if (has_failed_ || is_complete_) return false;
  if (last_ == basis_.size() && !restart()) {
    is_complete_ = !has_failed_;
    return false;
  }
  const Eigen::Index size = basis_.size() - last_;
  Eigen::MatrixXd columns = op_.apply(op_.weigh(basis_.range(last_, size)));
  if (columns.cols() == 0) {
    has_failed_ = true;
    return false;
  }
  Eigen::MatrixXd shares;
  next_ = orthonormalise(columns, shares, last_begin_);
  const auto make_room = [&] {
    if (projected_.rows() < basis_.size())
      projected_.conservativeResizeLike(Eigen::MatrixXd::Zero(2 * basis_.size(), 2 * basis_.size()));
  };
  make_room();
  projected_.block(0, last_, basis_.size(), size) = shares;
  last_begin_ = last_;
  last_ = basis_.size();
  basis_.append(columns);
  make_room();
  projected_.block(last_, last_begin_, next_.rows(), size) = next_;
  return true;
}

RitzPairs BlockLanczos::pairs(double tolerance) const {
  RitzPairs found;
  const Eigen::Index known = last_;
  Eigen::MatrixXd T = projected_.topLeftCorner(known, known);
  // T is symmetric, but each off-diagonal entry was computed twice, with different rounding errors
  T = (0.5 * (T + T.transpose())).eval();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(T);
  std::vector<Eigen::Index> order(index(known));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) {
    return std::abs(eigen.eigenvalues()[a]) > std::abs(eigen.eigenvalues()[b]);
  });
  found.theta = eigen.eigenvalues()(order);
  found.shares = eigen.eigenvectors()(Eigen::all, order);
  found.error =
      next_.rows() == 0
          ? Eigen::VectorXd::Zero(known)
          : Eigen::VectorXd((next_ * found.shares.middleRows(last_begin_, next_.cols())).colwise().norm());
  const double rounding =
      16.0 * std::numeric_limits<double>::epsilon() * (known > 0 ? std::abs(found.theta[0]) : 0.0);
  while (found.num_converged < known &&
         found.error[found.num_converged] <=
             std::max(tolerance * std::abs(found.theta[found.num_converged]), rounding))
    ++found.num_converged;
  return found;
}

}  // namespace freeflex
