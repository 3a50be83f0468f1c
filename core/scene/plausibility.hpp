// Values that can be computed with, and that no structure is likely to have: most are in another unit.
#pragma once

#include "core/scene/scene.hpp"

namespace freeflex {

/// Appends a warning for each cause, at the first link that has it, with the number of the others: a modulus
/// or density that no solid has, a plate that is thicker than wide, lengths a million times a million apart.
/// \pre check_scene found no error
void warn_of_implausible(const Scene& scene, Faults& faults);

}  // namespace freeflex
