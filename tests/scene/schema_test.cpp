// The schema for editors accepts every scene that the reader accepts, and refuses the same scenes as far as a
// schema can.
#include "service/io/scene/schema.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>

#include "service/io/scene/input.hpp"
#include "service/io/scene/keys.hpp"
#include "tests/scene/temporary_folder.hpp"

namespace freeflex::testing {
namespace {

using io::reader::Form;
using io::reader::Key;
using io::reader::Per;
using io::reader::Range;
using io::reader::Section;
using Json = nlohmann::ordered_json;
using Pointer = Json::json_pointer;

std::string read_file(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Returns the result of the schema check for each scene: "" if it is accepted, a fault if it is refused,
/// nullopt if it is not YAML.
std::vector<std::optional<std::string>> ask_schema(const std::vector<std::string>& scenes) {
  const TemporaryFolder folder;
  folder.write("schema.json", io::scene_schema());
  folder.write("scenes.json", Json(scenes).dump(-1, ' ', false, Json::error_handler_t::replace));
  const std::string command = std::string("/usr/bin/python3 '") + FREEFLEX_SOURCE_DIR +
                              "/tests/scene/validate.py' schema.json scenes.json >faults.json";
  EXPECT_EQ(std::system(command.c_str()), 0) << "is python3-jsonschema installed?";
  std::vector<std::optional<std::string>> answers;
  for (const Json& fault : Json::parse(read_file("faults.json"), nullptr, false))
    answers.push_back(fault.is_string() ? std::optional(fault.get<std::string>()) : std::nullopt);
  EXPECT_EQ(answers.size(), scenes.size());
  answers.resize(scenes.size());
  return answers;
}

/// Holds the text of a changed scene and a description of the change.
struct Changed {
  std::string what, text;
};

/// Provides a scene with every key, and the files that it names.
class Schema : public ::testing::Test {
 protected:
  struct Location {
    Pointer path;
    const Section* section;
  };

  Schema() {
    folder_.write("points.csv", "name,mass,x,y,z\ne,1,3,0,0\nf,1,4,0,0\n");
    folder_.write("links.csv", "from,to,stiffness\ne,f,10\n");
    for (const char* name : {"K.mtx", "M.mtx"})
      folder_.write(name, "%%MatrixMarket matrix coordinate real symmetric\n13 13 1\n1 1 1\n");
    folder_.write("F.mtx", "%%MatrixMarket matrix coordinate real symmetric\n6 6 1\n1 1 1\n");
    find_locations(scene_, io::reader::sections::kScene, Pointer());
  }
  bool is_taken(const std::string& text) const {
    std::filesystem::remove("scene.yaml");  // overwriting the file would wait for the disk
    folder_.write("scene.yaml", text);
    return io::read_scene("scene.yaml").scene.has_value();
  }
  /// Returns a copy of the scene with another value for the key of the mapping at the path, and without the
  /// sections that this change does not need.
  Json with(const Pointer& path, const std::string& key, const Json& value) const {
    static const std::set<std::string> kNeeded{"points", "links",    "groups",
                                               "wheels", "fidelity", "tolerance"};
    Json whole = scene_, changed;
    whole[path][key] = value;
    std::string top = path.to_string() + "/" + key;
    top = top.substr(1, top.find('/', 1) - 1);
    for (const auto& [name, section] : whole.items())
      if (name == top || kNeeded.contains(name)) changed[name] = section;
    if (top != "links") changed["links"] = {whole["links"][0]};
    return changed;
  }
  void expect_refused_by_both(const std::vector<Changed>& changes) const {
    std::vector<std::string> texts;
    for (const Changed& change : changes) texts.push_back(change.text);
    const auto answers = ask_schema(texts);
    for (std::size_t i = 0; i < changes.size(); ++i) {
      EXPECT_NE(answers[i], "") << changes[i].what;
      EXPECT_FALSE(is_taken(changes[i].text)) << changes[i].what;
    }
  }
  static Json with_every_key();

  const TemporaryFolder folder_;
  const Json scene_ = with_every_key();
  std::vector<Location> locations_;

 private:
  void find_locations(const Json& value, const Section& section, const Pointer& path) {
    locations_.push_back({path, &section});
    for (const Key& key : section.keys) {
      const std::string name(key.name);
      if (key.sections.empty() || !value.contains(name)) continue;
      const Json& below = value[name];
      if (key.per != Per::kNothing)
        for (const auto& [each, item] : below.items())
          find_locations(item, *key.sections[0], path / name / each);
      else if (below.is_array())
        for (std::size_t i = 0; i < below.size(); ++i)
          find_locations(below[i], section_of(below[i], key), path / name / i);
      else
        find_locations(below, section_of(below, key), path / name);
    }
  }
  /// Returns the section whose required keys the item has.
  static const Section& section_of(const Json& item, const Key& key) {
    const auto fits = [&](const Section* section) {
      return std::all_of(section->keys.begin(), section->keys.end(), [&](const Key& each) {
        return !each.is_required || item.contains(std::string(each.name));
      });
    };
    const auto found = std::find_if(key.sections.begin(), key.sections.end(), fits);
    if (found == key.sections.end()) throw std::logic_error("no section for " + item.dump());
    return **found;
  }
};

Json Schema::with_every_key() {
  return Json::parse(R"({
"name": "every", "rate": 100, "fidelity": "auto",
"tolerance": {"displacement": 1e-5, "position": 1e-3, "attitude": 1e-3, "elastic": 0.1, "horizon": 10},
"integration": {"by": "auto", "accuracy": 1e-6},
"verdict": {"horizon": 1, "step": 0.01, "share": 0.5},
"points": [
  {"name": "a", "mass": 10, "at": [0, 0, 0], "inertia": [1, 1, 1], "offset": [0, 0, 1], "axes": [1, 0, 0, 0]},
  {"name": "b", "mass": 1, "at": [1, 0, 0]}, {"name": "1e5", "mass": 1, "at": [1, 1, 0]},
  {"name": "true", "mass": 1, "at": [0, 1, 1]}, {"csv": "points.csv"}],
"links": [
  {"name": "s", "spring": ["a", "b"], "stiffness": 1, "viscous": 1, "loss_factor": 0.1},
  {"name": "r", "bar": ["a", "b"], "EA": 1, "mass_per_length": 1, "lumped": true, "viscous": 1, "loss_factor": 0.1},
  {"name": "t", "bar": ["a", "b"], "EA": 1, "mass_per_length": 1, "mean_axial": true},
  {"name": "u", "beam": ["a", "b"], "EA": 1, "GJ": 1, "EIy": 1, "EIz": 1, "GAy": 1, "GAz": 1, "y_axis": [0, 1, 0],
   "release": {"from": ["x"], "to": ["y", "z"]}, "mass_per_length": 1, "lumped": true, "loss_factor": 0.1},
  {"name": "v", "beam": ["a", "b"], "EA": 1, "GJ": 1, "EIy": 1, "EIz": 1, "mass_per_length": 1, "mean_axial": true},
  {"name": "w", "bending": ["a", "b", "1e5"], "stiffness": 1, "viscous": 1, "loss_factor": 0.1},
  {"name": "x", "torsion": ["a..true"], "stiffness": 1, "viscous": 1, "loss_factor": 0.1},
  {"name": "y", "plate": ["a", "b", "1e5"], "E": 1, "nu": 0.3, "thickness": 1, "density": 1, "lumped": false,
   "loss_factor": 0.1},
  {"name": "z", "matrix": "K.mtx", "points": ["a", "b"], "mass": "M.mtx", "rotations": true, "inner": 1,
   "loss_factor": 0.1},
  {"name": "M", "matrix": "F.mtx", "points": ["a", "b"], "viscous": 1},
  {"name": "F", "flexibility": "F.mtx", "points": ["a", "b"], "viscous": 1, "loss_factor": 0.1},
  {"name": "R", "rigid": ["a", "b"]}, {"name": "D", "dashpot": ["a", "b"], "damping": 1}, {"csv": "links.csv"}],
"groups": {"g": ["a", "b"]},
"damping": {"ratio": 0.1, "modes": {"1": 0.2}, "rayleigh": {"alpha": 0.1, "beta": 0.1}},
"gravity": [0, 0, 1], "attractor": {"at": [1e6, 0, 0], "mu": 1},
"initial": {"position": [0, 0, 0], "attitude": [1, 0, 0, 0], "velocity": [0, 0, 0], "angular_velocity": [0, 0, 0],
  "points": {"a": {"displacement": [0, 0, 0], "velocity": [0, 0, 0]}}, "modes": {"2": {"q": 1, "q_dot": 1}}},
"wheels": [{"name": "w", "at": "a", "axis": [0, 0, 1], "momentum": 1}],
"loads": [
  {"name": "k", "axes": "body", "forces": {"a": [0, 0, 1]}, "torques": {"a": [0, 0, 1]}, "wheels": {"w": 1},
   "wrenches": {"g": {"force": [0, 0, 1], "torque": [0, 0, 1]}}, "pulse": {"start": 0, "duration": 1}},
  {"forces": {"a": [0, 0, 1]}, "sine": {"frequency": 1, "phase": 1}},
  {"forces": {"a": [0, 0, 1]}, "table": {"times": [0, 1], "values": [0, 1]}}],
"feedback": [{"name": "f", "at": "a", "from": "b", "displacement": 1, "velocity": [1, 2, 3],
  "acceleration": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}],
"leave_out": {"tolerance": 0.1, "horizon": 1, "on_need": "keep", "keep": ["damping"]},
"modes": {"below": 10},
"publish": {"state": 10, "points": {"rate": 10, "of": ["a"]}, "loads": {"rate": 10, "of": ["s"]}, "groups": ["g"],
  "status": 10},
"commands": {"points": ["a"], "force_limit": 1, "torque_limit": 1, "max_age": 1, "sender_share": 0.5, "max_hold": 5}
})");
}

// calls `take` once for each section of a scene
void each_section(const Section& section, const std::string& chapter, std::set<const Section*>& seen,
                  const std::function<void(const Section&, const std::string& chapter)>& take) {
  if (!seen.insert(&section).second) return;
  take(section, chapter);
  for (const Key& key : section.keys)
    for (const Section* below : key.sections)
      each_section(*below, chapter.empty() ? std::string(key.name) : chapter, seen, take);
}
void each_section(const std::function<void(const Section&, const std::string& chapter)>& take) {
  std::set<const Section*> seen;
  each_section(io::reader::sections::kScene, "", seen, take);
}

TEST_F(Schema, AcceptsASceneWithEveryKeyOfTheTable) {
  EXPECT_TRUE(is_taken(scene_.dump()));
  Json other = scene_;
  other["modes"] = {{"count", 3}};
  EXPECT_TRUE(is_taken(other.dump()));
  const auto answers = ask_schema({scene_.dump(), other.dump()});
  EXPECT_EQ(answers[0], "");
  EXPECT_EQ(answers[1], "");
  each_section([&](const Section& section, const std::string&) {
    for (const Key& key : section.keys)
      EXPECT_TRUE(key.name == "count" ||
                  std::any_of(locations_.begin(), locations_.end(),
                              [&](const Location& location) {
                                return location.section == &section &&
                                       scene_[location.path].contains(std::string(key.name));
                              }))
          << section.name << ": " << key.name;
  });
}

TEST_F(Schema, RefusesMisspeltMissingAndMistypedKeysAsTheReaderDoes) {
  std::vector<Changed> changes;
  const auto add = [&](const std::string& what, const Json& changed) {
    changes.push_back({what, changed.dump()});
  };
  for (const Location& location : locations_)
    for (const Key& key : location.section->keys) {
      const std::string name(key.name), where = location.path.to_string() + "/" + name;
      if (!scene_[location.path].contains(name)) continue;
      Json misspelt = with(location.path, name + "x", scene_[location.path][name]);
      misspelt[location.path].erase(name);
      add(where + " misspelt", misspelt);
      Json missing = with(location.path, name, nullptr);
      missing[location.path].erase(name);
      if (key.is_required) add(where + " missing", missing);
      add(where + " empty", with(location.path, name, nullptr));
      add(where + " nested", with(location.path, name, Json::parse("[[[]]]")));
    }
  expect_refused_by_both(changes);
  EXPECT_GT(changes.size(), 400u);
}

TEST_F(Schema, RefusesNumbersOutOfRangeAsTheReaderDoes) {
  std::vector<Changed> changes;
  for (const Location& location : locations_)
    for (const Key& key : location.section->keys) {
      const std::string name(key.name);
      if ((key.form != Form::kNumber && key.form != Form::kWhole) || !scene_[location.path].contains(name))
        continue;
      std::vector<double> beyond;
      for (const Range& range : {io::reader::range_of(key.quantity.bound), key.range}) {
        if (std::isfinite(range.least)) beyond.push_back(range.has_least ? range.least - 1e-3 : range.least);
        if (std::isfinite(range.most)) beyond.push_back(range.has_most ? range.most + 1e-3 : range.most);
      }
      if (key.form == Form::kWhole) beyond.push_back(1.5);
      for (const double value : beyond) {
        const Json wrong = key.per == Per::kMode ? Json{{"1", value}} : Json(value);
        changes.push_back({location.path.to_string() + "/" + name + " " + wrong.dump(),
                           with(location.path, name, wrong).dump()});
      }
    }
  expect_refused_by_both(changes);
  EXPECT_GT(changes.size(), 60u);
}

// tries every value of a list at every key
TEST_F(Schema, AcceptsEveryValueThatTheReaderAccepts) {
  const std::vector<std::string> values{"0",
                                        "1",
                                        "+3",
                                        "-2.",
                                        ".5",
                                        "1e5",
                                        "1E+2",
                                        "2000",
                                        "3.0",
                                        "1.5",
                                        "-0",
                                        "4e-300",
                                        "0.999",
                                        "'1'",
                                        "\"a\"",
                                        "a",
                                        "b",
                                        "1e5..true",
                                        "true",
                                        "'false'",
                                        "false",
                                        "all",
                                        "a..b",
                                        "f",
                                        "auto",
                                        "full",
                                        "local",
                                        "replan",
                                        "y",
                                        "x",
                                        "K.mtx",
                                        "F.mtx",
                                        "M.mtx",
                                        "{}",
                                        "[]",
                                        "[a, b]",
                                        "[a]",
                                        "[1e5]",
                                        "[true]",
                                        "[y, 'z']",
                                        "[all]",
                                        "[s..v]",
                                        "[0, 1]",
                                        "[1, 0, 0]",
                                        "[1, 2.5, -.5]",
                                        "[0, 1, 0, 0]",
                                        "[1, 1, 1, 0, 0, 0]",
                                        "[[1, 0, 0], [0, 1., 0], [0, 0, 1e0]]",
                                        "{a: [1, 2, 3]}",
                                        "{1e5: [1, 2, 3]}",
                                        "{g: {torque: [1, 2, 3]}}",
                                        "{w: 1}",
                                        "{1: 0}",
                                        "{3: {q: 1}}",
                                        "{csv: points.csv}",
                                        "[{csv: points.csv}]",
                                        "{'': a}",
                                        "{g: all, 7: a, .nan: true}",
                                        "{count: 7.0}",
                                        "{rate: 0}",
                                        "{of: all}",
                                        "{rigid: a..true}",
                                        "{mass: 0, at: [0, 0, 0], name: 7}",
                                        ".nan",
                                        "~",
                                        "null",
                                        "010",
                                        "0x10",
                                        "2 m"};
  std::vector<std::string> taken;
  std::set<std::pair<const Section*, std::string_view>> done;
  for (const Location& location : locations_)
    for (const Key& key : location.section->keys) {
      const std::string name(key.name);
      if (!scene_[location.path].contains(name) || !done.emplace(location.section, key.name).second) continue;
      taken.push_back(with(location.path, name, scene_[location.path][name]).dump());
      EXPECT_TRUE(is_taken(taken.back())) << taken.back();
      const std::string text = with(location.path, name, "@@").dump();
      const std::size_t at = text.find("\"@@\"");
      for (const std::string& value : values) {
        std::string changed = text;
        changed.replace(at, 4, value);
        if (is_taken(changed)) taken.push_back(changed);
      }
    }
  const auto answers = ask_schema(taken);
  for (std::size_t i = 0; i < taken.size(); ++i) EXPECT_EQ(answers[i], "") << taken[i];
  EXPECT_GT(taken.size(), 500u);
}

TEST_F(Schema, AcceptsEveryShippedOrRecordedScene) {
  std::vector<std::string> names, texts;
  const std::filesystem::path top = FREEFLEX_SOURCE_DIR;
  for (const char* below : {"service/scenes", "tests"})
    for (const auto& entry : std::filesystem::recursive_directory_iterator(top / below))
      if (entry.path().extension() == ".yaml" && entry.path().parent_path().filename() != "campaigns") {
        names.push_back(entry.path().string());
        texts.push_back(read_file(entry.path()));
      }
  const auto answers = ask_schema(texts);
  for (std::size_t i = 0; i < names.size(); ++i) EXPECT_EQ(answers[i], "") << names[i];
  EXPECT_GT(names.size(), 20u);
}

/// Returns true if a schema can find this fault, which is so if the fault concerns only a key, a type or a
/// range. A schema cannot find faults that depend on another key, nor numbers that are valid in YAML but not
/// in scenes.
bool is_of_schema(const std::string& message) {
  static const std::regex kSeen(
      "the key '.*' is unknown|is missing; it must|has no kind|is both|"
      "must be a (number|mapping|whole number|share)|"
      "must be (>|>=|from) ?[-0-9]|must be a list of ([0-9]+ )?numbers|must be text|has a unit|is not for |"
      " is (the text '.*'|a list|a mapping|empty), but must be|has neither|has no gain|modes is empty|"
      "must be 1 to 63|must not contain|stands for every name|must be 3 moments|appears twice|"
      "names .* twice; name it once$");
  static const std::regex kUnseen(
      "tolerance: horizon is missing|leading zero|hexadecimal|not finite|too large or too small|YAML syntax");
  return std::regex_search(message, kSeen) && !std::regex_search(message, kUnseen);
}

TEST_F(Schema, AgreesWithTheReaderOnTheScenesOfOtherTests) {
  const TemporaryFolder kept;
  const std::string self = std::filesystem::read_symlink("/proc/self/exe").string();
  const std::string command =
      "FREEFLEX_KEPT_SCENES='" + kept.path().string() + "' '" + self +
      "' --gtest_filter='-Schema*:HostileScene*:Limits*:PlanFile*:*Shipped*' >/dev/null";
  EXPECT_EQ(std::system(command.c_str()), 0);
  std::vector<std::string> texts, faults;  // faults reported by the reader, "" for a valid scene
  std::vector<bool> must_refuse;
  for (const auto& entry : std::filesystem::directory_iterator(kept.path())) {
    const std::string path = (entry.path() / "scene.yaml").string();
    if (!std::filesystem::exists(path)) continue;
    const io::SceneResult result = io::read_scene(path);
    texts.push_back(read_file(path));
    faults.emplace_back();
    bool is_seen = false;
    for (const Fault& fault : result.faults) {
      if (fault.severity != Fault::Severity::kError) continue;
      faults.back() += fault.message + "\n";
      is_seen = is_seen || (fault.origin.source == 0 && is_of_schema(fault.message));
    }
    must_refuse.push_back(is_seen);
  }
  const auto answers = ask_schema(texts);
  for (std::size_t i = 0; i < texts.size(); ++i) {
    if (faults[i].empty()) {
      EXPECT_EQ(answers[i], "") << texts[i];
    }
    if (must_refuse[i]) {
      EXPECT_NE(answers[i], "") << texts[i] << faults[i];
    }
  }
  EXPECT_GT(std::count(must_refuse.begin(), must_refuse.end(), true), 100);
  EXPECT_GT(std::count(faults.begin(), faults.end(), ""), 60);
}

TEST(SchemaTable, EveryKeyIsInTheSceneDocumentWithItsUnit) {
  const std::string document =
      read_file(std::filesystem::path(FREEFLEX_SOURCE_DIR) / "service/scenes/README.md");
  each_section([&](const Section& section, const std::string& chapter) {
    const std::string heading = chapter.empty()
                                    ? "\n## Sections\n"
                                    : "\n### " + (chapter == "tolerance" ? "fidelity" : chapter) + "\n";
    const std::size_t begin = document.find(heading);
    ASSERT_NE(begin, std::string::npos) << heading;
    std::istringstream text(document.substr(begin + 1, document.find("\n##", begin + 1) - begin));
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    for (const Key& key : section.keys) {
      EXPECT_TRUE(std::string_view(".!").find(key.about.back()) != std::string_view::npos) << key.about;
      const std::regex word("`[^`]*\\b" + std::string(key.name) + "\\b[^`]*`");
      const std::string unit = key.quantity.unit == "-" ? "" : "[" + std::string(key.quantity.unit) + "]";
      EXPECT_TRUE(std::any_of(lines.begin(), lines.end(),
                              [&](const std::string& line) {
                                return std::regex_search(line, word) && line.find(unit) != std::string::npos;
                              }))
          << heading << key.name << " " << unit;
    }
  });
}

TEST(SchemaTable, ExamplesTogetherMakeAValidScene) {
  Json scene;
  for (const Key& key : io::reader::sections::kScene.keys)
    if (!key.example.empty()) scene[std::string(key.name)] = Json::parse(key.example);
  const TemporaryFolder folder;
  folder.write("scene.yaml", scene.dump());
  const io::PlanResult result = io::load_plan("scene.yaml");
  for (const Fault& fault : result.faults) ADD_FAILURE() << io::format_fault(fault, result.sources);
  EXPECT_TRUE(result.plan.has_value());
  EXPECT_EQ(ask_schema({scene.dump()})[0], "");
}

}  // namespace
}  // namespace freeflex::testing
