// Reports faults of physics together with faults of reading, so that the user sees all of them at once.
#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "core/scene/bodies.hpp"
#include "core/scene/check/check_scene.hpp"
#include "core/structure/structure.hpp"
#include "service/io/scene/reader.hpp"

namespace freeflex::io::reader {
namespace {

using Place = std::tuple<int, int, int>;  // source, line, column
Place place_of(const Origin& origin) { return {origin.source, origin.line, origin.column}; }

// returns the positions where the items of a scene begin
std::set<Place> find_items(const Scene& scene) {
  std::set<Place> places;
  const auto add = [&](const auto& items) {
    for (const auto& item : items) places.insert(place_of(item.origin));
  };
  add(scene.points);
  add(scene.links);
  add(scene.groups);
  add(scene.loads);
  add(scene.wheels);
  add(scene.feedbacks);
  places.insert(place_of(scene.damping.origin));
  places.insert(place_of(scene.initial.origin));
  places.insert(place_of(scene.attractor.origin));
  return places;
}

// Returns a scene whose lumped masses of links are at their points, as in a scene that was read without a
// fault. If a link with lumped mass has no valid mass or points, the scene is unchanged. check_physics() then
// computes no masses.
Scene with_lumped_masses(Scene scene) {
  const auto is_known = [&](int point) { return point >= 0 && index(point) < scene.points.size(); };
  const bool are_valid = std::ranges::all_of(scene.links, [&](const Link& link) {
    return mass_distribution_of(link) != MassDistribution::kLumped || !has_mass(link) ||
           (link.points.size() >= traits_of(link).least && std::ranges::all_of(link.points, is_known) &&
            std::isfinite(mass_of(scene, link)));
  });
  if (are_valid) place_lumped_masses(scene);
  return scene;
}

}  // namespace

void report_num_points(const Scene& scene, bool is_whole, Report& report) {
  Faults found;
  check_num_points(scene, is_whole, found);
  for (const Fault& fault : found) report.error(fault.origin, fault.message);
}

void report_physics(const Scene& scene, const std::vector<Origin>& other_places, Report& report) {
  std::set<Place> items = find_items(scene);
  for (const Origin& origin : other_places) items.insert(place_of(origin));
  // returns the last item that begins at or before a position
  const auto owner = [&](const Origin& origin) {
    const auto after = items.upper_bound(place_of(origin));
    return after == items.begin() ? Place{-1, 0, 0} : *std::prev(after);
  };
  std::set<Place> broken;
  for (const Fault& fault : report.faults())
    if (fault.severity == Fault::Severity::kError)
      for (const Origin& place : report.targets(fault.origin)) broken.insert(owner(place));
  for (const Origin& place : report.unresolved()) broken.insert(owner(place));
  // if a point could not be read, only the number of points is checked, because other items depend on points
  const bool has_broken_point =
      std::any_of(scene.points.begin(), scene.points.end(),
                  [&](const PointMass& point) { return broken.contains(place_of(point.origin)); });
  if (has_broken_point) return report_num_points(scene, true, report);
  Faults found;
  check_physics(with_lumped_masses(scene), found);
  for (const Fault& fault : found)
    if (fault.severity == Fault::Severity::kError &&
        (fault.origin.line > 0 || report.is_setting(fault.origin.source)) &&
        !broken.contains(place_of(fault.origin)) && (broken.empty() || fault.message != kNoMass))
      report.error(fault.origin, fault.message);
}

}  // namespace freeflex::io::reader
