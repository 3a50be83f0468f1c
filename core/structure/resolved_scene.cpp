#include "core/structure/resolved_scene.hpp"

#include <algorithm>

#include "core/scene/bodies.hpp"

namespace freeflex {
bool ResolvedScene::have_links_mass() const {
  return std::ranges::any_of(links, [](const ResolvedLink& link) { return link.has_mass; });
}

ResolvedScene resolve(const Scene& scene) {
  ResolvedScene resolved;
  resolved.are_point_masses = are_point_masses(scene);
  resolved.has_attitude.reserve(scene.points.size());
  for (const PointMass& point : scene.points) resolved.has_attitude.push_back(has_attitude(point));
  resolved.moves_mass = points_that_move_mass(scene);
  resolved.has_rotary_mass = points_with_rotary_mass(scene);
  resolved.links.reserve(scene.links.size());
  for (const Link& link : scene.links)
    resolved.links.push_back({traits_of(link), axial_of(scene, link), has_mass(link)});
  return resolved;
}

}  // namespace freeflex
