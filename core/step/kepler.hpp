// Free fall towards an attractor, exactly (THEORY X203).
#pragma once

#include "core/step/vector.hpp"

namespace freeflex {

/// What place and velocity gain, so that slow changes keep their digits.
struct Fall {
  Vec3 p{};  // [m]
  Vec3 v{};  // [m/s]
};

/// The gain of rho'' = -mu rho / |rho|^3 over a time t [s] of either sign, in any number of revolutions, on
/// ellipse, parabola, hyperbola and straight line, by universal variables (Stumpff 1947; Danby 1992, 6.9).
/// Good to some 1e-15 of |rho| and of |v| over half a revolution. No libm.
/// \param rho  [m] from the attractor, not zero  \param v  [m/s]
Fall fall(double mu, const Vec3& rho, const Vec3& v, double t) noexcept;

}  // namespace freeflex
