// The force of a spring, bar or dashpot at true length and direction.
#pragma once

#include "core/step/plan/coupled.hpp"

namespace freeflex {

/// Holds the force of a bar at true length and direction.
struct BarForce {
  double tension = 0.0;  // [N]
  Vec3 excess{};         // [N] force on the first point, minus the force of the linear bar
};
/// Returns the force of a bar. Here d = V_second - V_first, L is the rest length and u the rest direction:
///   tension s = D (l - L),   l - L = (2 L u.d + d.d) / (l + L),   l = |L u + d|   (THEORY 12.17)
///   excess s (L u + d) / l - D (u.d) u   (THEORY 12.18)
BarForce bar_force(const PlanBar& bar, const Vec3& d) noexcept;
/// Returns the elastic force on the first point [N].
Vec3 elastic_force(const PlanBar& bar, const Vec3& d) noexcept;
/// Returns that of the linear bar, D (u.d) u.
inline Vec3 linear_elastic_force(const PlanBar& bar, const Vec3& d) noexcept {
  return scale(bar.stiffness * dot(bar.direction, d), bar.direction);
}
/// Returns the damping force of a bar or dashpot, from the rate d' of d in body axes, which does not include
/// the spin of the body:
///   s = c (L u + d).d' / l,   excess s (L u + d) / l - c (u.d') u   (THEORY 12.19)
BarForce damper_force(const PlanBar& bar, const Vec3& d, const Vec3& d_dot) noexcept;

}  // namespace freeflex
