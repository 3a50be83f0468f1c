// Lowest frequencies that the stability table is held to.
#pragma once

#include <span>

#include "core/model/scene.hpp"

namespace freeflex::tools {

/// Scene and its lowest elastic frequency. Computed once in sixty-digit arithmetic from the exact doubles of the scene,
/// by cyclic Jacobi rotations on M^-1/2 K M^-1/2 (tests/support/exact_frequencies.hpp; tests/tools computes them anew).
struct FrequencyAnswer {
  const char* group;
  const char* name;
  Scene (*make)(double, double);
  double first, second;  // arguments of make
  const char* lowest;    // [rad/s] 25 digits
  double limit;          // [-] relative error that must be met
};
std::span<const FrequencyAnswer> frequency_answers();

}  // namespace freeflex::tools
