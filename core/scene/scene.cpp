#include "core/scene/scene.hpp"

#include <algorithm>

namespace freeflex {

std::string called(const Link& link, int index) {
  return link.label.empty() ? quoted(link.name, index) : link.label;
}

std::string point_names(const Scene& scene, const std::vector<int>& points, int limit) {
  std::string names;
  const int num_named = std::min(limit, static_cast<int>(points.size()));
  for (int i = 0; i < num_named; ++i) {
    const auto point = static_cast<std::size_t>(points[static_cast<std::size_t>(i)]);
    names += (i > 0 ? ", " : "") + quoted(scene.points[point].name, static_cast<int>(point));
  }
  const int num_left = static_cast<int>(points.size()) - num_named;
  return num_left > 0 ? join_text(names, " and ", num_left, " more") : names;
}

}  // namespace freeflex
