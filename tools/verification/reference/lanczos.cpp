#include "tools/verification/reference/lanczos.hpp"

#include <algorithm>
#include <cmath>

#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

double value(WaveFunction function, double x) {
  switch (function) {
    case WaveFunction::kCos:
      return std::cos(x);
    case WaveFunction::kSinc:
      return x > 1e-4 ? std::sin(x) / x : 1.0 - x * x / 6.0;
    case WaveFunction::kConstant: {
      const double s = x > 1e-4 ? std::sin(0.5 * x) / (0.5 * x) : 1.0 - x * x / 24.0;
      return 0.5 * s * s;
    }
    case WaveFunction::kRising:
      // for x below 0.1 the difference 1 - sin x / x loses digits, so a series is used
      if (x > 0.1) return (1.0 - std::sin(x) / x) / (x * x);
      const double s = x * x;
      return (1.0 - s / 20.0 * (1.0 - s / 42.0 * (1.0 - s / 72.0))) / 6.0;
  }
  return 0.0;
}

}  // namespace

bool LanczosSpace::build(const Apply& apply, const Eigen::VectorXd& b, double h, std::span<const Term> terms,
                         int max_size, bool is_reorthogonalised) {
  // [-] a next vector that is shorter than this fraction of the largest entry of the tridiagonal matrix is a
  // rounding error
  constexpr double kExhausted = 1e-13;
  size_ = num_applied_ = 0;
  norm_ = b.norm();
  if (norm_ == 0.0) return true;
  if (basis_.rows() != b.size() || basis_.cols() < max_size + 1) basis_.resize(b.size(), max_size + 1);
  diagonal_.resize(max_size);
  off_diagonal_.resize(max_size);
  basis_.col(0) = b / norm_;
  int next_check = 10;
  double largest = 0.0;
  for (int m = 0; m < max_size; ++m) {
    auto w = basis_.col(m + 1);
    apply(basis_.col(m).data(), w.data());
    ++num_applied_;
    if (m > 0) w -= off_diagonal_[m - 1] * basis_.col(m - 1);
    diagonal_[m] = basis_.col(m).dot(w);
    w -= diagonal_[m] * basis_.col(m);
    if (is_reorthogonalised) w -= basis_.leftCols(m + 1) * (basis_.leftCols(m + 1).transpose() * w);
    off_diagonal_[m] = w.norm();
    size_ = m + 1;
    largest = std::max({largest, diagonal_[m], off_diagonal_[m]});
    const bool is_exhausted = off_diagonal_[m] <= kExhausted * largest;
    if (!is_exhausted) w /= off_diagonal_[m];
    if (!is_exhausted && size_ < next_check && size_ < max_size) continue;
    next_check = size_ + std::max(4, size_ / 3);
    diagonalise();
    if (is_exhausted) return true;
    const bool is_enough = std::all_of(terms.begin(), terms.end(), [&](const Term& term) {
      const Eigen::VectorXd c = coefficients(term.function, h);
      return term.factor * norm_ * std::max(std::abs(c[size_ - 1]), std::abs(c[size_ - 2])) <= term.tolerance;
    });
    if (is_enough) return true;
  }
  return false;
}

void LanczosSpace::diagonalise() {
  // Eigen scales a full matrix before it iterates, but not a tridiagonal matrix. Without scaling the
  // iteration may not converge, so the matrix is scaled here
  const double scale = diagonal_.head(size_).cwiseAbs().maxCoeff();
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(diagonal_.head(size_) / scale, off_diagonal_.head(size_ - 1) / scale);
  root_ = (scale * solver.eigenvalues()).cwiseMax(0.0).cwiseSqrt();
  vectors_ = solver.eigenvectors();
}

Eigen::VectorXd LanczosSpace::coefficients(WaveFunction function, double h) const {
  Eigen::VectorXd weights(size_);
  for (int k = 0; k < size_; ++k) weights[k] = value(function, h * root_[k]) * vectors_(0, k);
  return vectors_ * weights;
}

void LanczosSpace::add(WaveFunction function, double h, double factor, Eigen::VectorXd& sum) const {
  if (norm_ == 0.0) return;
  sum.noalias() += basis_.leftCols(size_) * (factor * norm_ * coefficients(function, h));
}

}  // namespace freeflex
