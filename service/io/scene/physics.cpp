// Faults of physics beside faults of reading, so that a person sees all of them at once.
#include <algorithm>
#include <set>
#include <tuple>

#include "core/structure/structure.hpp"
#include "service/io/scene/reader.hpp"

namespace freeflex::io::reader {
namespace {

using Place = std::tuple<int, int, int>;  // source, line, column
Place place_of(const Origin& origin) { return {origin.source, origin.line, origin.column}; }

// where the items of a scene begin
std::set<Place> find_items(const Scene& scene) {
  std::set<Place> places;
  const auto add = [&](const auto& items) {
    for (const auto& item : items) places.insert(place_of(item.origin));
  };
  add(scene.points);
  add(scene.links);
  add(scene.groups);
  add(scene.loads);
  places.insert(place_of(scene.damping.origin));
  places.insert(place_of(scene.initial.origin));
  return places;
}

}  // namespace

void report_physics(const Scene& scene, Report& report) {
  const std::set<Place> items = find_items(scene);
  // the last item that begins before a place
  const auto owner = [&](const Origin& origin) {
    const auto after = items.upper_bound(place_of(origin));
    return after == items.begin() ? Place{-1, 0, 0} : *std::prev(after);
  };
  std::set<Place> broken;
  for (const Fault& fault : report.faults())
    if (fault.severity == Fault::Severity::kError) broken.insert(owner(fault.origin));
  // what stands on a point that could not be read is not known either
  const bool has_broken_point =
      std::any_of(scene.points.begin(), scene.points.end(),
                  [&](const PointMass& point) { return broken.contains(place_of(point.origin)); });
  if (has_broken_point) return;
  Faults found;
  check_physics(scene, found);
  for (const Fault& fault : found)
    if (fault.severity == Fault::Severity::kError && fault.origin.line > 0 &&
        !broken.contains(place_of(fault.origin)))
      report.error(fault.origin, fault.message);
}

}  // namespace freeflex::io::reader
