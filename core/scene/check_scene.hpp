// Checks of a scene that need no computation of masses or modes.
#pragma once

#include "core/scene/scene.hpp"

namespace freeflex {

/// Message for a scene without mass. If there are other faults, the missing mass may only be their
/// consequence.
inline constexpr const char* kNoMass = "nothing has mass; a free structure needs a point or a link with mass";

/// Appends every fault of points, links, groups, wheels, damping, loads, feedback, attractor, initial state
/// and publication. Faults are values out of range, invalid indices, and links of zero length.
void check_scene(const Scene& scene, Faults& faults);

/// Appends a fault at the first point beyond kMaxPoints, if there is one.
/// \param is_whole  false: the input has more points than the scene contains
void check_num_points(const Scene& scene, bool is_whole, Faults& faults);

/// Appends faults for invalid mode numbers in damping and initial state.
void check_modes(const Scene& scene, int num_elastic, Faults& faults);

}  // namespace freeflex
