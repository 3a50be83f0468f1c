// How an error grows within a horizon that is judged, and what it may become while horizons are not judged.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace freeflex {

/// Holds the largest error and the largest load in each quarter of the present horizon   (THEORY 15.6).
class Growth {
 public:
  void clear() noexcept { errors_ = loads_ = {}; }
  /// Takes the error after a step of the shadow, as a multiple of its limit [-], and the size of the loads
  /// [N].  \param ticks  ticks since the horizon began, from 1 to `all`
  void take(std::int64_t ticks, std::int64_t all, double error, double load) noexcept;
  /// Returns whether the error grew faster than by a power of time in the horizon that ends now, and would
  /// exceed its limit within the next `horizons` if it grew on by the same factor in each.
  bool may_exceed(std::int64_t horizons) const noexcept;

 private:
  std::size_t quarter_ = 0;                   // of the last error
  std::array<double, 4> errors_{}, loads_{};  // [-], [N] the largest of each quarter
};

}  // namespace freeflex
