// The physics of a scene that can be judged before anything is computed.
#pragma once

#include "core/scene/scene.hpp"

namespace freeflex {

/// Of a scene in which no mass was found: beside other faults it may only follow from them.
inline constexpr const char* kNoMass = "nothing has mass; a free structure needs a point or a link that has";

/// Appends every fault of points, links, groups, damping, loads, initial state and publication: values out of
/// range, indices that name nothing, links of no length.
void check_scene(const Scene& scene, Faults& faults);

/// Appends a fault at the first point beyond the most that are taken, if there is one.
/// \param is_whole  false: there are more points than the scene holds
void check_num_points(const Scene& scene, bool is_whole, Faults& faults);

/// Appends faults of what names elastic modes by number: damping and initial state.
void check_modes(const Scene& scene, int num_elastic, Faults& faults);

}  // namespace freeflex
