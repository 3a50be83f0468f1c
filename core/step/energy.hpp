// The energy of free rotation, kept to the last bit over any number of ticks (THEORY X204).
#pragma once

#include "core/step/state.hpp"

namespace freeflex {

/// Turns the body by some 1e-12 rad, so that it has the energy of rotation that it had before the tick: takes
/// away what the flows err by, and what rounding of the attitude is times a momentum that may be mostly that
/// of wheels. Leaves a body alone that spins about a principal axis.
/// \pre no moment acts in the tick  \param h  [N m s] of wheels, body axes
void restore_energy(const Plan& plan, const Frame& from, const Vec3& h, Frame& to) noexcept;

}  // namespace freeflex
