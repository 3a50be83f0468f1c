// What to name when the numbers of a scene overflow: the value that is farthest from one.
#pragma once

#include <string>

#include "core/model/scene.hpp"

namespace freeflex {

/// A value of a scene, and where it was written.
struct Extreme {
  Origin origin;
  std::string what;  // "link 'q': EA of 1e+308 N"
};

/// The value of a scene whose logarithm is largest in size: masses and what links are made of, and of
/// damping, feedback, attractor, loads and initial motion what is above one.  \pre check_physics found no
/// error
Extreme most_extreme(const Scene& scene);

/// Adds the error `problem`, which overflow or underflow made, at the most extreme value.
void add_overflow(const Scene& scene, const std::string& problem, Faults& faults);

}  // namespace freeflex
