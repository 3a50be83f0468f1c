// The part of a plan that the motion of the floating frame reads.
#pragma once

#include <cstdint>

#include "core/step/vector.hpp"

namespace freeflex {

/// Holds the principal axes   (THEORY 7.14). set_principal computes them from Plan::inverse_inertia, so plan
/// files do not contain them.
struct PlanPrincipal {
  Mat3 R_PB{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};  // [-] the rows are the axes, in body axes
  Vec3 inverse_moment{};  // [1/(kg m^2)] largest first; zero for an axis about which the body has no inertia
  bool operator==(const PlanPrincipal&) const = default;
};

/// Holds the rigid body and the fields that act on it.
struct PlanFrame {
  double mass = 0.0;  // [kg]
  std::int32_t rigid_freedoms = 6;
  Vec3 p_SB{};             // [m] centre of mass in scene axes
  Mat3 inertia{};          // [kg m^2] body axes
  Mat3 inverse_inertia{};  // [1/(kg m^2)] pseudo-inverse for collinear shapes, zero for one point
  Vec3 line{};             // [-] unit vector of a collinear shape, else zero
  PlanPrincipal principal;
  Vec3 gravity_W{};                              // [m/s^2]
  double attractor_mu = 0.0;                     // [m^3/s^2] 0: no attractor   (THEORY 8.17)
  Vec3 attractor_W{};                            // [m]
  bool has_gravity = true, has_rotation = true;  // false: omitted   (THEORY section 14)
};

}  // namespace freeflex
