// Finds the value to report if the numbers of a scene overflow: the value that differs from one by the
// largest factor.
#pragma once

#include <string>

#include "core/scene/scene.hpp"

namespace freeflex {

/// Adds the error `problem`, caused by overflow or underflow, at the value of the scene with the largest
/// absolute logarithm. Masses and parameters of links are compared; values of damping, feedback, attractor,
/// loads and initial motion are compared only if they are above one.  \pre check_physics found no error
void add_overflow(const Scene& scene, const std::string& problem, Faults& faults);

}  // namespace freeflex
