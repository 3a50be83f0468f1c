// What a person names on a command line: a scene or a plan.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"
#include "core/step/plan.hpp"
#include "core/structure/structure.hpp"

namespace freeflex::io {

/// A scene as far as it could be read, and every fault in it.
struct SceneResult {
  std::optional<Scene> scene;  // empty when faults has an error
  Faults faults;
  std::vector<std::string> sources;  // Origin::source indexes these
};
/// Reads YAML (with its CSV and Matrix Market files, relative to it) into a scene: syntax, keys, types,
/// ranges, references, duplicates, all at once.
SceneResult read_scene(const std::string& path);

/// "boom.yaml:14:7: error: link 'l3': stiffness -5 N/m, must be > 0", with the source line and a caret when
/// known.
std::string format_fault(const Fault& fault, const std::vector<std::string>& sources,
                         bool with_source_line = true);
/// The same as JSON: {"file","line","column","severity","message"}; all faults in an array.
std::string faults_to_json(const Faults& faults, const std::vector<std::string>& sources);

/// True when the file can be read and starts as plans do.
bool is_plan_file(const std::string& path);

/// A plan and every fault on the way to it.
struct PlanResult {
  std::optional<Plan> plan;  // empty when faults has an error
  Faults faults;
  std::vector<std::string> sources;
};
/// A plan from a scene file or a plan file (told apart by the plan's magic bytes).
/// \param rate  [Hz] ticks per second in place of its own; 0: its own. One that does not suit it is a fault.
PlanResult load_plan(const std::string& path, double rate = 0.0, const SetupProgress& progress = {});

/// Writes a plan file, complete or not at all (temporary file, fsync, rename). Empty string, or what went
/// wrong.
/// \param is_ended  asked each megabyte; true: nothing is written
std::string save_plan(const Plan& plan, const std::string& path, const std::function<bool()>& is_ended = {});

}  // namespace freeflex::io
