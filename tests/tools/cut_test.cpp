// These tests use a recording that is cut off, as it is when the disk becomes full. Every command uses the
// complete records, reports the position of the cut, and exits with code 3.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

using Json = nlohmann::json;

/// Makes a recording of two seconds of the boom, and a copy that ends after the first half of the file.
class Cut : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(freeflex("run " + kScenes + "boom.yaml --until 2 --out whole.log").exit_code, 0);
    const std::string whole = read_text(folder_ / "whole.log");
    write_text(folder_ / "cut.log", std::string_view(whole).substr(0, whole.size() / 2));
  }
  Outcome freeflex(const std::string& arguments) {
    return run("cd " + folder_.path() + " && " + kFreeflex + " " + arguments);
  }
  /// Expects exit code 3 and a message with the position of the cut.
  static void expect_named(const Outcome& outcome) {
    EXPECT_EQ(outcome.exit_code, 3) << outcome.out << outcome.err;
    EXPECT_TRUE(contains(outcome.err, "cut.log is damaged at byte ") &&
                contains(outcome.err, ": the file ends inside a record, after "))
        << outcome.err;
  }
  /// Returns the last tick that a replay of the cut recording reaches.
  std::int64_t known_tick() { return Json::parse(freeflex("replay --json cut.log").out)["ticks"]; }
  TemporaryFolder folder_;
};

TEST_F(Cut, ReplayComparesTheCompleteRecordsOfACutRecording) {
  const Outcome outcome = freeflex("replay cut.log");
  expect_named(outcome);
  EXPECT_TRUE(outcome.out.starts_with("the states up to tick " + std::to_string(known_tick()) +
                                      " are as recorded, to the bit ("))
      << outcome.out;
  EXPECT_GT(known_tick(), 500);
  EXPECT_LT(known_tick(), 1500);
}

TEST_F(Cut, RunAppliesTheCommandsOfACutRecordingUpToTheCut) {
  const std::string known = std::to_string(known_tick());
  for (const char* until : {"", " --until 2"}) {
    const Outcome outcome = freeflex("run " + kScenes + "boom.yaml --log cut.log --out fed.log" + until);
    expect_named(outcome);
    EXPECT_TRUE(contains(outcome.err, "; the run ends at tick " + known +
                                          ", the last tick whose commands are all "
                                          "known"))
        << outcome.err;
    EXPECT_TRUE(contains(outcome.out, "fed.log: " + known + " ticks")) << outcome.out;
    EXPECT_EQ(freeflex("compare whole.log fed.log --common").exit_code, 0);
  }
  const Outcome shorter =
      freeflex("run " + kScenes + "boom.yaml --log cut.log --json --out fed.log --until 0.5");
  expect_named(shorter);
  EXPECT_EQ(Json::parse(shorter.out)["ticks"], 500);
  EXPECT_EQ(Json::parse(shorter.out)["complete"], false);
}

TEST_F(Cut, CompareUsesTheCompleteRecordsAndReportsTheCut) {
  for (const char* more : {"", " --common"}) {
    const Outcome outcome = freeflex(std::string("compare whole.log cut.log") + more);
    expect_named(outcome);
    EXPECT_TRUE(contains(outcome.out, "elastic coordinates [m] ")) << outcome.out;
    EXPECT_TRUE(contains(outcome.out, " of STATE that only the first contains")) << outcome.out;
  }
  const Json json = Json::parse(freeflex("compare whole.log cut.log --json").out);
  EXPECT_EQ(json["result"], "incomplete");
  EXPECT_GT(json["rows"], 10);
  EXPECT_TRUE(json["first"].is_null());
}

TEST_F(Cut, CompareUsesTheRowsBeforeTheCutOfATable) {
  write_text(folder_ / "a.csv", "tick,x\n0,1\n1,2\n2,3\n");
  write_text(folder_ / "b.csv", "tick,x\n0,1\n1,2\n2,");
  const Outcome same = freeflex("compare a.csv b.csv --json");
  EXPECT_EQ(same.exit_code, 3);
  EXPECT_EQ(Json::parse(same.out)["rows"], 2);
  EXPECT_TRUE(contains(Json::parse(same.out)["error"], "b.csv, line 4: the last line has no end"))
      << same.out;
  write_text(folder_ / "b.csv", "tick,x\n0,1\n1,7\n2,");
  EXPECT_EQ(freeflex("compare a.csv b.csv").exit_code, 1);
}

TEST_F(Cut, ViewShowsTheCompleteRecordsOfACutRecording) {
  const Outcome outcome = freeflex("view cut.log --html a.html");
  expect_named(outcome);
  EXPECT_GT(read_text(folder_ / "a.html").size(), 10'000u);
}

TEST_F(Cut, ARecordingCutWithinItsFirstRecordIsReported) {
  write_text(folder_ / "cut.log", read_text(folder_ / "whole.log").substr(0, 100));
  for (const char* arguments : {"replay cut.log", "compare cut.log whole.log", "view cut.log --html a.html"})
    expect_named(freeflex(arguments));
  expect_named(freeflex("run " + kScenes + "boom.yaml --log cut.log --out a.log"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.log") || std::filesystem::exists(folder_ / "a.html"));
}

}  // namespace
}  // namespace freeflex::testing
