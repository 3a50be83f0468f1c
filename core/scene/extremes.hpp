// If the numbers of a scene overflow, this code finds the value to report. It is the value that is farthest
// from one on a logarithmic scale.
#pragma once

#include <string>

#include "core/scene/scene.hpp"

namespace freeflex {

/// Reports `problem`, an overflow or underflow. The error has the position of the most extreme value of the
/// scene. The logarithm of this value is largest in magnitude. Masses and parameters of links are compared,
/// but values of damping, feedback, attractor, loads and initial motion are compared only if they are above
/// one. \pre check_physics found no error
void add_overflow(const Scene& scene, const std::string& problem, Faults& faults);

}  // namespace freeflex
