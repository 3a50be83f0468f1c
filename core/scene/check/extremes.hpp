// Finds the value to report if a computation with the numbers of a scene overflows. It is the value farthest
// from one on a logarithmic scale.
#pragma once

#include <string>

#include "core/scene/scene.hpp"

namespace freeflex {

/// Reports `problem`, an overflow or underflow, as an error at the position of the most extreme value of the
/// scene, whose logarithm is largest in magnitude. Small values are compared only of masses, frequencies of
/// loads, and those parameters of links that cause an overflow if they are small. All other values are
/// compared only if they are above one in magnitude. \pre check_physics found no error
void add_overflow(const Scene& scene, const std::string& problem, Faults& faults);

}  // namespace freeflex
