// Links side by side in blocks of kLanes. In a block each value is a row with one column for each link, so
// that the compiler puts a loop over the columns into vector registers.
#pragma once

#include "core/step/array.hpp"
#include "core/step/vector.hpp"
#include "core/widths.hpp"

namespace freeflex {

inline constexpr std::size_t kBlock = kLanes;

/// Returns the column of a link in blocks of `rows` rows.
template <class Real>
Real* column_of(Real* blocks, std::size_t link, std::size_t rows) noexcept {
  return blocks + link / kBlock * (rows * kBlock) + link % kBlock;
}
FREEFLEX_KERNEL double entry(const double* column, std::size_t row) noexcept { return column[row * kBlock]; }
FREEFLEX_KERNEL Vec3 vector_at(const double* column, std::size_t row) noexcept {
  return {entry(column, row), entry(column, row + 1), entry(column, row + 2)};
}
FREEFLEX_KERNEL void put(double value, double* column, std::size_t row) noexcept {
  column[row * kBlock] = value;
}
FREEFLEX_KERNEL void put(const Vec3& v, double* column, std::size_t row) noexcept {
  put(v[0], column, row), put(v[1], column, row + 1), put(v[2], column, row + 2);
}

}  // namespace freeflex
