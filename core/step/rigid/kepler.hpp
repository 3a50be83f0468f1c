// Exact free fall towards an attractor (THEORY 7.26 to 7.29).
#pragma once

#include "core/step/vector.hpp"

namespace freeflex {

/// Holds the changes of position and velocity in a fall. The values at the start are not added, so that small
/// changes keep their digits.
struct Fall {
  Vec3 p{};  // [m] change of position
  Vec3 v{};  // [m/s] change of velocity
};

/// Returns the gains of position and velocity under rho'' = -mu rho / |rho|^3 over a time t [s] of either
/// sign:
///   rho^1 - rho^0 = -(mu G_2 / r^0) rho^0 + (t - mu G_3) v^0
///   v^1 - v^0 = -(mu G_1 / (r^0 r^1)) rho^0 - (mu G_2 / r^1) v^0,   r = |rho|   (THEORY 7.29)
/// Universal variables make this valid for any number of revolutions, on an ellipse, a parabola, a hyperbola
/// or a straight line (Stumpff 1947; Danby 1992, 6.9). The error is some 1e-15 of |rho| and of |v| over half
/// a revolution. libm is not used.
/// \param rho  [m] position relative to the attractor at the start, not zero
/// \param v  [m/s] velocity at the start
Fall fall(double mu, const Vec3& rho, const Vec3& v, double t) noexcept;

}  // namespace freeflex
