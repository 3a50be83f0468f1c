// The arrays over modes.
#pragma once

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

/// Doubles for each mode, or rows of them: num_padded is a multiple of kLanes, so every row starts on a line.
using Array = std::vector<double, CacheLineAllocator<double>>;

}  // namespace freeflex
