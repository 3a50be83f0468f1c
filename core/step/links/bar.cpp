#include "core/step/links/bar.hpp"

namespace freeflex {

BarForce bar_force(const PlanBar& bar, const Vec3& d) noexcept {
  const Vec3 x = add_scaled(d, bar.length, bar.direction);
  const double along = dot(bar.direction, d), l = __builtin_sqrt(dot(x, x));
  const double tension = bar.stiffness * ((2.0 * bar.length * along + dot(d, d)) / (l + bar.length));
  return {tension, add_scaled(scale(tension / l, x), -bar.stiffness * along, bar.direction)};
}

Vec3 elastic_force(const PlanBar& bar, const Vec3& d) noexcept {
  return add_scaled(bar_force(bar, d).excess, bar.stiffness * dot(bar.direction, d), bar.direction);
}

BarForce damper_force(const PlanBar& bar, const Vec3& d, const Vec3& d_dot) noexcept {
  const Vec3 x = add_scaled(d, bar.length, bar.direction);
  const double l = __builtin_sqrt(dot(x, x)), tension = bar.damping * (dot(x, d_dot) / l);
  return {tension,
          add_scaled(scale(tension / l, x), -bar.damping * dot(bar.direction, d_dot), bar.direction)};
}

}  // namespace freeflex
