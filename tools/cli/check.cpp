// freeflex check prints every fault of a scene at once.
#include <CLI/App.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/limits.hpp"
#include "core/plan/make_plan.hpp"
#include "core/plan/rungs/rates.hpp"
#include "core/structure/structure.hpp"
#include "service/io/wire/outbound.hpp"
#include "tools/cli/commands.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

struct CheckOptions {
  std::string scene;
  io::Settings settings;
  bool json = false;
};

constexpr const char* kCheckFooter = R"(Example:
  freeflex check service/scenes/rotor.yaml
  freeflex check boom.yaml --set 'points.tip.at=[3, 1, 0.5]'
JSON fields:
  scene        the file;  ok: true if it has no errors
  faults       for each: file, line, column, severity (error or warning), message
  points, links, rigid_freedoms, elastic_freedoms, mechanisms
               counts, if the scene is good
  modes_complete_below
               [Hz] when only the lowest modes are kept: no mode below this frequency is missing
Exit codes: 0 the scene is good (warnings allowed), 2 it has errors or cannot be read.)";

struct Checked {
  std::optional<Plan> plan;
  KeptModes kept;  // only for a scene
  Faults faults;
  std::vector<std::string> sources;
};

/// Checks a scene by executing the whole set-up, or a plan with the checks that every program makes when it
/// loads a plan.
Checked check_file(const std::string& path, const io::Settings& settings) {
  Progress progress("check");
  if (io::is_plan_file(path)) {
    io::PlanResult read = io::load_plan(path, 0.0, {}, settings);
    return {std::move(read.plan), {}, std::move(read.faults), std::move(read.sources)};
  }
  io::SceneResult read = io::read_scene(path, settings);
  Checked checked{std::nullopt, {}, std::move(read.faults), std::move(read.sources)};
  std::optional<Structure> structure;
  if (read.scene) structure = build_structure(*read.scene, checked.faults, progress.of_setup());
  if (structure) checked.kept = structure->kept;
  if (structure) checked.plan = make_plan(*read.scene, *structure, checked.faults);
  if (!checked.plan) return checked;
  if (const std::string fast = find_fast_modes(*checked.plan); !fast.empty())
    checked.faults.push_back({Fault::Severity::kWarning, {0, 0, 0}, fast});
  return checked;
}

int check(const CheckOptions& options) {
  const Checked checked = check_file(options.scene, options.settings);
  const std::optional<Plan>& plan = checked.plan;
  std::int64_t errors = 0;
  for (const Fault& fault : checked.faults) errors += fault.severity == Fault::Severity::kError ? 1 : 0;
  const auto warnings = static_cast<std::int64_t>(checked.faults.size()) - errors;
  const bool is_good = plan.has_value() && errors == 0;

  if (options.json) {
    Json out;
    out["scene"] = options.scene;
    out["ok"] = is_good;
    out["faults"] = Json::parse(io::faults_to_json(checked.faults, checked.sources));
    if (is_good) {
      out["points"] = plan->points.size();
      out["links"] = plan->links.size();
      out["rigid_freedoms"] = plan->rigid_freedoms;
      out["elastic_freedoms"] = plan->num_elastic;
      out["mechanisms"] = plan->mechanisms.size();
      if (checked.kept.is_subset) out["modes_complete_below"] = checked.kept.verified_below;
    }
    print_json(out);
    return is_good ? kExitOk : kExitUsage;
  }

  print_faults(checked.faults, checked.sources);
  if (!is_good) {
    std::fprintf(stderr, "%s: %s, %s\n", options.scene.c_str(), counted(errors, "error").c_str(),
                 counted(warnings, "warning").c_str());
    return kExitUsage;
  }
  std::printf("%s: good, %s, %s, %d rigid and %d elastic freedoms, %s, %s\n", options.scene.c_str(),
              counted(static_cast<std::int64_t>(plan->points.size()), "point").c_str(),
              counted(static_cast<std::int64_t>(plan->links.size()), "link").c_str(), plan->rigid_freedoms,
              plan->num_elastic,
              counted(static_cast<std::int64_t>(plan->mechanisms.size()), "mechanism").c_str(),
              counted(warnings, "warning").c_str());
  if (checked.kept.is_subset && plan->num_elastic > 0)
    std::printf(
        "  only the lowest elastic modes are set up (modes:); none is missing below %.6g Hz, verified by a "
        "Sturm sequence\n",
        checked.kept.verified_below);
  const io::SceneListing listing = io::scene_listing(*plan);
  if (const auto num_points = static_cast<std::int32_t>(plan->points.size()); listing.points < num_points)
    std::printf(
        "  %s published, %d take commands, %d of %d listed on the bus; if there are more than %d points, "
        "only named points are listed\n",
        counted(static_cast<std::int64_t>(plan->published_points.size()), "point").c_str(),
        static_cast<int>(std::count_if(plan->points.begin(), plan->points.end(),
                                       [](const PlanPoint& point) { return point.pushable; })),
        listing.points, num_points, kMostByDefault);
  return kExitOk;
}

}  // namespace

void add_check(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CheckOptions>();
  CLI::App* command =
      app.add_subcommand("check", "all faults of a scene at once: file, line, column, allowed values");
  command->add_option("SCENE", options->scene, "scene file (YAML), or a plan")->required();
  add_settings(*command, options->settings);
  command->add_flag("--json", options->json, "one JSON object on standard output");
  command->footer(kCheckFooter);
  command->callback([options, &exit_code] { exit_code = check(*options); });
}

}  // namespace freeflex::tools
