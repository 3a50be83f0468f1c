#include "core/structure/modes/sparse/narrow_products.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <vector>

#include "core/widths.hpp"

namespace freeflex {
namespace {

using Eigen::Index;

constexpr int kLanes = 8;       // sums of a product, and of all widths of registers
constexpr Index kRows = 512;    // rows at once, of which eight vectors stay in the first cache
constexpr int kParts = 16;      // parts of the rows
constexpr Index kTogether = 2;  // columns of x at once

struct Columns {
  const double* x;
  Index stride, count;
};

/// Adds x^T y over `rows` rows to sums. x has kColumns columns and y has kVectors; the sum of column j of x
/// and column k of y is sums[k * sums_stride + j].
template <class V, int kVectors, int kColumns>
FREEFLEX_KERNEL void add_products(const double* x, Index stride, const double* y, Index y_stride, Index rows,
                                  double* sums, Index sums_stride) noexcept {
  constexpr Index kWidth = sizeof(V) / sizeof(double), kChunks = kLanes / kWidth;
  V sum[kVectors][kColumns][kChunks]{};
  Index i = 0;
  for (; i + kLanes <= rows; i += kLanes)
    for (Index c = 0; c < kChunks; ++c) {
      V of_x[kColumns];
      for (int j = 0; j < kColumns; ++j) std::memcpy(&of_x[j], x + j * stride + i + c * kWidth, sizeof(V));
      for (int k = 0; k < kVectors; ++k) {
        V of_y;
        std::memcpy(&of_y, y + k * y_stride + i + c * kWidth, sizeof(V));
        for (int j = 0; j < kColumns; ++j) sum[k][j][c] += of_x[j] * of_y;
      }
    }
  for (int k = 0; k < kVectors; ++k)
    for (int j = 0; j < kColumns; ++j) {
      double s[kLanes];
      std::memcpy(s, sum[k][j], sizeof(s));
      double total = ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
      for (Index l = i; l < rows; ++l) total += x[j * stride + l] * y[k * y_stride + l];
      sums[k * sums_stride + j] += total;
    }
}

/// Subtracts kColumns columns of x times h (kColumns values for each vector) from `rows` rows of a vector.
template <class V, int kColumns>
FREEFLEX_KERNEL void subtract_columns(const double* x, Index stride, const double* h, Index rows,
                                      double* y) noexcept {
  constexpr Index kWidth = sizeof(V) / sizeof(double);
  Index i = 0;
  for (; i + kWidth <= rows; i += kWidth) {
    V sum, of_x;
    std::memcpy(&sum, y + i, sizeof(V));
    for (int j = 0; j < kColumns; ++j) {
      std::memcpy(&of_x, x + j * stride + i, sizeof(V));
      sum -= of_x * h[j];
    }
    std::memcpy(y + i, &sum, sizeof(V));
  }
  for (; i < rows; ++i)
    for (int j = 0; j < kColumns; ++j) y[i] -= x[j * stride + i] * h[j];
}

/// Does `work` on pieces of kMost of `count`, and on one smaller piece:
///   work(first, std::integral_constant<int, size>)
template <int kMost, class Work>
FREEFLEX_KERNEL void in_pieces(Index count, const Work& work) noexcept {
  Index first = 0;
  for (; first + kMost <= count; first += kMost) work(first, std::integral_constant<int, kMost>());
  if constexpr (kMost > 1)
    if (first < count)
      in_pieces<kMost - 1>(count - first, [&](Index at, auto size) { work(first + at, size); });
}

template <class V, int kVectors>
FREEFLEX_KERNEL void add_products_of(Columns of, const double* y, Index y_stride, Index rows,
                                     double* sums) noexcept {
  for (Index at = 0; at < rows; at += kRows) {
    const Index size = std::min(kRows, rows - at);
    in_pieces<kTogether>(of.count, [&](Index j, auto columns) {
      add_products<V, kVectors, columns()>(of.x + j * of.stride + at, of.stride, y + at, y_stride, size,
                                           sums + j, of.count);
    });
  }
}

template <class V>
FREEFLEX_KERNEL void add_all_products(Columns of, const double* y, Index y_stride, Index vectors, Index rows,
                                      double* sums) noexcept {
  in_pieces<kMostNarrow>(vectors, [&](Index k, auto some) {
    add_products_of<V, some()>(of, y + k * y_stride, y_stride, rows, sums + k * of.count);
  });
}

template <class V>
FREEFLEX_KERNEL void subtract_all(Columns of, const double* h, double* y, Index y_stride, Index vectors,
                                  Index rows) noexcept {
  for (Index at = 0; at < rows; at += kRows) {
    const Index size = std::min(kRows, rows - at);
    in_pieces<4>(of.count, [&](Index j, auto columns) {
      for (Index k = 0; k < vectors; ++k)
        subtract_columns<V, columns()>(of.x + j * of.stride + at, of.stride, h + k * of.count + j, size,
                                       y + k * y_stride + at);
    });
  }
}

using Pair = double __attribute__((vector_size(16)));
using Quad = double __attribute__((vector_size(32)));
using Oct = double __attribute__((vector_size(64)));

/// Returns the first row of a part; part kParts begins after the last row.
Index first_row(Index rows, int part) {
  return rows * part / kParts / kLanes * kLanes + (part == kParts ? rows % kLanes : 0);
}

}  // namespace

void run_shared(const ShareWork& share, int count, const std::function<void(int)>& work) {
  if (share) return share(count, work);
  for (int k = 0; k < count; ++k) work(k);
}

Eigen::MatrixXd narrow_products(const Eigen::MatrixXd& x, Index count, const Eigen::MatrixXd& y,
                                const ShareWork& share) {
  assert(y.cols() <= kMostNarrow);
  std::vector<Eigen::MatrixXd> of_part(kParts, Eigen::MatrixXd::Zero(count, y.cols()));
  run_shared(share, kParts, [&](int part) {
    const Index begin = first_row(x.rows(), part), end = first_row(x.rows(), part + 1);
    run_widest<add_all_products<Pair>, add_all_products<Quad>, add_all_products<Oct>>(
        Columns{x.data() + begin, x.outerStride(), count}, y.data() + begin, y.outerStride(), y.cols(),
        end - begin, of_part[static_cast<std::size_t>(part)].data());
  });
  for (int part = 1; part < kParts; ++part) of_part[0] += of_part[static_cast<std::size_t>(part)];
  return of_part[0];
}

void subtract_narrow(const Eigen::MatrixXd& x, Index count, const Eigen::MatrixXd& h, Eigen::MatrixXd& y,
                     const ShareWork& share) {
  run_shared(share, kParts, [&](int part) {
    const Index begin = first_row(x.rows(), part), end = first_row(x.rows(), part + 1);
    run_widest<subtract_all<Pair>, subtract_all<Quad>, subtract_all<Oct>>(
        Columns{x.data() + begin, x.outerStride(), count}, h.data(), y.data() + begin, y.outerStride(),
        y.cols(), end - begin);
  });
}

}  // namespace freeflex
