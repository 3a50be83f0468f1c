// What to name when the numbers of a scene overflow: the value that is farthest from one.
#pragma once

#include <string>

#include "core/scene/scene.hpp"

namespace freeflex {

/// Adds the error `problem`, which overflow or underflow made, at the value of the scene whose logarithm is
/// largest in size: of masses and of what links are made of, and of damping, feedback, attractor, loads and
/// initial motion what is above one.  \pre check_physics found no error
void add_overflow(const Scene& scene, const std::string& problem, Faults& faults);

}  // namespace freeflex
