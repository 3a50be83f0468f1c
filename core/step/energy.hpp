// Correction of the attitude that keeps the energy of free rotation constant over any number of ticks
// (THEORY 7.30, 7.31).
#pragma once

#include "core/step/state.hpp"

namespace freeflex {

/// Rotates the body by about 1e-12 rad, so that its rotational energy after the tick equals that before the
/// tick. dE is the error of the energy:
///   dE = 1/2 sum_i (H_i^1 - H_i^0) (H_i^0 + H_i^1 - 2 h_i) / I_i   (THEORY 7.30)
///   d_theta = -dE / |w x H|^2 w x H   (THEORY 7.31)
/// dE contains the error of the composition, and the rounding error of the attitude times the angular
/// momentum, most of which may be that of wheels. A body that spins about a principal axis is not rotated.
/// \param h  [N m s] momentum of the wheels, body axes
/// \pre no moment acts in the tick
void restore_energy(const StepPlan& plan, const Frame& from, const Vec3& h, Frame& to) noexcept;

}  // namespace freeflex
