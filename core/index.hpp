// Conversion of signed integers to indices.
#pragma once

#include <cassert>
#include <concepts>
#include <cstddef>

namespace freeflex {

/// Returns i as an index of a container. Plans use indices of 32 bits, Eigen uses signed integers, and
/// containers use std::size_t.
/// \pre i >= 0
template <std::signed_integral Signed>
constexpr std::size_t index(Signed i) noexcept {
  assert(i >= 0);
  return static_cast<std::size_t>(i);
}

}  // namespace freeflex
