// freeflex check: every fault of a scene at once.
#include <CLI/App.hpp>
#include <cstdio>
#include <memory>
#include <string>

#include "core/model/compile.hpp"
#include "core/model/structure.hpp"
#include "tools/commands.hpp"
#include "tools/console.hpp"

namespace freeflex::tools {
namespace {

struct Options {
  std::string scene;
  bool json = false;
};

int check(const Options& options) {
  io::SceneResult read = io::read_scene(options.scene);
  Faults faults = std::move(read.faults);
  std::optional<Structure> structure;
  std::optional<Plan> plan;
  if (read.scene) structure = build_structure(*read.scene, faults);
  if (structure) plan = compile_plan(*read.scene, *structure, faults);

  std::int64_t errors = 0;
  for (const Fault& fault : faults) errors += fault.severity == Fault::Severity::kError ? 1 : 0;
  const auto warnings = static_cast<std::int64_t>(faults.size()) - errors;
  const bool is_good = plan.has_value() && errors == 0;

  if (options.json) {
    Json out;
    out["scene"] = options.scene;
    out["ok"] = is_good;
    out["faults"] = Json::parse(io::faults_to_json(faults, read.sources));
    if (is_good) {
      out["points"] = read.scene->points.size();
      out["links"] = read.scene->links.size();
      out["rigid_freedoms"] = plan->rigid_freedoms;
      out["elastic_freedoms"] = plan->num_elastic;
      out["mechanisms"] = plan->mechanisms.size();
    }
    print_json(out);
    return is_good ? kExitOk : kExitUsage;
  }

  print_faults(faults, read.sources);
  if (!is_good) {
    std::fprintf(stderr, "%s: %s, %s\n", options.scene.c_str(), counted(errors, "error").c_str(),
                 counted(warnings, "warning").c_str());
    return kExitUsage;
  }
  std::printf("%s: good, %s, %s, %d rigid and %d elastic freedoms, %s, %s\n", options.scene.c_str(),
              counted(static_cast<std::int64_t>(read.scene->points.size()), "point").c_str(),
              counted(static_cast<std::int64_t>(read.scene->links.size()), "link").c_str(),
              plan->rigid_freedoms, plan->num_elastic,
              counted(static_cast<std::int64_t>(plan->mechanisms.size()), "mechanism").c_str(),
              counted(warnings, "warning").c_str());
  return kExitOk;
}

}  // namespace

void add_check(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("check", "all faults of a scene at once: file, line, column, what is allowed");
  command->add_option("SCENE", options->scene, "scene file (YAML)")->required();
  command->add_flag("--json", options->json, "one JSON object on standard output");
  command->footer(
      "Example:\n  freeflex check service/scenes/rotor.yaml\n"
      "Exit codes: 0 the scene is good (warnings allowed), 2 it has errors or cannot be read.");
  command->callback([options, &exit_code] { exit_code = check(*options); });
}

}  // namespace freeflex::tools
