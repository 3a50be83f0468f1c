// `freeflex compare` reports what differs and by how much, and what was not compared. The tests also check
// that recordings and tables have the same columns.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "freeflex_msgs/state_t.hpp"
#include "service/io/wire/codec.hpp"
#include "service/io/wire/decode.hpp"
#include "tests/tools/log_events.hpp"
#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

using Json = nlohmann::json;

class Compare : public ::testing::Test {
 protected:
  void make(const std::string& scene, const std::string& out, const std::string& more = "") {
    const Outcome outcome =
        run(kFreeflex + " run " + scene + " --until 0.5 --out " + folder_ / out + " " + more);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  Outcome compare(const std::string& a, const std::string& b, const std::string& more = "") {
    return run(kFreeflex + " compare " + folder_ / a + " " + folder_ / b + " " + more);
  }
  Json compare_json(const std::string& a, const std::string& b, const std::string& more = "") {
    return Json::parse(compare(a, b, "--json " + more).out);
  }
  static Json quantity(const Json& json, const std::string& name) {
    for (const Json& each : json["quantities"])
      if (each["name"] == name) return each;
    ADD_FAILURE() << "no " << name << " in " << json;
    return {};
  }
  TemporaryFolder folder_;
};

// a recording and a table of the same run contain the same values under the same names
TEST_F(Compare, ARecordingAndATableOfOneRunAgreeToTheBit) {
  for (const char* scene : {"satellite.yaml", "truss104.yaml", "boom.yaml"}) {
    const std::string publish = folder_ / "scene.yaml";
    make(kScenes + scene, "a.log");
    make(kScenes + scene, "a.csv");
    const Json json = compare_json("a.log", "a.csv");
    EXPECT_EQ(json["result"], "same") << json;
    EXPECT_GT(json["rows"], 10);
    for (const Json& each : json["quantities"]) EXPECT_EQ(each["largest"], 0.0) << each;
    EXPECT_GT(quantity(json, "points: acceleration [m/s^2]")["values"], 0);
  }
  const Json satellite = [&] {
    make(kScenes + "satellite.yaml", "s.log");
    make(kScenes + "satellite.yaml", "s.csv");
    return compare_json("s.log", "s.csv");
  }();
  for (const char* name : {"points: attitude [-]", "groups: attitude [-]", "groups: velocity [m/s]",
                           "wheels: momentum [N m s]", "elastic rates [m/s]", "attitude [-]"})
    EXPECT_GT(quantity(satellite, name)["values"], 0) << name;
}

TEST_F(Compare, ReportsWhereFilesDifferAndByHowMuch) {
  write_text(folder_ / "a.csv", "tick,time,x,point.tip.x,q1\n0,0,1,5,0\n1,0.1,2,6,-10\n2,0.2,3,7,4\n");
  write_text(folder_ / "b.csv",
             "tick,time,point.tip.x,x,q1,extra\n1,0.1,6,2.5,-10,1\n2,0.2,8,3,4,1\n3,0.3,9,9,9,1\n");
  const Json json = compare_json("a.csv", "b.csv");
  EXPECT_EQ(json["result"], "differs");
  EXPECT_EQ(json["rows"], 2);
  EXPECT_EQ(json["first"], (Json{{"tick", 1}, {"column", "x"}, {"a", 2.0}, {"b", 2.5}}));
  const Json position = quantity(json, "position [m]"), tip = quantity(json, "points: position [m]");
  EXPECT_EQ(position["largest"], 0.5);
  EXPECT_EQ(position["scale"], 3.0);
  EXPECT_EQ(tip["largest"], 1.0);
  EXPECT_EQ(tip["tick"], 2);
  EXPECT_EQ(tip["column"], "point.tip.x");
  EXPECT_EQ(quantity(json, "elastic coordinates [m]")["beyond"], false);
  EXPECT_EQ(
      json["not_compared"].dump(),
      R"(["1 tick of the table that only the first contains","1 tick of the table that only the second contains",)"
      R"("1 column that only the second contains: extra"])");
  // the largest differences are 1/8 and 1/6 of the largest values of their quantities
  EXPECT_EQ(compare("a.csv", "b.csv", "--common --tolerance 0.2").exit_code, 0);
  const Outcome part = compare("a.csv", "b.csv", "--tolerance 0.2");
  EXPECT_EQ(part.exit_code, 3);
  EXPECT_TRUE(contains(part.err, "the common part is the same")) << part.err;
  EXPECT_EQ(compare_json("a.csv", "b.csv", "--tolerance 0.2")["result"], "incomplete");
  EXPECT_EQ(compare("a.csv", "b.csv", "--tolerance 0.15").exit_code, 1);
  const Outcome text = compare("a.csv", "b.csv", "--tolerance 0.15");
  EXPECT_TRUE(contains(text.out, "differs from tick 1 on, where x is 2 and 2.5")) << text.out;
}

TEST_F(Compare, AQuaternionAndItsNegativeAreTheSameAttitude) {
  write_text(folder_ / "a.csv", "tick,qw,qx,qy,qz\n0,0.6,0,0,0.8\n");
  write_text(folder_ / "b.csv", "tick,qw,qx,qy,qz\n0,-0.6,0,0,-0.8\n");
  EXPECT_EQ(compare("a.csv", "b.csv").exit_code, 0);
  write_text(folder_ / "b.csv", "tick,qw,qx,qy,qz\n0,-0.6,0,0,0.8\n");
  EXPECT_EQ(compare("a.csv", "b.csv").exit_code, 1);
}

TEST_F(Compare, ComponentsOfAnAttitudeMayComeInAnyOrder) {
  write_text(folder_ / "a.csv", "tick,qw,qx,qy,qz\n0,0.1,0.2,0.3,0.9\n");
  write_text(folder_ / "b.csv", "tick,qz,qy,qw,qx\n0,-0.9,-0.3,-0.1,-0.2\n");
  EXPECT_EQ(compare("a.csv", "b.csv").exit_code, 0);
}

TEST_F(Compare, AnInfinityDoesNotHideOtherDifferences) {
  write_text(folder_ / "a.csv", "tick,x,y\n0,1,2\n1,1,3\n");
  write_text(folder_ / "b.csv", "tick,x,y\n0,1,700\n1,inf,3\n");
  EXPECT_EQ(compare("a.csv", "b.csv", "--tolerance 1e-6").exit_code, 1);
  EXPECT_EQ(compare("a.csv", "a.csv").exit_code, 0);
  EXPECT_EQ(compare("b.csv", "b.csv").exit_code, 0);
}

// the rungs `separated` and `coupled` have different equations, so the motions differ
TEST_F(Compare, MotionsOfTwoRungsDiffer) {
  make(kScenes + "truss-s5.yaml", "a.log");
  write_text(folder_ / "coupled.yaml", std::regex_replace(read_text(kScenes + "truss-s5.yaml"),
                                                          std::regex("csv: "), "csv: " + kScenes) +
                                           "\nfidelity: coupled\n");
  make(folder_ / "coupled.yaml", "b.log");
  const Json json = compare_json("a.log", "b.log", "--tolerance 1e-9");
  EXPECT_EQ(json["result"], "differs");
  const double share = quantity(json, "elastic coordinates [m]")["largest"].get<double>() /
                       quantity(json, "elastic coordinates [m]")["scale"].get<double>();
  EXPECT_GT(share, 1e-4);
  EXPECT_EQ(compare("a.log", "b.log", "--tolerance 10").exit_code, 0);
}

TEST_F(Compare, ANaNEqualsANaNAndDiffersFromANumber) {
  write_text(folder_ / "a.csv", "tick,x\n0,nan\n1,1\n");
  write_text(folder_ / "b.csv", "tick,x\n0,nan\n1,nan\n");
  const Json json = compare_json("a.csv", "b.csv", "--tolerance 100");
  EXPECT_EQ(json["result"], "differs");
  EXPECT_TRUE(quantity(json, "position [m]")["largest"].is_null());
  EXPECT_EQ(json["first"]["tick"], 1);
}

TEST_F(Compare, ReportsWhyAFileCannotBeCompared) {
  const auto refuses = [&](const std::string& text, int exit_code, const std::string& why) {
    write_text(folder_ / "a.csv", "tick,x\n0,1\n1,2\n");
    write_text(folder_ / "b.csv", text);
    const Outcome outcome = compare("a.csv", "b.csv");
    EXPECT_EQ(outcome.exit_code, exit_code) << text;
    EXPECT_TRUE(contains(outcome.err, why)) << outcome.err;
  };
  refuses("", 2, "the file is empty");
  refuses("a line\n", 2, "neither a recording nor a table");
  refuses("tick,x\n0,1\n1\n", 3, "line 3: the line has fewer columns");
  refuses("tick,x\n0,1\n1,2,3\n", 3, "line 3: the line has more columns");
  refuses("tick,x\n0,1\n1,two\n", 3, "line 3: a column has no number");
  refuses("tick,x\n0,1\n0,2\n", 3, "line 3: tick 0 follows tick 0");
  refuses("tick,x\n0,1\n1,2", 3, "line 3: the last line has no end");
  refuses("tick,y\n0,1\n", 3, "nothing was compared");
  refuses("tick,x\n7,1\n", 3, "nothing was compared");
  refuses("tick,x,x\n0,1,1\n", 2, "names the column 'x' twice");
  EXPECT_EQ(compare("a.csv", "nowhere.csv").exit_code, 2);
  EXPECT_EQ(compare("a.csv", "b.csv", "--tolerance -1").exit_code, 2);

  make(kScenes + "boom.yaml", "whole.log");
  const std::string log = read_text(folder_ / "whole.log");
  write_text(folder_ / "cut.log", log.substr(0, log.size() - 7));
  const Outcome cut = compare("whole.log", "cut.log");
  EXPECT_EQ(cut.exit_code, 3);
  EXPECT_TRUE(contains(cut.err, "cut.log")) << cut.err;
}

TEST_F(Compare, EachQuantityHasItsOwnScale) {
  // both links have a force of 1e4 N and a moment of 1 N m, and the other columns are a strain and a
  // temperature
  write_text(folder_ / "a.csv",
             "tick,link.a.1,link.a.2,link.b.1,link.b.2,strain,heat\n0,1e4,1,1e4,1,1e-6,300\n");
  write_text(folder_ / "b.csv",
             "tick,link.a.1,link.a.2,link.b.1,link.b.2,strain,heat\n0,1e4,2,1e4,1,1e-6,300\n");
  EXPECT_EQ(compare("a.csv", "b.csv", "--tolerance 1e-3").exit_code, 1);
  EXPECT_EQ(compare("a.csv", "b.csv", "--tolerance 0.5").exit_code, 0);
  write_text(folder_ / "b.csv",
             "tick,link.a.1,link.a.2,link.b.1,link.b.2,strain,heat\n0,1e4,1,1e4,1,9e-4,300\n");
  const Json json = compare_json("a.csv", "b.csv", "--tolerance 1e-3");
  EXPECT_EQ(json["result"], "differs");
  EXPECT_EQ(json["first"]["column"], "strain");
}

TEST_F(Compare, AFileWithTwoMotionsIsReported) {
  make(kScenes + "boom.yaml", "a.log");
  const std::string once = read_text(folder_ / "a.log");
  write_text(folder_ / "twice.log", once + once);
  EXPECT_EQ(compare("a.log", "twice.log").exit_code, 0);
  std::vector<io::LogEvent> events = read_events(folder_ / "a.log");
  const std::vector<io::LogEvent> first = events;
  for (const io::LogEvent& event : first) {
    freeflex_msgs::state_t state;
    if (event.channel != "FREEFLEX_STATE" || !io::decode_message(event.bytes, state)) continue;
    state.position[1] += 1e-3;
    events.push_back(event);
    events.back().bytes = io::encode(state);
  }
  write_events(folder_ / "both.log", events);
  const Outcome both = compare("a.log", "both.log");
  EXPECT_EQ(both.exit_code, 3) << both.out;
  EXPECT_TRUE(contains(both.err, "two motions were put into one file")) << both.err;
}

TEST_F(Compare, ADamagedLoadsMessageIsReported) {
  write_text(folder_ / "scene.yaml", read_text(kScenes + "boom.yaml") +
                                         "\npublish: {points: {rate: 100, of: all}, loads: {rate: 100}}\n");
  make(folder_ / "scene.yaml", "a.log");
  std::vector<io::LogEvent> events = read_events(folder_ / "a.log");
  for (io::LogEvent& event : events)
    if (event.channel == "FREEFLEX_LOADS") {
      event.bytes.resize(event.bytes.size() - 8);
      break;
    }
  write_events(folder_ / "b.log", events);
  for (const char* more : {"", "--common"}) {
    const Outcome outcome = compare("a.log", "b.log", more);
    EXPECT_EQ(outcome.exit_code, 3) << outcome.out;
    EXPECT_TRUE(contains(outcome.err, "FREEFLEX_LOADS")) << outcome.err;
  }
}

TEST_F(Compare, AnOptionWithoutEffectIsRefused) {
  write_text(folder_ / "a.csv", "tick,x\n0,1\n");
  EXPECT_EQ(compare("a.csv", "a.csv", "--session-a 1").exit_code, 2);
  EXPECT_EQ(compare("a.csv", "a.csv", "--prefix A").exit_code, 2);
  const Outcome pipe =
      run("bash -c '" + kFreeflex + " compare <(cat " + folder_ / "a.csv" + ") " + folder_ / "a.csv" + "'");
  EXPECT_EQ(pipe.exit_code, 2);
  EXPECT_TRUE(contains(pipe.err, "not a regular file")) << pipe.err;
}

TEST_F(Compare, ReplayReportsThatPointsWereNotCompared) {
  write_text(folder_ / "scene.yaml", read_text(kScenes + "boom.yaml") +
                                         "\npublish: {points: {rate: 100, of: all}, loads: {rate: 100}}\n");
  make(folder_ / "scene.yaml", "a.log");
  const Outcome outcome = run(kFreeflex + " replay " + folder_ / "a.log");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(contains(outcome.out, "not compared: 51 messages of POINTS")) << outcome.out;
}

}  // namespace
}  // namespace freeflex::testing
