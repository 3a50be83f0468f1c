// Reference values of the stability table.
#pragma once

#include <array>
#include <span>

#include "core/scene/scene.hpp"

namespace freeflex::tools {

/// A scene and its lowest elastic frequency. The frequency was computed in sixty-digit arithmetic from the
/// exact doubles of the scene, by cyclic Jacobi rotations on M^-1/2 K M^-1/2
/// (tests/support/exact_frequencies.hpp). A test repeats the computation.
struct FrequencyAnswer {
  const char* group;
  const char* name;
  Scene (*make)(double, double);
  double first, second;  // arguments of `make`
  const char* lowest;    // [rad/s] 25 digits
  double limit;          // [-] relative error that must be met
};
std::span<const FrequencyAnswer> frequency_answers();

/// Returns the attitude w x y z, after 20 / spin [s], of a body with moments 2, 3 and 4 kg m^2 that starts to
/// rotate about an axis 0.01 rad from its intermediate axis. The attitude was computed by Taylor series of
/// order 48 of Euler's equations in fifty digits (tests/support/wide_rotation.hpp). It is the same at every
/// spin, except for the rounding errors of the initial angular velocity (0.01, 1, 0.005) times the spin.
const std::array<const char*, 4>& intermediate_axis_attitude();

}  // namespace freeflex::tools
