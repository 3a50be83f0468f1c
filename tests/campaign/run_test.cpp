// freeflex campaign as a user runs it: shares of the cases, kills, controllers and wrong campaigns.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <string>
#include <thread>
#include <tuple>

#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

const std::string kPair =
    "points: [{name: a, mass: 1, at: [0, 0, 0]}, {name: b, mass: 1, at: [1, 0, 0]}]\n"
    "links: {name: s, spring: [a, b], stiffness: 50}\n"
    "initial: {points: {a: {displacement: [-0.001, 0, 0]}, b: {displacement: [0.001, 0, 0]}}}\n";

const std::string kVary =
    "vary:\n"
    "  - {name: k, path: links.s.stiffness, lognormal: {median: 50, log_sd: 0.2}}\n"
    "  - {name: m, path: ['points.*.mass*'], uniform: [0.8, 1.2]}\n"
    "measure:\n"
    "  - {name: end, of: point.b.dx, take: final}\n"
    "  - {name: speed, of: point.b.vx, take: largest, fail_above: 0.0115}\n";

std::string campaign_text(int cases, const std::string& rest = kVary, double until = 0.5) {
  return "scene: pair.yaml\ncases: " + std::to_string(cases) + "\nuntil: " + std::to_string(until) + "\n" +
         rest;
}

class Campaigns : public ::testing::Test {
 protected:
  Campaigns() { write_text(folder_ / "pair.yaml", kPair); }

  void write(const std::string& text) { write_text(folder_ / "c.yaml", text); }
  Outcome campaign(const std::string& arguments, const std::string& before = "") {
    return run("cd '" + folder_.path() + "' && " + before + " '" + kFreeflex + "' campaign " + arguments);
  }
  std::string table(const std::string& out) { return read_text(folder_ / (out + "/cases.csv")); }

  TemporaryFolder folder_;
};

TEST_F(Campaigns, OneTableWhoeverRunsTheCases) {
  write(campaign_text(300));
  const Outcome one = campaign("run c.yaml --out one --jobs 1");
  ASSERT_EQ(one.exit_code, 0) << one.err;
  EXPECT_TRUE(contains(one.out, "300 cases: ")) << one.out;
  EXPECT_TRUE(contains(one.out, "probability of failure")) << one.out;
  ASSERT_EQ(campaign("run c.yaml --out two --jobs 2").exit_code, 0);
  for (int shard = 6; shard >= 0; --shard)
    ASSERT_EQ(campaign("run c.yaml --out seven --jobs 1 --shard " + std::to_string(shard) + "/7").exit_code,
              0);
  EXPECT_EQ(campaign("merge c.yaml --out seven").exit_code, 0);
  const std::string text = table("one");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 301);
  EXPECT_EQ(text.substr(0, text.find('\n')), "case,outcome,k,m,end,speed,message");
  EXPECT_EQ(table("two"), text);
  EXPECT_EQ(table("seven"), text);
  EXPECT_TRUE(contains(read_text(folder_ / "one/cases.html"), "<svg"));
}

TEST_F(Campaigns, GoOnAfterBeingKilledAtAnyMoment) {
  write(campaign_text(6000));
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(campaign("run c.yaml --out whole").exit_code, 0);
  const double whole = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::mt19937 random(1);
  int kills = 0;
  for (Outcome last; kills < 60; ++kills) {
    const double seconds = std::uniform_real_distribution<double>(0.02, 0.3 * whole)(random);
    last = campaign("run c.yaml --out killed", "timeout -s KILL " + std::to_string(seconds));
    if (last.exit_code == 0) break;
    ASSERT_NE(last.exit_code, 1) << last.err;
    ASSERT_NE(last.exit_code, 2) << last.err;
  }
  EXPECT_GT(kills, 2) << "fewer kills say little; take more cases";
  ASSERT_EQ(campaign("run c.yaml --out killed").exit_code, 0);
  EXPECT_EQ(table("killed"), table("whole"));
}

TEST_F(Campaigns, StatusSaysWhatIsLeft) {
  write(campaign_text(30));
  ASSERT_EQ(campaign("run c.yaml --shard 1/3").exit_code, 0);
  const Outcome status = campaign("status c.yaml");
  EXPECT_EQ(status.exit_code, 0);
  EXPECT_TRUE(contains(status.out, "1 file in c.results, 20 cases missing")) << status.out;
  const Outcome merge = campaign("merge c.yaml");
  EXPECT_EQ(merge.exit_code, 3);
  EXPECT_TRUE(contains(merge.err, "20 cases of 30 have no result")) << merge.err;
  EXPECT_EQ(campaign("merge c.yaml --partial").exit_code, 0);
  ASSERT_EQ(campaign("run c.yaml").exit_code, 0);
  EXPECT_TRUE(contains(campaign("status c.yaml").out, "complete"));
}

TEST_F(Campaigns, ChangedFilesAreNotMixed) {
  write(campaign_text(10));
  ASSERT_EQ(campaign("run c.yaml").exit_code, 0);
  write_text(folder_ / "pair.yaml", kPair + "damping: {ratio: 0.1}\n");
  const Outcome changed = campaign("run c.yaml");
  EXPECT_EQ(changed.exit_code, 2);
  EXPECT_TRUE(contains(changed.err, "belongs to another campaign, or to an earlier state of its files"))
      << changed.err;
}

TEST_F(Campaigns, RerunGivesACaseAsASceneAndARecording) {
  write(campaign_text(20));
  ASSERT_EQ(campaign("run c.yaml").exit_code, 0);
  const Outcome rerun = campaign("rerun c.yaml 7");
  ASSERT_EQ(rerun.exit_code, 0) << rerun.err;
  const std::string text = table("c.results"), row = text.substr(text.find("\n7,") + 1);
  EXPECT_TRUE(contains(rerun.out, row.substr(0, row.find('\n')))) << rerun.out;
  const Outcome replay = run("'" + kFreeflex + "' replay '" + folder_ / "c.results/case-7.log" + "'");
  EXPECT_EQ(replay.exit_code, 0) << replay.err;
  EXPECT_TRUE(contains(read_text(folder_ / "c.results/case-7.yaml"), "base: "));
  const Outcome missing = campaign("rerun c.yaml 20");
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_TRUE(contains(missing.err, "there is no case 20; the numbers are 0 to 19")) << missing.err;
}

TEST_F(Campaigns, ShrinkFindsTheValueThatMatters) {
  // fails where the spring is stiff, whatever the other values are
  write(campaign_text(40,
                      "vary:\n"
                      "  - {name: k, path: links.s.stiffness, uniform: [20, 80]}\n"
                      "  - {name: m, path: ['points.*.mass*'], uniform: [0.99, 1.01]}\n"
                      "  - {name: z, path: initial.velocity, list: [[0, 0, 0], [0, 0, 1]]}\n"
                      "measure: {name: force, of: link.s.axial, take: largest, fail_above: 0.14}\n"));
  ASSERT_EQ(campaign("run c.yaml").exit_code, 0);
  const std::string text = table("c.results");
  const std::size_t failed = text.find(",failed,");
  ASSERT_NE(failed, std::string::npos);
  const std::size_t line = text.rfind('\n', failed) + 1;
  const Outcome shrink = campaign("shrink c.yaml " + text.substr(line, failed - line));
  ASSERT_EQ(shrink.exit_code, 0) << shrink.err;
  EXPECT_TRUE(contains(shrink.out, "not nominal: 1 value of 3\n  k: 70.")) << shrink.out;
}

TEST_F(Campaigns, WrongOnesAreRefusedWithTheirPlace) {
  write(
      campaign_text(10, "vary: {path: links.t.stiffness, uniform: [1, 2]}\nmeasure: {of: x, take: final}\n"));
  Outcome wrong = campaign("run c.yaml");
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_TRUE(contains(wrong.err, "links.t.stiffness=1.5: error: links: no item is named 't'")) << wrong.err;
  write(campaign_text(10, "measure: {of: point.c.x, take: final}\n"));
  wrong = campaign("run c.yaml");
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_TRUE(
      contains(wrong.err,
               "c.yaml:4:10: error: measure 'point.c.x.final': of: 'point.c.x': the scene has no point 'c'"))
      << wrong.err;
  EXPECT_EQ(campaign("run none.yaml").exit_code, 2);
  EXPECT_TRUE(contains(campaign("run").err, "FILE is missing")) << campaign("run").err;
  EXPECT_TRUE(contains(campaign("run c.yaml --jobs 0").err, "must be a whole number from 1 to 4096"));
  EXPECT_EQ(campaign("run c.yaml --shard 5/5").exit_code, 2);
}

TEST_F(Campaigns, FilesThatOnlyVariedValuesNameBelongToTheCampaign) {
  // a beam of two nodes as a matrix of zeros and a spring: only the file of the second value changes
  const auto matrix = [&](const char* name, int k) {
    std::string text = "%%MatrixMarket matrix coordinate real general\n6 6 4\n";
    for (const auto& [row, column, sign] : {std::tuple(1, 1, 1), {1, 4, -1}, {4, 1, -1}, {4, 4, 1}})
      text += std::to_string(row) + " " + std::to_string(column) + " " + std::to_string(sign * k) + "\n";
    write_text(folder_ / name, text);
  };
  matrix("one.mtx", 40);
  matrix("two.mtx", 50);
  std::string scene = kPair;
  const std::string spring = "{name: s, spring: [a, b], stiffness: 50}";
  scene.replace(scene.find(spring), spring.size(), "{name: s, matrix: one.mtx, points: [a, b]}");
  write_text(folder_ / "pair.yaml", scene);
  write(campaign_text(6,
                      "vary: {name: m, path: links.s.matrix, list: [one.mtx, two.mtx]}\n"
                      "measure: {of: point.b.dx, take: final}\n"));
  const Outcome ran = campaign("run c.yaml --shard 0/2");
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  matrix("two.mtx", 90);
  const Outcome changed = campaign("run c.yaml");
  EXPECT_EQ(changed.exit_code, 2);
  EXPECT_TRUE(contains(changed.err, "belongs to another campaign") && contains(changed.err, "two.mtx"))
      << changed.err;
}

TEST_F(Campaigns, MayGetMoreCases) {
  write(campaign_text(20));
  ASSERT_EQ(campaign("run c.yaml").exit_code, 0);
  const std::string first = table("c.results");
  write(campaign_text(50));
  ASSERT_EQ(campaign("run c.yaml").exit_code, 0);
  EXPECT_EQ(table("c.results").substr(0, first.size()), first);
  EXPECT_TRUE(contains(campaign("status c.yaml").out, "2 files in c.results, complete"));
  write(campaign_text(20));
  ASSERT_EQ(campaign("merge c.yaml").exit_code, 0);
  EXPECT_EQ(table("c.results"), first);
}

TEST_F(Campaigns, CasesThatAreRefusedDoNotStopTheOthers) {
  write(campaign_text(60,
                      "vary: {name: m, path: points.a.mass, normal: {mean: 1, sd: 1}}\n"
                      "measure: {of: point.b.dx, take: final}\n"));
  const Outcome ran = campaign("run c.yaml");
  EXPECT_EQ(ran.exit_code, 0) << ran.err;
  const std::string text = table("c.results");
  EXPECT_TRUE(contains(text, ",refused,-")) << text;
  EXPECT_TRUE(contains(text, "kg, but must be >= 0")) << text;
  EXPECT_TRUE(contains(text, ",passed,")) << text;
}

TEST_F(Campaigns, AFullDiskKeepsWhatIsWritten) {
  write(campaign_text(2000));
  // the limit on the size of files acts as a full disk
  const Outcome full = campaign("run c.yaml --jobs 1", "ulimit -f 24;");
  EXPECT_EQ(full.exit_code, 1);
  EXPECT_TRUE(contains(full.err, "cases are left")) << full.err;
  const Outcome status = campaign("status c.yaml");
  EXPECT_EQ(status.exit_code, 0) << status.err;
  EXPECT_FALSE(contains(status.out, "incomplete by killed")) << status.out;
  EXPECT_FALSE(contains(status.out, "\n0 cases")) << status.out;
  EXPECT_EQ(campaign("run c.yaml").exit_code, 0);
}

TEST_F(Campaigns, AFullDiskEndsTheTableInHdf5WithItsReason) {
  write(campaign_text(2000));
  ASSERT_EQ(campaign("run c.yaml").exit_code, 0);
  // of the three files of a merge, only the last and smallest fits
  const Outcome full = campaign("merge c.yaml --hdf5", "rm c.results/cases.*; ulimit -f 60;");
  EXPECT_EQ(full.exit_code, 1) << full.err;
  EXPECT_TRUE(contains(full.err, "cannot write")) << full.err;
  EXPECT_EQ(campaign("merge c.yaml --hdf5").exit_code, 0);
}

TEST_F(Campaigns, LoadsOfTheSceneActInEachCase) {
  write_text(folder_ / "pair.yaml",
             kPair + "loads: {name: push, forces: {b: [0, 0, 4]}, pulse: {start: 0, duration: 0.1}}\n");
  write(campaign_text(3, "measure: {of: z, take: final}\n"));
  ASSERT_EQ(campaign("run c.yaml").exit_code, 0);
  // 4 N for 0.1 s on 2 kg, then 0.4 s at 0.2 m/s: 0.01 + 0.08 m
  const std::string text = table("c.results");
  EXPECT_NEAR(std::stod(text.substr(text.find("0,passed,") + 9)), 0.09, 1e-12) << text;
}

}  // namespace
}  // namespace freeflex::testing
