// Faults are written as text for the screen and as JSON for programs.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "service/io/scene/input.hpp"
#include "tests/scene/temporary_folder.hpp"

namespace freeflex::testing {
namespace {

TEST(FaultText, TheCaretStandsBelowTheColumnOfTheFault) {
  const TemporaryFolder folder;
  // a tab and a character of two bytes each count as one column
  folder.write("scene.yaml", "points:\n  - {name: a,\tmass: -1, at: [0, 0, 0]}  # \xc3\xa9\n");
  const io::SceneResult result = io::read_scene("scene.yaml");
  ASSERT_EQ(result.faults.size(), 1u);
  EXPECT_EQ(io::format_fault(result.faults[0], result.sources),
            "scene.yaml:2:21: error: point 'a': mass is -1 kg, but must be >= 0\n      - {name: a, mass: -1, "
            "at: [0, 0, 0]}  # \xc3\xa9\n                        ^");
}

TEST(FaultText, TheColumnOfTheCaretCountsCharactersNotBytes) {
  const TemporaryFolder folder;
  folder.write("scene.yaml", "{\"\xc3\xa9\xc3\xa9\": 1, points: {mass: -1, at: [0, 0, 0]}}\n");
  const io::SceneResult result = io::read_scene("scene.yaml");
  ASSERT_EQ(result.faults.size(), 2u);
  EXPECT_EQ(io::format_fault(result.faults[1], result.sources),
            "scene.yaml:1:26: error: point 1: mass is -1 kg, but must be >= 0\n    {\"\xc3\xa9\xc3\xa9\": 1, "
            "points: {mass: -1, at: [0, 0, 0]}}\n                             ^");
}

TEST(FaultText, LongLinesAreCutAroundTheCaret) {
  const TemporaryFolder folder;
  folder.write("scene.yaml",
               std::string(500, ' ') + "points: {mass: -1, at: [0, 0, 0]}" + std::string(500, ' ') + "\n");
  const io::SceneResult result = io::read_scene("scene.yaml");
  ASSERT_EQ(result.faults.size(), 1u);
  const std::string text = io::format_fault(result.faults[0], result.sources);
  const std::size_t line = text.find('\n') + 1, caret_line = text.find('\n', line) + 1;
  ASSERT_NE(caret_line, 0u);
  EXPECT_LE(caret_line - line, 110u);
  const std::size_t column = text.find('^') - caret_line;
  EXPECT_EQ(text.substr(line + column, 10), "-1, at: [0");
}

TEST(FaultText, TheLocationIsOmittedIfItIsUnknown) {
  const Fault fault{Fault::Severity::kWarning, {}, "slow"};
  EXPECT_EQ(io::format_fault(fault, {"boom.yaml"}), "boom.yaml: warning: slow");
  EXPECT_EQ(io::format_fault(fault, {}), "warning: slow");
}

TEST(FaultText, JsonContainsEveryFieldOfEveryFault) {
  const Faults faults{{Fault::Severity::kError, {1, 14, 7}, "link \"l3\"\n\xff"},
                      {Fault::Severity::kWarning, {}, "slow"}};
  const auto parsed = nlohmann::json::parse(io::faults_to_json(faults, {"boom.yaml", "links.csv"}));
  const auto expected = nlohmann::json::parse(R"([
      {"file": "links.csv", "line": 14, "column": 7, "severity": "error", "message": "link \"l3\"\n\ufffd"},
      {"file": "boom.yaml", "line": 0, "column": 0, "severity": "warning", "message": "slow"}])");
  EXPECT_EQ(parsed, expected);
  EXPECT_EQ(nlohmann::json::parse(io::faults_to_json({}, {})), nlohmann::json::array());
}

// one reading reports all faults: here of a value, of a key, of positions and of a mode number
TEST(FaultText, PhysicalFaultsAreReportedTogetherWithFaultsOfTheReader) {
  const TemporaryFolder folder;
  folder.write("scene.yaml", R"(rate: -5
points:
  - {name: a, mass: 1, at: [0, 0, 0]}
  - {name: b, mass: 1, at: [0, 0, 0]}
  - {name: c, mass: 1, at: [1, 0, 0]}
links:
  - {spring: [a, b], stiffness: 1}
  - {spring: [b, c], stifness: 1}
initial: {modes: {99: {q: 1}}}
)");
  const io::SceneResult result = io::read_scene("scene.yaml");
  std::vector<std::string> found;
  for (const Fault& fault : result.faults) found.push_back(io::format_fault(fault, result.sources, false));
  EXPECT_FALSE(result.scene);
  ASSERT_EQ(found.size(), 4u);
  EXPECT_EQ(found[0].rfind("scene.yaml:1:7: error: scene: rate", 0), 0u) << found[0];
  EXPECT_EQ(found[1],
            "scene.yaml:7:5: error: link 1 joins 'a', 'b', which are in one place, but a link needs a length "
            "> 0; move a point or remove the link");
  EXPECT_NE(found[2].find("the key 'stifness' is unknown"), std::string::npos) << found[2];
  EXPECT_EQ(
      found[3],
      "scene.yaml:9:10: error: initial state names elastic mode 99, but there are only 4, numbered from 1");
}

// the rigid links have the numbers 4 and 5 among all links, but are the second and the third item of the list
TEST(FaultText, AWarningStatesTheListPositionOfALinkAfterAChain) {
  const TemporaryFolder folder;
  folder.write("scene.yaml", R"(points:
  - {name: a, mass: 1, at: [0, 0, 0]}
  - {name: b, mass: 1, at: [1, 0, 0]}
  - {name: c, mass: 1, at: [0, 1, 0]}
links:
  - {spring: [a, b, c, a], stiffness: 1}
  - {rigid: [a, b]}
  - {rigid: [b, a]}
)");
  const io::PlanResult result = io::load_plan("scene.yaml");
  ASSERT_TRUE(result.plan);
  std::string found;
  for (const Fault& fault : result.faults) found += io::format_fault(fault, result.sources, false) + "\n";
  const bool is_second = found.find(
                             "scene.yaml:7:5: warning: rigid link 2 is redundant, because a freedom that it "
                             "removes is removed by 3 already") != std::string::npos;
  const bool is_third = found.find(
                            "scene.yaml:8:5: warning: rigid link 3 is redundant, because a freedom that it "
                            "removes is removed by 2 already") != std::string::npos;
  EXPECT_TRUE(is_second != is_third) << found;
  EXPECT_EQ(result.plan->links[4].name, "5") << "the name of a link is its number among all links";
}

}  // namespace
}  // namespace freeflex::testing
