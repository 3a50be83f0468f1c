// Warnings of valid but implausible values, most of which are in a wrong unit.
#pragma once

#include "core/scene/scene.hpp"

namespace freeflex {

/// Appends warnings about a modulus or density outside the range of solids, a section too large for its beam,
/// a plate that is thicker than wide, a body much larger than the structure, a damping ratio above 1, and
/// links whose lengths differ by a factor of 1e12. For each cause that concerns plates or beams there is one
/// warning at the first link with this cause, which gives the number of other links.
/// \pre check_scene found no error
void warn_of_implausible(const Scene& scene, Faults& faults);

}  // namespace freeflex
