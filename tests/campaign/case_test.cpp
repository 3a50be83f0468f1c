// Cases against closed forms: a spring, a free body, and what a case may depend on.
#include "service/campaign/case.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "core/plan/file/plan_bytes.hpp"
#include "service/campaign/measures.hpp"
#include "service/campaign/numbers.hpp"
#include "tests/scene/temporary_folder.hpp"
#include "tools/campaign/summary.hpp"

namespace freeflex::campaign {
namespace {

using testing::TemporaryFolder;

// two points of 1 kg on a spring of 50 N/m, 10 rad/s, stretched by 2 mm
const std::string kPair =
    "points: [{name: a, mass: 1, at: [0, 0, 0]}, {name: b, mass: 1, at: [1, 0, 0]}]\n"
    "links: {name: s, spring: [a, b], stiffness: 50}\n"
    "initial: {velocity: [0, 0, 0.5], points: {a: {displacement: [-0.001, 0, 0]}, b: {displacement: [0.001, "
    "0, 0]}}}\n";

struct Ran {
  Campaign campaign;
  std::vector<CaseResult> results;
};

Ran run_all(const std::string& text, const std::string& scene = kPair) {
  const TemporaryFolder folder;
  folder.write("pair.yaml", scene);
  folder.write("campaign.yaml", "scene: pair.yaml\n" + text);
  CampaignResult read = read_campaign("campaign.yaml");
  for (const Fault& fault : read.faults) ADD_FAILURE() << io::format_fault(fault, read.sources);
  Ran ran{std::move(read.campaign.value()), {}};
  CaseRunner runner(ran.campaign);
  Commander none;
  for (std::int64_t k = 0; k < ran.campaign.sampling.cases; ++k) ran.results.push_back(runner.run(k, none));
  return ran;
}

Tally tally_of(const Measure& measure, const std::vector<double>& values) {
  Tally tally(measure, 1.0);
  for (std::size_t k = 0; k < values.size(); ++k) tally.take(static_cast<std::int64_t>(k), values[k]);
  return tally;
}

double statistic(Statistic of, const std::vector<double>& values, double target = 0.0, double band = 0.0) {
  const Measure measure{.statistic = of, .target = target, .band = band};
  return tally_of(measure, values).result();
}

TEST(Statistics, AreThoseOfTheValues) {
  const std::vector<double> values{3.0, -5.0, 1.0, 2.0};
  EXPECT_EQ(statistic(Statistic::kLargest, values), 5.0);
  EXPECT_EQ(statistic(Statistic::kMax, values), 3.0);
  EXPECT_EQ(statistic(Statistic::kMin, values), -5.0);
  EXPECT_EQ(statistic(Statistic::kMean, values), 0.25);
  EXPECT_EQ(statistic(Statistic::kRms, values), std::sqrt(39.0 / 4.0));
  EXPECT_EQ(statistic(Statistic::kFinal, values), 2.0);
  EXPECT_TRUE(std::isnan(statistic(Statistic::kMax, {})));
  EXPECT_TRUE(std::isnan(statistic(Statistic::kMax, {1.0, std::nan(""), 2.0})));
}

TEST(Statistics, SettlingTimeIsThatAfterWhichAllValuesAreInTheBand) {
  EXPECT_EQ(statistic(Statistic::kSettlingTime, {5, 1, 3, 1.1, 0.9, 1}, 1.0, 0.2), 3.0);
  EXPECT_EQ(statistic(Statistic::kSettlingTime, {1, 1, 1}, 1.0, 0.2), 0.0);
  EXPECT_TRUE(std::isinf(statistic(Statistic::kSettlingTime, {1, 1, 2}, 1.0, 0.2)));
}

TEST(Statistics, OvershootIsTheDistanceBeyondTheTargetSeenFromTheFirstValue) {
  EXPECT_EQ(statistic(Statistic::kOvershoot, {0, 2, 1.25, 0.5}, 1.0), 1.0);
  EXPECT_EQ(statistic(Statistic::kOvershoot, {3, 2, 0.5, 1}, 1.0), 0.5);
  EXPECT_EQ(statistic(Statistic::kOvershoot, {0, 0.5, 1.0}, 1.0), 0.0);
}

TEST(Statistics, SumsAreCompensated) {
  // the mean of 100,000 values 0.1; a sum without compensation has a relative error of about 1e-12
  EXPECT_EQ(statistic(Statistic::kMean, std::vector<double>(100'000, 0.1)), 0.1);
}

TEST(Cases, MeasureASpringAsItsClosedFormSays) {
  const Ran ran = run_all(
      "cases: 1\nuntil: 1\nmeasure:\n"
      "  - {name: largest, of: point.a.dx, take: largest}\n"
      "  - {name: rms, of: point.b.displacement, take: rms}\n"
      "  - {name: final, of: point.b.dx, take: final}\n"
      "  - {name: force, of: link.s.axial, take: max}\n"
      "  - {name: speed, of: point.b.vx, take: largest}\n"
      "  - {name: energy, of: energy, take: final}\n"
      "  - {name: height, of: z, take: final}\n");
  const CaseResult& result = ran.results[0];
  ASSERT_EQ(result.outcome, Outcome::kPassed) << result.message;
  EXPECT_EQ(result.ticks, 1000);
  EXPECT_NEAR(result.measures[0], 0.001, 1e-15);
  // the mean of cos^2 over 0 to 1 s, by the trapezoidal sum of which the ends count whole
  double sum = 0.0;
  for (int k = 0; k <= 1000; ++k) sum += std::pow(0.001 * std::cos(0.01 * k), 2);
  EXPECT_NEAR(result.measures[1], std::sqrt(sum / 1001.0), 1e-15);
  EXPECT_NEAR(result.measures[2], 0.001 * std::cos(10.0), 1e-15);
  EXPECT_NEAR(result.measures[3], 50 * 0.002, 1e-14);
  EXPECT_NEAR(result.measures[4], 0.01, 1e-6);  // the tick nearest to the largest speed
  EXPECT_NEAR(result.measures[5], 0.5 * 50 * 0.002 * 0.002 + 0.5 * 2 * 0.25, 1e-14);
  EXPECT_NEAR(result.measures[6], 0.5, 1e-14);
}

TEST(Cases, TheFrequencyFollowsTheValuesThatAreSet) {
  const Ran ran = run_all(
      "cases: 20\nuntil: 0.5\nvary:\n"
      "  - {name: k, path: links.s.stiffness, uniform: [20, 80]}\n"
      "  - {name: m, path: ['points.*.mass*'], uniform: [0.5, 2]}\n"
      "measure: {of: point.b.dx, take: final}\n");
  for (const CaseResult& result : ran.results) {
    ASSERT_EQ(result.outcome, Outcome::kPassed) << result.message;
    const double omega = std::sqrt(2.0 * std::stod(result.values[0]) / std::stod(result.values[1]));
    EXPECT_NEAR(result.measures[0], 0.001 * std::cos(0.5 * omega), 1e-14);
  }
}

TEST(Cases, DoNotDependOnThoseBefore) {
  const std::string text =
      "cases: 5\nuntil: 0.1\nvary: {name: k, path: links.s.stiffness, uniform: [20, 80]}\n"
      "measure: {of: point.b.dx, take: final}\n";
  const Ran ran = run_all(text);
  const TemporaryFolder folder;
  folder.write("pair.yaml", kPair);
  folder.write("campaign.yaml", "scene: pair.yaml\n" + text);
  const Campaign campaign = read_campaign("campaign.yaml").campaign.value();
  for (std::int64_t k = 4; k >= 0; --k) {
    CaseRunner alone(campaign);
    Commander none;
    EXPECT_EQ(table_row(campaign, alone.run(k, none)),
              table_row(ran.campaign, ran.results[static_cast<std::size_t>(k)]));
  }
}

TEST(Cases, ThatShareAStructureHaveThePlansOfThoseThatDoNot) {
  const std::string text =
      "cases: 4\nuntil: 0.1\nvary:\n"
      "  - {name: v, path: initial.velocity, list: [[0, 0, 1], [0, 1, 0]]}\n"
      "  - {name: t, path: loads.push.pulse.start, uniform: [0, 0.05]}\n"
      "measure: {of: point.b.z, take: final}\n";
  const std::string scene =
      kPair + "loads: {name: push, forces: {b: [0, 0, 4]}, pulse: {start: 0, duration: 0.1}}\n";
  const TemporaryFolder folder;
  folder.write("pair.yaml", scene);
  folder.write("campaign.yaml", "scene: pair.yaml\n" + text);
  const Campaign campaign = read_campaign("campaign.yaml").campaign.value();
  CaseRunner together(campaign);
  for (std::int64_t k = 0; k < 4; ++k) {
    CaseRunner alone(campaign);
    std::string fault;
    const auto shared = together.plan_of(together.case_of(k), fault),
               own = alone.plan_of(alone.case_of(k), fault);
    ASSERT_TRUE(shared != nullptr && own != nullptr) << fault;
    EXPECT_EQ(plan_fingerprint(shared->plan), plan_fingerprint(own->plan));
  }
}

TEST(Cases, AreRefusedIfTheirValuesAreNotAllowed) {
  const Ran ran = run_all(
      "cases: 20\nuntil: 0.1\nvary: {path: points.a.mass, list: [1, -1], name: m}\n"
      "measure: {of: point.b.dx, take: final}\nseed: 3\n");
  int refused = 0;
  for (const CaseResult& result : ran.results) {
    EXPECT_EQ(result.outcome == Outcome::kRefused, result.values[0] == "-1");
    if (result.values[0] == "1") continue;
    ++refused;
    EXPECT_EQ(result.outcome, Outcome::kRefused);
    EXPECT_EQ(table_row(ran.campaign, result),
              std::to_string(result.number) + ",refused,-1,,\"point 'a': mass is -1 kg, but must be >= 0\"");
  }
  EXPECT_GT(refused, 2);  // of 20
}

// A structure that cases share was checked with the values of the first of them.
TEST(Cases, AreRefusedEvenIfTheirStructureIsShared) {
  const Ran ran = run_all(
      "cases: 20\nuntil: 0.1\nvary: {path: initial, list: [{modes: {1: {q: 0.01}}}, {modes: {99: {q: "
      "0.01}}}], name: i}\n"
      "measure: {of: point.b.dx, take: final}\n");
  for (const CaseResult& result : ran.results)
    EXPECT_EQ(result.outcome == Outcome::kRefused, result.values[0].find("99") != std::string::npos)
        << result.values[0] << " " << result.message;
}

TEST(Cases, WithoutATickInAWindowAreRefused) {
  EXPECT_EQ(run_all("cases: 1\nuntil: 0.0004\nmeasure: {of: x, take: final}\n").results[0].message,
            "until is shorter than a tick of 0.001 s");
  EXPECT_EQ(run_all("cases: 1\nuntil: 1\nmeasure: {of: x, take: final, from: 0.0004, to: 0.0006}\n")
                .results[0]
                .message,
            "measure 'x.final': no tick is between from and to; a tick takes 0.001 s");
}

TEST(Statistics, CountTheTickAtTheEnd) {
  // 9 * 0.001 > 0.009
  for (int last = 1; last <= 2000; ++last) {
    const Measure measure{.statistic = Statistic::kFinal,
                          .to = std::stod("0." + std::to_string(10000 + last).substr(1)) * 10};
    Tally tally(measure, 0.001);
    EXPECT_EQ(tally.last_tick(), last);
  }
}

TEST(Cases, AttitudeIsTheAngleFromTheReference) {
  // a body of 2 kg m^2 that spins at 0.5 rad/s about z for 2 s
  const Ran ran = run_all(
      "cases: 1\nuntil: 2\nmeasure:\n"
      "  - {name: a, of: attitude, take: final}\n"
      "  - {name: b, of: attitude, take: final, reference: [0.8775825618903728, 0, 0, 0.479425538604203]}\n"
      "  - {name: s, of: spin, take: mean}\n",
      "points: [{name: a, mass: 1, at: [0, 0, 0], inertia: [2, 2, 2]}]\ninitial: {angular_velocity: [0, 0, "
      "0.5]}\n");
  ASSERT_EQ(ran.results[0].outcome, Outcome::kPassed) << ran.results[0].message;
  EXPECT_NEAR(ran.results[0].measures[0], 1.0, 1e-14);
  EXPECT_NEAR(ran.results[0].measures[1], 0.0, 1e-14);
  EXPECT_NEAR(ran.results[0].measures[2], 0.5, 1e-15);
}

TEST(Cases, NumberModesAsTheSceneDoes) {
  // of the four modes of a chain, two of them mechanisms, the plan keeps those that the start excites
  const std::string chain =
      "points: [{name: a, mass: 1, at: [0, 0, 0]}, {name: b, mass: 1, at: [1, 0, 0]}, {name: c, mass: 1, at: "
      "[2, 0, 0]}]\n"
      "links: [{spring: [a, b], stiffness: 50}, {spring: [b, c], stiffness: 50}]\n"
      "commands: {points: []}\ninitial: {modes: {2: {q: 0.01}}}\n";
  const Ran ran = run_all(
      "cases: 2\nuntil: 0.01\nvary: {name: first, path: initial.modes.1.q, list: [0, 0.002]}\nmeasure:\n"
      "  - {of: q1, take: max}\n  - {of: q2, take: max}\n",
      chain);
  for (const CaseResult& result : ran.results) {
    ASSERT_EQ(result.outcome, Outcome::kPassed) << result.message;
    EXPECT_DOUBLE_EQ(result.measures[0], std::stod(result.values[0]));
    EXPECT_DOUBLE_EQ(result.measures[1], 0.01);
  }
  EXPECT_EQ(run_all("cases: 1\nuntil: 0.01\nmeasure: {of: q5, take: max}\n", chain).results[0].message,
            "measure 'q5.max': of: 'q5': there are 4 modes, so there is no q5");
}

TEST(Cases, FailByTheirLimits) {
  const Ran ran =
      run_all("cases: 1\nuntil: 1\nmeasure: {name: x, of: point.a.dx, take: largest, fail_above: 5e-4}\n");
  EXPECT_EQ(ran.results[0].outcome, Outcome::kFailed);
  EXPECT_TRUE(ran.results[0].message.starts_with("x is 0.00")) << ran.results[0].message;
  EXPECT_TRUE(ran.results[0].message.ends_with(", but may be at most 5e-04")) << ran.results[0].message;
}

TEST(Cases, AreUnstableIfTheStateIsNotFinite) {
  const Ran ran = run_all(
      "cases: 1\nuntil: 10\nset: {feedback: {at: b, velocity: 2000}}\nmeasure: {of: point.b.dx, take: "
      "final}\n");
  EXPECT_EQ(ran.results[0].outcome, Outcome::kUnstable);
  EXPECT_NE(ran.results[0].message.find("is not finite"), std::string::npos) << ran.results[0].message;
}

TEST(Cases, TheVerdictIsComputedWhereItIsMeasured) {
  const Ran ran = run_all(
      "cases: 1\nuntil: 2\nmeasure: [{of: verdict, take: largest}, {of: deformation_error, take: "
      "largest}]\n");
  ASSERT_EQ(ran.results[0].outcome, Outcome::kPassed) << ran.results[0].message;
  EXPECT_EQ(ran.results[0].measures[0], 0.0);
  EXPECT_LT(ran.results[0].measures[1], 2e-5) << "a hundredth of the stretch";
}

TEST(ArcTangent, IsThatOfTheLibraryToTheLastDigits) {
  double largest = 0.0;
  for (int k = 0; k <= 1'000'000; ++k) {
    const double angle = 0.5 * std::numbers::pi * k / 1'000'000.0, x = std::cos(angle), y = std::sin(angle);
    const double exact = std::atan2(y, x);
    if (exact > 0.0) largest = std::max(largest, std::abs(arc_tangent(y, std::max(x, 0.0)) / exact - 1.0));
  }
  EXPECT_LT(largest, 1e-15);
}

TEST(Fields, AreThoseOfCsv) {
  EXPECT_EQ(fields_of("1,passed,\"a, \"\"b\"\"\",,x"),
            (std::vector<std::string>{"1", "passed", "a, \"b\"", "", "x"}));
}

TEST(ProbabilityInterval, IsThatOfClopperAndPearson) {
  // exact: 0 of n has the upper limit 1 - (tail)^(1/n)
  EXPECT_NEAR(probability_interval(0, 10, 0.95).high, 1.0 - std::pow(0.025, 0.1), 1e-12);
  EXPECT_EQ(probability_interval(0, 10, 0.95).low, 0.0);
  // symmetric
  EXPECT_NEAR(probability_interval(3, 10, 0.95).low, 1.0 - probability_interval(7, 10, 0.95).high, 1e-12);
  // Clopper and Pearson's chart: 0.067 to 0.652 for 3 of 10
  EXPECT_NEAR(probability_interval(3, 10, 0.95).low, 0.0667, 5e-4);
  EXPECT_NEAR(probability_interval(3, 10, 0.95).high, 0.6525, 5e-4);
}

}  // namespace
}  // namespace freeflex::campaign
