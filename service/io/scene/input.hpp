// Loads scenes and plans from files and text.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/plan.hpp"
#include "core/scene/scene.hpp"
#include "core/structure/structure.hpp"

namespace freeflex::io {

/// A scene and all its faults.
struct SceneResult {
  std::optional<Scene> scene;  // empty if faults contains an error
  Faults faults;
  std::vector<std::string> sources;  // Origin::source is an index into this list
};
/// A value set by its path in a scene before the scene is read. service/scenes/README.md, "Values set by
/// path", describes the language of paths. All checks of a scene apply to the value.
struct Setting {
  std::string path;    // points.hub.mass
  std::string value;   // YAML: 41, steel, [0, 0, 1], {ratio: 0.01}
  std::string source;  // text that messages show instead of file, line and column
};
/// Settings in the order in which they are applied. If two settings set one value, the later setting is used.
using Settings = std::vector<Setting>;

/// Splits PATH=VALUE at the first '=' outside quotes. The source is the option's name, a blank and the
/// argument: "--set points.hub.mass=41". Returns nullopt if there is no '=', or no text before it.
std::optional<Setting> parse_setting(const std::string& argument, const std::string& option = "--set");

/// Reads a YAML file into a scene, with its CSV and Matrix Market files. The names of these files are
/// relative to the folder of the YAML file. Reports all faults of keys, types, ranges, references and
/// duplicates at once, but only the first fault of the YAML syntax. A fault of a setting is reported at the
/// setting's source.
SceneResult read_scene(const std::string& path, const Settings& settings = {});

/// A scene in memory, YAML or JSON.
struct SceneText {
  std::string text;
  std::string folder{};         // base of relative file names in the text, empty for the working folder
  std::string name = "<text>";  // stands for the text in messages: "<text>:3:14: error: ..."
};
/// Reads a scene from text as read_scene reads a file. A scene without a name is called "scene".
SceneResult read_scene_text(const SceneText& scene, const Settings& settings = {});

/// Returns "boom.yaml:14:7: error: link 'l3': stiffness is -5 N/m, but must be > 0", with the source line and
/// a caret if the position is known.
std::string format_fault(const Fault& fault, const std::vector<std::string>& sources,
                         bool with_source_line = true);
/// Returns all faults as a JSON array of {"file","line","column","severity","message"}.
std::string faults_to_json(const Faults& faults, const std::vector<std::string>& sources);

/// Returns true if the file can be read and starts like a plan file.
bool is_plan_file(const std::string& path);

/// A plan and all faults of its set-up.
struct PlanResult {
  std::optional<Plan> plan;  // empty if faults contains an error
  Faults faults;
  std::vector<std::string> sources;
};
/// Makes a plan from a scene file or a plan file. A plan file is recognised by its magic bytes.
/// \param rate  [Hz] ticks per second that replace the file's rate; 0: keeps the file's rate. A rate that the
///   scene does not allow is a fault.
/// \param settings  values set in the scene; for a plan file, any setting is a fault
PlanResult load_plan(const std::string& path, double rate = 0.0, const SetupProgress& progress = {},
                     const Settings& settings = {});

/// Makes a plan from the text of a scene. To load a scene with a different mass:
///   const Settings settings{{"points.hub.mass", "41", "points.hub.mass = 41"}};
///   PlanResult result = load_plan_text({text, folder}, 0.0, {}, settings);
///   for (const Fault& fault : result.faults) puts(format_fault(fault, result.sources, false).c_str());
/// For a bad value this prints "points.hub.mass = -1: error: point 'hub': mass is -1 kg, but must be >= 0".
PlanResult load_plan_text(const SceneText& scene, double rate = 0.0, const SetupProgress& progress = {},
                          const Settings& settings = {});

/// Writes a plan file either completely or not at all (temporary file, fsync, rename). Returns an empty
/// string, or the error.
/// \param is_ended  called before each megabyte and at the end; if it returns true, nothing is written
std::string save_plan(const Plan& plan, const std::string& path, const std::function<bool()>& is_ended = {});

}  // namespace freeflex::io
