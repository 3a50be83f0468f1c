// This file defines the type and the padding of arrays over modes.
#pragma once

#include <concepts>
#include <cstddef>
#include <new>
#include <vector>

#include "core/index.hpp"

namespace freeflex {

/// Allocates memory that starts on a cache line, so that no vector register, of any width, is loaded from two
/// lines.
template <class T>
struct CacheLineAllocator {
  using value_type = T;
  static constexpr std::align_val_t kCacheLine{64};
  CacheLineAllocator() = default;
  template <class U>
  CacheLineAllocator(const CacheLineAllocator<U>&) noexcept {}
  T* allocate(std::size_t n) { return static_cast<T*>(::operator new(n * sizeof(T), kCacheLine)); }
  void deallocate(T* memory, std::size_t) noexcept { ::operator delete(memory, kCacheLine); }
  bool operator==(const CacheLineAllocator&) const = default;
};

/// The number of modes is padded with zeros to a multiple of this number. Sums over modes are accumulated in
/// this number of partial sums (lanes), independently of the width of registers.
inline constexpr int kLanes = 8;

/// Returns the smallest multiple of kLanes that is >= n.
template <std::integral Count>
constexpr Count pad(Count n) noexcept {
  constexpr Count kMultiple{kLanes};
  return (n + kMultiple - 1) / kMultiple * kMultiple;
}

/// Holds one double for each mode, or several rows of such values. num_padded is a multiple of kLanes, so
/// every row starts on a cache line.
using Array = std::vector<double, CacheLineAllocator<double>>;

/// Returns whether all values are finite.
inline bool are_finite(const Array& values) noexcept {
  double sum = 0.0;
  for (const double x : values) sum += x - x;
  return sum == 0.0;
}

}  // namespace freeflex
