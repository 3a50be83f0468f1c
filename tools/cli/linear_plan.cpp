#include "tools/cli/linear_plan.hpp"

#include <algorithm>
#include <utility>

#include "core/plan/make_plan.hpp"
#include "core/structure/structure.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

void add_once(std::vector<int>& list, int item) {
  if (std::find(list.begin(), list.end(), item) == list.end()) list.push_back(item);
}

/// Publishes the point, group or link with a name, so that the plan has its rows.
void publish(const std::string& kind, const std::string& name, Scene& scene) {
  for (std::size_t k = 0; k < scene.points.size() && kind == "point"; ++k)
    if (scene.points[k].name == name) add_once(scene.publication.points, static_cast<int>(k));
  for (std::size_t k = 0; k < scene.groups.size() && kind == "group"; ++k)
    if (scene.groups[k].name == name) add_once(scene.publication.groups, static_cast<int>(k));
  for (std::size_t k = 0; k < scene.links.size() && kind == "link"; ++k)
    if (scene.links[k].name == name) add_once(scene.publication.links, static_cast<int>(k));
}

}  // namespace

bool leaves_modes_out(const Plan& plan) {
  return std::any_of(plan.features.begin(), plan.features.end(), [](const PlanFeature& feature) {
    return feature.is_left_out && feature.count > 0 && feature.feature != Feature::kPointRows;
  });
}

std::optional<LinearPlan> load_linear_plan(const std::string& path, const io::Settings& settings,
                                           const control::Ports& ports, const std::string& held) {
  if (io::is_plan_file(path))
    return print_error("'" + path +
                       "' is a plan, which may omit features; name the scene that it was made from"),
           std::nullopt;
  Progress progress("set-up");
  io::SceneResult read = io::read_scene(path, settings);
  std::optional<LinearPlan> made;
  if (read.scene) {
    for (const auto* names : {&ports.inputs, &ports.outputs})
      for (const std::string& name : *names)
        if (const std::size_t first = name.find('.'), last = name.rfind('.'); first != last)
          publish(name.substr(0, first), name.substr(first + 1, last - first - 1), *read.scene);
    publish("point", held, *read.scene);
    for (const Group& group : read.scene->groups)
      if (group.name == held)
        for (const int point : group.points) add_once(read.scene->publication.points, point);
    std::sort(read.scene->publication.points.begin(), read.scene->publication.points.end());
    const std::optional<Structure> structure = build_structure(*read.scene, read.faults, progress.of_setup());
    // of links with true geometry, the linear model is that of the rung below
    const auto linear = static_cast<Fidelity>(static_cast<std::int32_t>(kTrueGeometry) - 1);
    Fidelity rung = read.scene->automatic ? linear : std::min(read.scene->fidelity, linear);
    if (!held.empty() && !traits_of(rung).has_modes) rung = linear;
    std::optional<Plan> plan;
    if (structure) plan = make_full_plan(*read.scene, *structure, rung, read.faults);
    if (plan) made = {std::move(*plan), !structure->kept.is_subset};
  }
  print_faults(read.faults, read.sources);
  return made;
}

}  // namespace freeflex::tools
