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
/// A value set by its path in a scene before the scene is read. service/scenes/README.md, "Values set by
/// path", has the language of paths. All checks of a scene apply to the value.
struct Setting {
  std::string path;    // points.hub.mass
  std::string value;   // YAML: 41, steel, [0, 0, 1], {ratio: 0.01}
  std::string source;  // names the setting in messages, in place of file, line and column
};
/// Applied in their order: of two that set one value the later counts.
using Settings = std::vector<Setting>;

/// Takes PATH=VALUE apart at the first '=' outside quotes. The source is the option's name, a blank and the
/// argument: "--set points.hub.mass=41". nullopt when there is no '=', or nothing before it.
std::optional<Setting> parse_setting(const std::string& argument, const std::string& option = "--set");

/// Reads YAML (with its CSV and Matrix Market files, relative to it) into a scene: syntax, keys, types,
/// ranges, references, duplicates, all at once. A fault of a setting is reported at the setting's source.
SceneResult read_scene(const std::string& path, const Settings& settings = {});

/// A scene that is in memory: YAML or JSON.
struct SceneText {
  std::string text;
  std::string folder{};         // that file names in the text are relative to; empty: the working folder
  std::string name = "<text>";  // names the text in messages: "<text>:3:14: error: ..."
};
/// Reads a scene from text, as read_scene does from a file. A scene without a name is called "scene".
SceneResult read_scene_text(const SceneText& scene, const Settings& settings = {});

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
/// \param rate      [Hz] ticks per second in place of its own; 0: its own. One that does not suit it is a
/// fault.
/// \param settings  values set in the scene; with a plan file they are a fault
PlanResult load_plan(const std::string& path, double rate = 0.0, const SetupProgress& progress = {},
                     const Settings& settings = {});

/// A plan from the text of a scene. To load it with a mass changed:
///   const Settings settings{{"points.hub.mass", "41", "points.hub.mass = 41"}};
///   PlanResult result = load_plan_text({text, folder}, 0.0, {}, settings);
///   for (const Fault& fault : result.faults) puts(format_fault(fault, result.sources, false).c_str());
/// which prints "points.hub.mass = -1: error: point 'hub': mass -1 kg, must be >= 0" for a bad value.
PlanResult load_plan_text(const SceneText& scene, double rate = 0.0, const SetupProgress& progress = {},
                          const Settings& settings = {});

/// Writes a plan file, complete or not at all (temporary file, fsync, rename). Empty string, or what went
/// wrong.
/// \param is_ended  asked each megabyte; true: nothing is written
std::string save_plan(const Plan& plan, const std::string& path, const std::function<bool()>& is_ended = {});

}  // namespace freeflex::io
