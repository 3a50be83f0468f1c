// --help documents every field that a command prints with --json.
#include <gtest/gtest.h>

#include <regex>
#include <sstream>
#include <vector>

#include "tests/tools/json_fields.hpp"
#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

using Json = nlohmann::json;

/// Holds a scene of four points and six springs with a pulse of force. With this scene, the JSON of `freeflex
/// plan` and of `freeflex run` has every field.
const std::string kScene =
    "name: tetrahedron\nfidelity: auto\ntolerance: {elastic: 0.5, horizon: 0.05}\n"
    "verdict: {horizon: 0.05}\npoints:\n"
    "  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: b, mass: 1, at: [1, 0, 0]}\n"
    "  - {name: c, mass: 1, at: [0, 1, 0]}\n  - {name: d, mass: 1, at: [0, 0, 1]}\n"
    "links:\n  - {spring: [a, b, c, a, d, b], stiffness: 1e4}\n  - {spring: [c, d], stiffness: 1e4}\n"
    "loads:\n  - {name: kick, forces: {d: [0.3, 0.5, 0.2]}, pulse: {start: 0, duration: 0.02}}\n"
    "leave_out: {on_need: refuse}\n";

/// Returns the text of the documentation on a command that stands below the output of --help.
std::string section_of(const std::string& command) {
  return read_text(std::string(FREEFLEX_SOURCE_DIR) + "/tools/docs/commands/" + command + ".md");
}

class Help : public ::testing::Test {
 protected:
  Help() { write_text(folder_ / "scene.yaml", kScene); }
  /// Runs a command line, whose first word is the command, in the folder of the scene. Returns the JSON of
  /// the command, and expects every field of the JSON in the help.
  Json expect_documented(const std::string& arguments, int exit_code = 0) {
    const Outcome outcome = run("cd " + folder_.path() + " && " + kFreeflex + " " + arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << arguments << outcome.err;
    const Json json = Json::parse(outcome.out, nullptr, false);
    EXPECT_TRUE(json.is_object()) << arguments << outcome.out;
    const std::string help = run(kFreeflex + " " + arguments.substr(0, arguments.find(' ')) + " --help").out;
    EXPECT_TRUE(contains(help, "JSON fields:")) << help;
    EXPECT_EQ(undocumented(json, help.substr(std::min(help.size(), help.find("JSON fields:")))), "")
        << arguments;
    // for studies the documentation lists only the top-level fields
    if (!arguments.starts_with("report")) {
      EXPECT_EQ(undocumented(json, section_of(arguments.substr(0, arguments.find(' ')))), "") << arguments;
    }
    return json;
  }
  TemporaryFolder folder_;
};

TEST_F(Help, ListsTheJsonFieldsOfCommandsThatExamineAScene) {
  write_text(folder_ / "bad.yaml", "points:\n  - {name: a, mass: -1, at: [0, 0, 0]}\n");
  expect_documented("check --json scene.yaml");
  expect_documented("check --json bad.yaml", 2);
  expect_documented("modes --json scene.yaml");
  expect_documented("modes --json " + kGolden + "chain.yaml");
  expect_documented("modes --json " + kScenes + "boom.yaml --spin 1");
  expect_documented("inspect --json scene.yaml");
  expect_documented("inspect --json " + kGolden + "chain.yaml");
  expect_documented("loads --json scene.yaml --force d=1,0,0");
  const Json plan = expect_documented("plan --json scene.yaml");
  EXPECT_FALSE(plan["rungs_tried"].empty());
  EXPECT_FALSE(plan["verdict"].is_null());
  EXPECT_FALSE(plan["features"].empty());
}

TEST_F(Help, ListsTheJsonFieldsOfCommandsThatRunAScene) {
  EXPECT_EQ(
      expect_documented("compile --json scene.yaml -o scene.plan")["fingerprint"].get<std::string>().size(),
      16u);
  const Json flown = expect_documented("run --json scene.yaml --until 0.1 --out a.log");
  EXPECT_GT(flown["judged_tick"], 0) << flown;
  expect_documented("run --json scene.yaml --until 0.1 --explain");
  expect_documented("replay --json a.log");
  expect_documented("replay --json none.log", 2);
}

TEST_F(Help, ListsTheJsonFieldsOfStudies) {
  const Json report =
      expect_documented("report --json --repeats 1 --until 0.05 --budget 0.2 --estimates 1 scene.yaml");
  EXPECT_FALSE(report["scenes"][0]["comparisons"].empty());
  EXPECT_FALSE(report["estimates"]["scenes"].empty());
  // An interrupt leaves only the first cases, which already have all fields. If the first case is not done
  // after a second, as with a sanitizer on a busy machine, the interrupt comes later.
  Outcome cut;
  Json table;
  for (int seconds = 1; seconds <= 16 && !table.is_object(); seconds *= 4) {
    cut = run("timeout -s INT " + std::to_string(seconds) + " " + kFreeflex +
              " stability --quick --json; true");
    table = Json::parse(cut.out, nullptr, false);
  }
  ASSERT_TRUE(table.is_object()) << cut.out << cut.err;
  EXPECT_FALSE(table["cases"].empty());
  EXPECT_EQ(undocumented(table, run(kFreeflex + " stability --help").out), "");
}

// the scene has one link of each kind that has columns of its own
TEST_F(Help, ListsTheColumnsOfATable) {
  write_text(folder_ / "links.yaml",
             "points:\n  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: b, mass: 1, at: [1, 0, 0]}\n"
             "  - {name: c, mass: 1, at: [1, 1, 0]}\n  - {name: d, mass: 1, at: [0, 1, 1]}\nlinks:\n"
             "  - {spring: [a, b, c, d, a], stiffness: 1}\n  - {name: D, dashpot: [a, c], damping: 1}\n"
             "  - {name: R, rigid: [b, d]}\n  - {name: B, bending: [a, b, c], stiffness: 1}\n"
             "  - {name: T, torsion: [a, b, c, d], stiffness: 1}\n"
             "  - {name: P, plate: [a, b, c], E: 1, nu: 0.3, thickness: 0.1}\n"
             "  - {name: M, beam: [a, d], EA: 1, GJ: 1, EIy: 1, EIz: 1}\n");
  const Outcome outcome =
      run("cd " + folder_.path() + " && " + kFreeflex + " run links.yaml --until 0 --out -");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string help = run(kFreeflex + " run --help").out, document = section_of("run");
  std::istringstream header(outcome.out.substr(0, outcome.out.find('\n')));
  for (std::string column; std::getline(header, column, ',');) {
    const std::size_t last = column.rfind('.');
    std::string expected = column;
    if (column.starts_with("q") && std::isdigit(static_cast<unsigned char>(column.back())) != 0)
      expected = column.starts_with("q_dot") ? "q_dot1.." : "q1..";
    else if (last != std::string::npos)
      expected =
          column.substr(0, column.find('.')) + ".NAME" +
          (std::isdigit(static_cast<unsigned char>(column.back())) != 0 ? ".1 .." : column.substr(last));
    // the help shows a prefix only for the first component, as in point.NAME.x y z [m], vx vy vz
    if (column.starts_with("point.") || column.starts_with("group.")) {
      EXPECT_TRUE(contains(help, expected.substr(0, expected.rfind('.')) + ".x")) << expected;
      EXPECT_TRUE(std::regex_search(help, std::regex("[ .]" + column.substr(last + 1) + "[ ,;]")))
          << expected;
      continue;
    }
    EXPECT_TRUE(contains(help, expected)) << column << " as " << expected << " in " << help;
    if (column.starts_with("link.")) {
      EXPECT_TRUE(contains(document, expected.substr(0, expected.find(' ')))) << expected;
    }
  }
  for (const char* kind : {"dashpot", "rigid link", "bending or torsion", "plate"})
    EXPECT_TRUE(contains(help, kind)) << kind;
}

TEST_F(Help, StatesTheExitCodeOfAnInterruptThatLeavesResults) {
  for (const char* command : {"report", "stability", "run", "replay"}) {
    const std::string help = run(kFreeflex + " " + command + " --help").out;
    EXPECT_TRUE(contains(help.substr(std::min(help.size(), help.find("Exit codes"))), "130 interrupted"))
        << help;
  }
}

TEST_F(Help, FitsTheScreen) {
  std::vector<std::string> programs{kFreeflex, kFreeflexd};
  for (const char* command : {"check", "schema", "modes", "inspect", "loads", "plan", "report", "stability",
                              "compile", "run", "keygen", "push", "monitor", "replay", "export", "campaign"})
    programs.push_back(kFreeflex + " " + command);
  for (const std::string& program : programs) {
    const std::string help = run(program + " --help").out;
    EXPECT_TRUE(contains(help, "Usage: freeflex")) << program;
    std::istringstream lines(help);
    for (std::string line; std::getline(lines, line);)
      EXPECT_LE(line.size(), 120u) << program << ": " << line;
    // --help before the command gives the same text as --help after the command
    if (const std::size_t blank = program.rfind(' '); blank != std::string::npos) {
      EXPECT_EQ(run(kFreeflex + " --help" + program.substr(blank)).out, help) << program;
    }
  }
}

}  // namespace
}  // namespace freeflex::testing
