// These tests check `freeflex plan`, and runs and replays of reduced plans.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "messages/channels.hpp"
#include "service/io/wire/codec.hpp"
#include "service/io/wire/log.hpp"
#include "service/io/wire/outbound.hpp"
#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

using Json = nlohmann::json;

/// Returns a scene with a square of beams in the xy plane, followed by the text `more`.
std::string square(const std::string& more) {
  return "rate: 1000\n"
         "points:\n"
         "  - {name: a, mass: 1, at: [0, 0, 0]}\n"
         "  - {name: b, mass: 1, at: [1, 0, 0]}\n"
         "  - {name: c, mass: 1, at: [1, 1, 0]}\n"
         "  - {name: d, mass: 2, at: [0, 1, 0]}\n"
         "links: [{beam: [a, b, c, d, a], EA: 1e5, GJ: 50, EIy: 40, EIz: 50}]\n" +
         more;
}

Json plan_json(const std::string& yaml, const std::string& options = "") {
  const TemporaryFolder folder;
  write_text(folder / "scene.yaml", yaml);
  const Outcome outcome = run(kFreeflex + " plan --json " + folder / "scene.yaml" + " " + options);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  return outcome.out.empty() ? Json() : Json::parse(outcome.out);
}

Json feature_of(const Json& plan, const std::string& name) {
  for (const Json& feature : plan["features"])
    if (feature["feature"] == name) return feature;
  ADD_FAILURE() << "no feature " << name;
  return {};
}

TEST(Plan, ReportsForEachFeatureWhetherAndWhyItIsOmitted) {
  const Json plan = plan_json(square("leave_out: {on_need: refuse}\n"));
  EXPECT_EQ(plan["modes_of_scene"], 6);
  EXPECT_EQ(plan["modes"], 5) << "four points have one mode out of their plane";
  EXPECT_EQ(plan["on_need"], "refuse");
  EXPECT_EQ(feature_of(plan, "out_of_plane")["left_out"], true);
  EXPECT_EQ(feature_of(plan, "out_of_plane")["count"], 1);
  EXPECT_EQ(feature_of(plan, "rotation")["left_out"], true);
  EXPECT_EQ(feature_of(plan, "damping")["left_out"], true);
  EXPECT_EQ(feature_of(plan, "gravity")["left_out"], true);
  EXPECT_EQ(feature_of(plan, "point_rows")["left_out"], false);
  for (const Json& feature : plan["features"])
    EXPECT_FALSE(feature["why"].get<std::string>().empty()) << feature;
  EXPECT_EQ(plan["scene_uses"]["loads"], false);
  EXPECT_GT(plan["ns"]["step"].get<double>(), 0.0);
}

TEST(Plan, ReportsTheCostOfSubstepsAndOfTheVerdict) {
  std::string scene = square("fidelity: full\nverdict: {horizon: 1}\n");
  const Json plan = plan_json(scene.replace(scene.find("rate: 1000"), 10, "rate: 100"));
  EXPECT_EQ(plan["rung"], "full");
  EXPECT_GT(plan["substeps_per_tick"], 1);
  EXPECT_EQ(plan["verdict"]["fidelity"], "full");
  EXPECT_EQ(plan["verdict"]["horizon"], 1.0);
  EXPECT_EQ(plan["verdict"]["every"], 1);
  EXPECT_LT(plan["verdict"]["step"].get<double>(), 0.01) << "the shadow divides the tick";
  EXPECT_GT(plan["verdict"]["delay"].get<double>(), 0.05);
  EXPECT_GT(plan["ns"]["stages"].get<double>(), 0.0);
  EXPECT_EQ(plan["ns"]["stages"], plan["ns"]["step"]);
  EXPECT_GT(plan["ns"]["shadow"].get<double>(), 0.0);
}

TEST(Plan, ReportsNoVerdictIfItIsOff) { EXPECT_EQ(plan_json(square("verdict: off\n"))["verdict"], nullptr); }

TEST(Plan, LinesFitTheScreen) {
  for (const char* scene : {"mast.yaml", "truss104.yaml"}) {
    const Outcome outcome = run(kFreeflex + " plan " + kScenes + scene);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    std::istringstream lines(outcome.out);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 120u) << line;
  }
}

TEST(Plan, TheOptionKeepRestoresFeatures) {
  const std::string yaml = square("damping: {ratio: 0}\nleave_out: {on_need: refuse}\n");
  const Json rotation = plan_json(yaml, "--keep rotation damping");
  EXPECT_EQ(feature_of(rotation, "rotation")["left_out"], false);
  EXPECT_EQ(feature_of(rotation, "damping")["left_out"], false);
  EXPECT_EQ(feature_of(rotation, "out_of_plane")["left_out"], true);
  const Json all = plan_json(yaml, "--keep all");
  for (const Json& feature : all["features"]) EXPECT_EQ(feature["left_out"], false) << feature;
  EXPECT_EQ(all["modes"], 6);
}

TEST(Plan, APlanFileGivesTheReportOfItsSceneAndRefusesKeep) {
  const TemporaryFolder folder;
  write_text(folder / "scene.yaml", square("leave_out: {on_need: replan}\n"));
  ASSERT_EQ(run(kFreeflex + " compile " + folder / "scene.yaml -o " + folder / "scene.plan").exit_code, 0);
  const Json scene = Json::parse(run(kFreeflex + " plan --json " + folder / "scene.yaml").out);
  const Json file = Json::parse(run(kFreeflex + " plan --json " + folder / "scene.plan").out);
  EXPECT_EQ(scene["features"], file["features"]);
  EXPECT_EQ(file["on_need"], "replan");
  const Outcome refused = run(kFreeflex + " plan " + folder / "scene.plan --keep all");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(contains(refused.err, "is a plan, whose features are fixed")) << refused.err;
}

/// Writes a log of one command at tick 40, whose force has a component out of the plane of the square.
void write_commands(const std::string& path) {
  ForceCommand command{};
  command.sender = {'t', 'e', 's', 't'};
  command.sequence = 1;
  command.axes = 1;
  command.start_tick = -1;
  command.duration_ticks = 100;
  command.num_points = 1;
  command.points[0] = {2, 0, {0.3, 0.0, 0.5}};
  io::Stamp stamp;
  stamp.session = 1;
  io::LogWriter writer(path);
  writer.write(std::string(channels::kDefaultPrefix) + channels::kApplied, 40000,
               io::encode(io::make_applied_force(command, 40, 0, stamp)));
  EXPECT_EQ(writer.close(), "");
}

TEST(Plan, ARunReplansAtTheRecordedTickAndItsReplayIsIdenticalToTheBit) {
  const TemporaryFolder folder;
  write_text(folder / "scene.yaml", square("publish: {state: 1000}\nleave_out: {on_need: replan}\n"));
  ASSERT_EQ(run(kFreeflex + " compile " + folder / "scene.yaml -o " + folder / "s.plan").exit_code, 0);
  write_commands(folder / "commands.log");
  const Outcome fed = run(kFreeflex + " run " + folder / "s.plan --log " +
                          folder / "commands.log --until 0.5 --out " + folder / "out.log");
  ASSERT_EQ(fed.exit_code, 0) << fed.err;
  const Outcome replayed = run(kFreeflex + " replay " + folder / "out.log --plan " + folder / "s.plan");
  EXPECT_EQ(replayed.exit_code, 0) << replayed.err << replayed.out;
  EXPECT_TRUE(contains(replayed.out, "identical to the bit over 500 ticks")) << replayed.out;
}

TEST(Plan, ATableHasTheColumnsOfTheFullPlan) {
  const TemporaryFolder folder;
  write_text(folder / "scene.yaml", square("publish: {state: 1000}\nleave_out: {on_need: replan}\n"));
  write_commands(folder / "commands.log");
  const Outcome fed = run(kFreeflex + " run " + folder / "scene.yaml --log " +
                          folder / "commands.log --until 0.1 --out " + folder / "out.csv");
  ASSERT_EQ(fed.exit_code, 0) << fed.err;
  const std::string table = read_text(folder / "out.csv");
  EXPECT_TRUE(contains(table.substr(0, table.find('\n')), ",q6,"))
      << "the plan has six modes, but only five before the command";
  std::size_t columns = 0;
  std::istringstream lines(table);
  for (std::string line; std::getline(lines, line);) {
    const auto count = static_cast<std::size_t>(std::count(line.begin(), line.end(), ','));
    if (columns == 0) columns = count;
    EXPECT_EQ(count, columns) << line;
  }
}

TEST(Plan, ARecordedCommandThatNeedsAnOmittedFeatureIsRefused) {
  const TemporaryFolder folder;
  write_text(folder / "scene.yaml", square("leave_out: {on_need: refuse}\n"));
  write_commands(folder / "commands.log");
  const Outcome refused = run(kFreeflex + " run " + folder / "scene.yaml --log " +
                              folder / "commands.log --until 0.1 --out " + folder / "out.log");
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_TRUE(contains(refused.err, "the plan omits rotation")) << refused.err;
}

TEST(Plan, SteadyLoadsAreComputedWithAllModesEvenIfThePlanOmitsSome) {
  const TemporaryFolder folder;
  write_text(folder / "full.yaml", square(""));
  write_text(folder / "reduced.yaml", square("leave_out: {on_need: refuse}\ncommands: {points: [b]}\n"));
  const std::string load = " --force d=0,0,1 --json";
  const Outcome full = run(kFreeflex + " loads " + folder / "full.yaml" + load),
                reduced = run(kFreeflex + " loads " + folder / "reduced.yaml" + load);
  ASSERT_EQ(full.exit_code, 0) << full.err;
  ASSERT_EQ(reduced.exit_code, 0) << reduced.err;
  const Json a = Json::parse(full.out), b = Json::parse(reduced.out);
  EXPECT_EQ(a["points"], b["points"]);
  ASSERT_EQ(run(kFreeflex + " compile " + folder / "reduced.yaml -o " + folder / "reduced.plan").exit_code,
            0);
  const Outcome refused = run(kFreeflex + " loads " + folder / "reduced.plan" + load);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(contains(refused.err, "name the scene")) << refused.err;
}

TEST(Plan, CostsAreMeasuredForTorquesInLocalAxesAndForARigidRungWithFeedback) {
  const TemporaryFolder folder;
  const std::string points =
      "points:\n  - {name: a, mass: 4, at: [0, 0, 0], inertia: [1, 1, 1]}\n  - {name: b, mass: 2, at: [3, 1, "
      "0]}\n"
      "links: [{beam: [a, b], EA: 6e7, GJ: 5e4, EIy: 7e4, EIz: 7e4}]\n";
  for (const char* rest : {"loads: [{axes: local, torques: {a: [0, 0.1, 0]}}]\n",
                           "fidelity: rigid\nfeedback: [{at: b, velocity: -1}]\n"}) {
    write_text(folder / "scene.yaml", points + rest);
    const Outcome outcome = run(kFreeflex + " plan --json " + folder / "scene.yaml");
    EXPECT_EQ(outcome.exit_code, 0) << rest << outcome.err;
  }
}

}  // namespace
}  // namespace freeflex::testing
