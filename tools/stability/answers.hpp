// Constants that the stability table is held to.
#pragma once

#include <array>
#include <span>

#include "core/scene/scene.hpp"

namespace freeflex::tools {

/// Scene and its lowest elastic frequency. Computed once in sixty-digit arithmetic from the exact doubles of
/// the scene, by cyclic Jacobi rotations on M^-1/2 K M^-1/2 (tests/support/exact_frequencies.hpp; tests/tools
/// computes them anew).
struct FrequencyAnswer {
  const char* group;
  const char* name;
  Scene (*make)(double, double);
  double first, second;  // arguments of make
  const char* lowest;    // [rad/s] 25 digits
  double limit;          // [-] relative error that must be met
};
std::span<const FrequencyAnswer> frequency_answers();

/// Attitude w x y z of a body of moments 2, 3 and 4 kg m^2 that starts 0.01 rad beside its middle axis, 20 /
/// spin [s] later: by Taylor series of order 48 of Euler's equations in fifty digits
/// (tests/support/wide_rotation.hpp). The same at every spin, but for the rounding of the components of the
/// spin, (0.01, 1, 0.005) times it.
const std::array<const char*, 4>& middle_axis_attitude();

}  // namespace freeflex::tools
