// Checks of a scene that do not need its modes.
#pragma once

#include "core/scene/scene.hpp"

namespace freeflex {

/// Message for a scene without mass. If the scene has other faults, they may be the reason why the mass is
/// missing.
inline constexpr const char* kNoMass =
    "nothing has mass, but a free structure needs a point or a link with mass; give one a mass";

/// Appends every fault of points, links, groups, wheels, damping, loads, feedback, attractor, initial state
/// and publication. Faults are values out of range, invalid indices, and links of zero length.
void check_scene(const Scene& scene, Faults& faults);

/// Appends a fault if the scene has more than kMaxPoints points. Its position is that of the first point too
/// many.
/// \param is_whole  false: the reader stopped early, so the input has more points than the scene
void check_num_points(const Scene& scene, bool is_whole, Faults& faults);

/// Appends a fault for each mode number in damping and initial state that is not in 1..num_elastic.
void check_modes(const Scene& scene, int num_elastic, Faults& faults);

}  // namespace freeflex
