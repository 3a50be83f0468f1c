#include "service/validity.hpp"

#include <algorithm>
#include <cmath>

namespace freeflex::service {

double norm(const Vec3& v) noexcept { return std::hypot(v[0], v[1], v[2]); }

double bounded_ratio(double numerator, double denominator) noexcept {
  constexpr double kLargest = 1e9;  // what an unbounded ratio is published as
  return numerator == 0.0 ? 0.0 : std::min(numerator / denominator, kLargest);
}

Validity::Validity(const Plan& plan) : plan_(plan) {
  const auto note_lowest = [this](const Plan& of) {
    for (const double omega : of.omega)
      if (omega > 0.0 && (omega_1_ == 0.0 || omega < omega_1_)) omega_1_ = omega;
  };
  note_lowest(plan);
  std::ranges::for_each(plan.wide, note_lowest);
  for (const PlanPoint& point : plan.points) size_ = std::max(size_, norm(point.r));
}

double Validity::max_displacement(const State& state) const noexcept {
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

}  // namespace freeflex::service
