// Names of links and points of a scene in the texts of faults.
#pragma once

#include <string>
#include <vector>

#include "core/scene/scene.hpp"

namespace freeflex {

/// Returns the label of a link in messages. The label is 'name', or the position in the source list if the
/// link has no name.
std::string called(const Link& link, int index);

/// Returns the names of the given points, at most `limit` of them: "a, b, c and 4 more".
std::string point_names(const Scene& scene, const std::vector<int>& points, int limit);

}  // namespace freeflex
