// Warnings of valid but implausible values, most of which are in a wrong unit.
#pragma once

#include "core/scene/scene.hpp"

namespace freeflex {

/// Appends one warning for each cause. The warning is reported at the first link with this cause and gives
/// the number of other links. Causes are a modulus or density outside the range of solids, a section too
/// large for its beam, a plate that is thicker than wide, a body larger than the structure, a damping ratio
/// above 1, and lengths in a ratio of 1e12.
/// \pre check_scene found no error
void warn_of_implausible(const Scene& scene, Faults& faults);

}  // namespace freeflex
