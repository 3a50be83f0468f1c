// Solves small dense systems of linear equations by Gaussian elimination with partial pivoting. The callers
// give the number of the equation that they solve.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>

#include "core/index.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

/// Replaces a matrix by its factors L U, with the largest element of each column as the pivot. Returns the
/// smallest pivot divided by the largest, which is NaN or 0 if the matrix has no inverse.
/// \param F  (n x n) row-major, n = pivots.size()
inline double factor_dense(double* F, std::span<std::int32_t> pivots) noexcept {
  const std::size_t n = pivots.size();
  double largest = 0.0, least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t pivot = k;
    for (std::size_t i = k + 1; i < n; ++i)
      if (magnitude(F[i * n + k]) > magnitude(F[pivot * n + k])) pivot = i;
    pivots[k] = static_cast<std::int32_t>(pivot);
    if (pivot != k)
      for (std::size_t j = 0; j < n; ++j) std::swap(F[k * n + j], F[pivot * n + j]);
    largest = std::max(largest, magnitude(F[k * n + k]));
    least = std::min(least, magnitude(F[k * n + k]));
    for (std::size_t i = k + 1; i < n; ++i) {
      const double share = F[i * n + k] / F[k * n + k];
      F[i * n + k] = share;
      for (std::size_t j = k + 1; j < n; ++j) F[i * n + j] -= share * F[k * n + j];
    }
  }
  return least / largest;
}

/// Replaces the right side x (n) by the solution.  \param F, pivots  from factor_dense()
inline void solve_dense(const double* F, std::span<const std::int32_t> pivots, double* x) noexcept {
  const std::size_t n = pivots.size();
  for (std::size_t k = 0; k < n; ++k) std::swap(x[k], x[index(pivots[k])]);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < i; ++j) x[i] -= F[i * n + j] * x[j];
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t j = i + 1; j < n; ++j) x[i] -= F[i * n + j] * x[j];
    x[i] /= F[i * n + i];
  }
}

}  // namespace freeflex
