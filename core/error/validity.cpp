#include "core/error/validity.hpp"

#include <algorithm>
#include <cmath>

namespace freeflex {

double norm(const Vec3& v) noexcept { return std::hypot(v[0], v[1], v[2]); }

double bounded_ratio(double numerator, double denominator) noexcept {
  constexpr double kLargest = 1e9;  // published instead of an unbounded ratio
  return numerator == 0.0 ? 0.0 : std::min(numerator / denominator, kLargest);
}

double lowest_omega(const Plan& plan) noexcept {
  double lowest = 0.0;
  const auto look = [&lowest](const StepPlan& each) {
    for (const double omega : each.omega)
      if (omega > 0.0 && (lowest == 0.0 || omega < lowest)) lowest = omega;
  };
  look(plan);
  for (const StepPlan& fallback : plan.fallback) look(fallback);
  return lowest;
}

Validity::Validity(const Plan& plan) : plan_(plan), omega_1_(lowest_omega(plan)) {
  for (const PlanPoint& point : plan.points) size_ = std::max(size_, norm(point.r));
}

double Validity::max_displacement(const MotionState& state) const noexcept {
  double largest = 0.0;
  for (const std::int32_t point : plan_.published_points)
    largest = std::max(largest, norm(read_point(plan_, state, point).V_B));
  return largest;
}

double Validity::displacement_ratio(double max_displacement) const noexcept {
  return size_ > 0.0 ? max_displacement / size_ : 0.0;
}

double Validity::spin_ratio(double spin, double max_displacement) const noexcept {
  if (omega_1_ == 0.0) return 0.0;
  return bounded_ratio(spin * spin / (omega_1_ * omega_1_) * size_, max_displacement);
}

}  // namespace freeflex
