// Faults read well on a screen and by a program.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "service/io/input.hpp"
#include "tests/scene/temporary_folder.hpp"

namespace freeflex::testing {
namespace {

TEST(FaultText, CaretStandsBelowTheColumn) {
  const TemporaryFolder folder;
  // characters of two bytes and tabs before the column count as one
  folder.write("scene.yaml", "points:\n  - {name: a,\tmass: -1, at: [0, 0, 0]}  # \xc3\xa9\n");
  const io::SceneResult result = io::read_scene("scene.yaml");
  ASSERT_EQ(result.faults.size(), 1u);
  EXPECT_EQ(io::format_fault(result.faults[0], result.sources),
            "scene.yaml:2:21: error: point 'a': mass -1 kg, must be > 0\n"
            "      - {name: a, mass: -1, at: [0, 0, 0]}  # \xc3\xa9\n"
            "                        ^");
}

TEST(FaultText, CaretCountsCharactersNotBytes) {
  const TemporaryFolder folder;
  folder.write("scene.yaml", "{\"\xc3\xa9\xc3\xa9\": 1, points: {mass: 0, at: [0, 0, 0]}}\n");
  const io::SceneResult result = io::read_scene("scene.yaml");
  ASSERT_EQ(result.faults.size(), 2u);
  EXPECT_EQ(io::format_fault(result.faults[1], result.sources),
            "scene.yaml:1:26: error: point 1: mass 0 kg, must be > 0\n"
            "    {\"\xc3\xa9\xc3\xa9\": 1, points: {mass: 0, at: [0, 0, 0]}}\n"
            "                             ^");
}

TEST(FaultText, LongLinesAreCutAroundTheCaret) {
  const TemporaryFolder folder;
  folder.write("scene.yaml",
               std::string(500, ' ') + "points: {mass: 0, at: [0, 0, 0]}" + std::string(500, ' ') + "\n");
  const io::SceneResult result = io::read_scene("scene.yaml");
  ASSERT_EQ(result.faults.size(), 1u);
  const std::string text = io::format_fault(result.faults[0], result.sources);
  const std::size_t line = text.find('\n') + 1, caret_line = text.find('\n', line) + 1;
  ASSERT_NE(caret_line, 0u);
  EXPECT_LE(caret_line - line, 110u);
  const std::size_t column = text.find('^') - caret_line;
  EXPECT_EQ(text.substr(line + column, 10), "0, at: [0,");
}

TEST(FaultText, PlaceIsLeftOutWhenThereIsNone) {
  const Fault fault{Fault::Severity::kWarning, {}, "slow"};
  EXPECT_EQ(io::format_fault(fault, {"boom.yaml"}), "boom.yaml: warning: slow");
  EXPECT_EQ(io::format_fault(fault, {}), "warning: slow");
}

TEST(FaultText, JsonHoldsEveryFieldOfEveryFault) {
  const Faults faults{{Fault::Severity::kError, {1, 14, 7}, "link \"l3\"\n\xff"},
                      {Fault::Severity::kWarning, {}, "slow"}};
  const auto parsed = nlohmann::json::parse(io::faults_to_json(faults, {"boom.yaml", "links.csv"}));
  const auto expected = nlohmann::json::parse(R"([
      {"file": "links.csv", "line": 14, "column": 7, "severity": "error", "message": "link \"l3\"\n\ufffd"},
      {"file": "boom.yaml", "line": 0, "column": 0, "severity": "warning", "message": "slow"}])");
  EXPECT_EQ(parsed, expected);
  EXPECT_EQ(nlohmann::json::parse(io::faults_to_json({}, {})), nlohmann::json::array());
}

}  // namespace
}  // namespace freeflex::testing
