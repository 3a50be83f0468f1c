#include "core/error/growth.hpp"

#include <algorithm>

namespace freeflex {

void Growth::take(std::int64_t ticks, std::int64_t all, double error, double load) noexcept {
  const auto quarter = static_cast<std::size_t>(4 * (ticks - 1) / all);
  if (quarter < quarter_) clear();
  quarter_ = quarter;
  errors_[quarter] = std::max(errors_[quarter], error);
  loads_[quarter] = std::max(loads_[quarter], load);
}

bool Growth::may_exceed(std::int64_t horizons) const noexcept {
  // [-] factors from the first quarter to the last, if the error grows as t^2 or, under constant loads, t^3
  constexpr double kSquare = 16.0, kCube = 64.0, kMargin = 1.25;
  // [-] A power of time grows by ever smaller factors from quarter to quarter, t^2 by 4, 2.3 and 1.8. A
  // factor of kLargeFactor or more that is at least kSteady times the factor before belongs to no power of
  // time
  constexpr double kLargeFactor = 3.0, kSteady = 0.8;
  constexpr double kEqual = 1.2;       // [-] other loads may be the cause of the growth
  constexpr double kRounding = 1e-10;  // [-] of the limit
  const auto [least, most] = std::minmax_element(loads_.begin(), loads_.end());
  std::array<double, 4> largest = errors_;  // up to each quarter
  for (std::size_t k = 1; k < 4; ++k) largest[k] = std::max(largest[k], largest[k - 1]);
  if (!(errors_[0] > 0.0) || largest[3] < kRounding || *most > kEqual * *least) return false;
  double growth = largest[3] / largest[0];  // in a horizon
  if (!(growth > kMargin * (*most > 0.0 ? kCube : kSquare))) {
    double factor = 1.0;
    for (std::size_t k = 1; k < 3; ++k) {
      const double next = largest[k + 1] / largest[k];
      if (next >= kSteady * (largest[k] / largest[k - 1])) factor = std::max(factor, next);
    }
    if (factor < kLargeFactor) return false;
    growth = factor * factor * factor * factor;
  }
  double error = largest[3];
  for (std::int64_t k = 0; k < horizons && error <= 1.0; ++k) error *= growth;
  return error > 1.0;
}

}  // namespace freeflex
