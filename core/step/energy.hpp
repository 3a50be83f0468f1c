// Keeps the energy of free rotation over any number of ticks (THEORY 7.30, 7.31).
#pragma once

#include "core/step/state.hpp"

namespace freeflex {

/// Rotates the body by some 1e-12 rad, so that its rotational energy becomes equal to its rotational energy
/// before the tick:
///   dE = 1/2 sum_i (H_i^1 - H_i^0) (H_i^0 + H_i^1 - 2 h_i) / I_i   (THEORY 7.30)
///   d_theta = -dE / |w x H|^2 w x H   (THEORY 7.31)
/// dE contains the error of the composition and the rounding error of the attitude, multiplied by the angular
/// momentum. Most of this angular momentum may be in wheels. A body that spins about a principal axis is not
/// rotated.
/// \pre no moment acts in the tick  \param h  [N m s] momentum of the wheels, body axes
void restore_energy(const Plan& plan, const Frame& from, const Vec3& h, Frame& to) noexcept;

}  // namespace freeflex
