// The arrays over modes, their padding and their indices.
#pragma once

#include <concepts>
#include <cstddef>
#include <new>
#include <vector>

namespace freeflex {

/// Memory that starts on a cache line, so that no vector register, up to the widest, is loaded from two.
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

/// Modes are padded to a multiple of this with zeros; reductions run in this many fixed lanes.
inline constexpr int kLanes = 8;

/// The least multiple of kLanes that is not below n.
template <std::integral Count>
constexpr Count pad(Count n) noexcept {
  constexpr Count kMultiple{kLanes};
  return (n + kMultiple - 1) / kMultiple * kMultiple;
}

/// Plans count in 32 bits and Eigen in signed ones, containers in std::size_t.  \pre i >= 0
template <std::signed_integral Signed>
constexpr std::size_t index(Signed i) noexcept {
  return static_cast<std::size_t>(i);
}

/// Doubles for each mode, or rows of them: num_padded is a multiple of kLanes, so every row starts on a line.
using Array = std::vector<double, CacheLineAllocator<double>>;

}  // namespace freeflex
