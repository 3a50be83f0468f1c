// `freeflex inspect` shows the quantities of the paper as text and as JSON.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

using Json = nlohmann::json;

/// Runs `freeflex inspect` on a scene given as text.
Outcome inspect(const std::string& yaml, const std::string& options) {
  const TemporaryFolder folder;
  write_text(folder / "scene.yaml", yaml);
  return run(kFreeflex + " inspect " + options + " " + folder / "scene.yaml");
}

Json inspect_json(const std::string& yaml, const std::string& options, int exit_code = 0) {
  const Outcome outcome = inspect(yaml, "--json " + options);
  EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
  return outcome.out.empty() ? Json() : Json::parse(outcome.out);
}

/// Returns a scene of the corners of a unit cube in lexicographic order. Springs join every pair.
std::string cube() {
  std::string yaml = "points:\n";
  for (int i = 0; i < 8; ++i)
    yaml += "  - {name: c" + std::to_string(i) + ", mass: 1, at: [" + std::to_string(i / 4) + ", " +
            std::to_string(i / 2 % 2) + ", " + std::to_string(i % 2) + "]}\n";
  yaml += "links:\n";
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < i; ++j)
      yaml += "  - {spring: [c" + std::to_string(j) + ", c" + std::to_string(i) + "], stiffness: 1000}\n";
  return yaml;
}

const std::string kPair =
    "points:\n  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: b, mass: 3, at: [2, 0, 0]}\n"
    "links:\n  - {spring: [a, b], stiffness: 500}\n";

// for masses m1 and m2 at the distance L on a spring of stiffness k, with M = m1 + m2: I = m1 m2 L^2 / M, c =
// k M^2 / (m1 m2), omega^2 = c / M
TEST(Inspect, ShowsTheClosedFormsOfTwoMassesAndASpringInEveryBasis) {
  for (const char* basis : {"auto", "collinear", "formal", "householder", "modes"}) {
    const Json json = inspect_json(kPair, std::string("--basis ") + basis);
    EXPECT_EQ(json["basis"]["recipe"], std::string(basis) == "auto" ? "collinear" : basis);
    EXPECT_DOUBLE_EQ(json["mass"], 4.0);
    EXPECT_DOUBLE_EQ(json["centre"][0], 1.5);
    EXPECT_NEAR(json["inertia"][1][1], 3.0, 1e-15);
    EXPECT_NEAR(json["principal_moments"][2], 3.0, 1e-14);
    EXPECT_EQ(json["shape"], "collinear");
    EXPECT_EQ(json["rigid_freedoms"], 5);
    EXPECT_EQ(json["elastic_freedoms"], 1);
    EXPECT_EQ(json["basis"]["rank"], 1);
    EXPECT_NEAR(json["c"]["matrix"][0][0], 500.0 * 16.0 / 3.0, 1e-11);
    EXPECT_NEAR(json["delta"]["matrix"][0][0], 3.0 / 8000.0, 1e-17);
    EXPECT_EQ(json["delta"]["redundant_links"], 0);
    EXPECT_NEAR(json["frequencies"][0], std::sqrt(2000.0 / 3.0) / (2.0 * std::numbers::pi), 1e-13);
  }
}

// beta_i = (M / m_i) f_i of point i (THEORY 4.2), with f_1 = -1 N and f_2 = 1 N along the line; sum_i m_i
// b_i.b_i = M, so beta = C b with C = M / sqrt(m1 m2)
TEST(Inspect, ShowsTheCoefficientOfTheOnlyGroup) {
  const Json json = inspect_json(kPair, "--basis collinear");
  EXPECT_NEAR(json["basis"]["C"][0][0], 4.0 / std::sqrt(3.0), 1e-14);
  EXPECT_NEAR(std::abs(double{json["basis"]["b"][0][0]}), std::sqrt(3.0), 1e-14);
  EXPECT_EQ(json["basis"]["kept"][0], "a - b");
}

TEST(Inspect, ReportsThatACubeIsRenumbered) {
  const Json json = inspect_json(cube(), "");
  EXPECT_EQ(json["shape"], "spatial");
  EXPECT_EQ(json["basis"]["recipe"], "spatial");
  EXPECT_EQ(json["basis"]["rank_as_numbered"], 15);
  EXPECT_EQ(json["basis"]["rank"], 18);
  EXPECT_EQ(json["delta"]["redundant_links"], 10);
  EXPECT_LT(double{json["inverse_error"]}, 1e-12);
  const Outcome text = inspect(cube(), "");
  EXPECT_TRUE(contains(text.out, "basis              spatial, rank 18 of 18")) << text.out;
  EXPECT_TRUE(contains(text.out, "the order of the scene gives rank 15; the order used instead is c"))
      << text.out;
  EXPECT_TRUE(contains(text.out, "statically indeterminate to degree 10")) << text.out;
}

TEST(Inspect, TheFormalRecipeListsTheLoadThatItSkipsForEachRigidFreedom) {
  const Json json = inspect_json(cube(), "--basis formal");
  EXPECT_EQ(json["basis"]["groups"], 24);
  ASSERT_EQ(json["basis"]["skipped"].size(), 6u);
  const std::string name = json["basis"]["skipped"][0];
  EXPECT_EQ(name.size(), 4u) << name;  // "c5 x"
  EXPECT_LT(double{json["basis"]["most_skipped"]}, 1e-14);
  EXPECT_GT(double{json["basis"]["least_kept"]}, 0.1);
}

// ten points lie in a plane and one point above it, so every numbering has four consecutive points in the
// plane
TEST(Inspect, AnIncompleteRecipeIsExplainedAndAutoChoosesTheFormalRecipe) {
  std::string yaml = "points:\n";
  for (int i = 0; i < 10; ++i)
    yaml += "  - {name: g" + std::to_string(i) + ", mass: 1, at: [" + std::to_string(i / 5) + ", " +
            std::to_string(i % 5) + ", 0]}\n";
  yaml += "  - {name: apex, mass: 1, at: [0.3, 1.7, 1]}\nlinks:\n";
  for (int i = 0; i < 10; ++i) {
    yaml += "  - {spring: [g" + std::to_string(i) + ", apex], stiffness: 1000}\n";
    for (int j = 0; j < i; ++j)
      yaml += "  - {spring: [g" + std::to_string(j) + ", g" + std::to_string(i) + "], stiffness: 1000}\n";
  }
  const Json json = inspect_json(yaml, "--basis spatial", 1);
  EXPECT_EQ(json["basis"]["rank"], 23);
  EXPECT_EQ(json["basis"]["expected"], 27);
  ASSERT_EQ(json["basis"]["flat_points"].size(), 4u);
  const Outcome text = inspect(yaml, "--basis spatial");
  EXPECT_EQ(text.exit_code, 1);
  EXPECT_TRUE(contains(text.out, "the rank is short by 4")) << text.out;
  EXPECT_TRUE(contains(text.out, "lie in one plane")) << text.out;
  EXPECT_EQ(inspect_json(yaml, "")["basis"]["recipe"], "formal");
}

TEST(Inspect, AMechanismIsReportedWithItsPointsAndHasNoDelta) {
  const std::string yaml =
      "points:\n  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: b, mass: 1, at: [1, 0, 0]}\n"
      "  - {name: c, mass: 1, at: [2, 0, 0]}\nlinks:\n  - {spring: [a, b, c], stiffness: 10}\n";
  const Json json = inspect_json(yaml, "");
  EXPECT_EQ(json["delta"]["exists"], false);
  EXPECT_TRUE(contains(json["delta"]["reason"], "no link resists the motion of ")) << json["delta"];
  EXPECT_EQ(json["c"]["exists"], true);
  EXPECT_EQ(json["mechanisms"].size(), 2u);
  ASSERT_TRUE(json.contains("inverse_error"));
  EXPECT_TRUE(json["inverse_error"].is_null());
  EXPECT_TRUE(contains(inspect(yaml, "").out, "delta              does not exist: no link resists"));
}

TEST(Inspect, CountsRigidLinksAndTheirRedundancies) {
  // three rigid links and a rigid body fix the same three distances, so three of the six constraints are
  // redundant
  const std::string yaml =
      "points:\n  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: b, mass: 1, at: [1, 0, 0]}\n"
      "  - {name: c, mass: 1, at: [0, 1, 0]}\n  - {name: d, mass: 1, at: [0.2, 0.3, 1]}\nlinks:\n"
      "  - {rigid: [a, b]}\n  - {rigid: [b, c]}\n  - {rigid: [c, a]}\n  - {rigid: [a, b, c]}\n"
      "  - {spring: [a, d], stiffness: 10}\n  - {spring: [b, d], stiffness: 10}\n"
      "  - {spring: [c, d], stiffness: 10}\n";
  for (const char* basis : {"spatial", "formal", "householder", "modes"}) {
    const Json json = inspect_json(yaml, std::string("--basis ") + basis);
    EXPECT_EQ(json["constraints"], 3);
    EXPECT_EQ(json["redundant_constraints"], 3);
    EXPECT_EQ(json["elastic_freedoms"], 12 - 6 - 3);
    EXPECT_EQ(json["basis"]["rank"], 3);
    EXPECT_LT(double{json["basis"]["constraint_residual"]}, 1e-14);
    EXPECT_EQ(json["c"]["exists"], true);
    EXPECT_EQ(json["delta"]["exists"], true);
  }
}

TEST(Inspect, ARecipeForAnotherShapeOrAPlanFileGivesExitTwo) {
  const Outcome shape = inspect(cube(), "--basis collinear");
  EXPECT_EQ(shape.exit_code, 2);
  EXPECT_TRUE(shape.out.empty());
  EXPECT_TRUE(contains(shape.err, "the collinear recipe needs a collinear shape, but this shape is spatial"))
      << shape.err;
  EXPECT_EQ(inspect(cube(), "--basis sideways").exit_code, 2);
  const TemporaryFolder folder;
  ASSERT_EQ(run(kFreeflex + " compile " + kScenes + "boom.yaml -o " + folder / "boom.plan").exit_code, 0);
  const Outcome plan = run(kFreeflex + " inspect " + folder / "boom.plan");
  EXPECT_EQ(plan.exit_code, 2);
  EXPECT_TRUE(contains(plan.err, "is a plan")) << plan.err;
}

TEST(Inspect, LargeScenesGiveSummariesInsteadOfMatrices) {
  const Outcome outcome = run(kFreeflex + " inspect --json " + kScenes + "beam101.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  EXPECT_EQ(json["elastic_freedoms"], 298);
  EXPECT_FALSE(json["c"].contains("matrix"));
  EXPECT_FALSE(json["basis"].contains("C"));
  EXPECT_EQ(json["c"]["size"], 298);
  EXPECT_GT(double{json["c"]["least_diagonal"]}, 0.0);
}

TEST(Inspect, HelpShowsAnExampleAndExitCodes) {
  const Outcome outcome = run(kFreeflex + " inspect --help");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_TRUE(contains(outcome.out, "freeflex inspect service/scenes/boom.yaml")) << outcome.out;
  EXPECT_TRUE(contains(outcome.out, "Exit codes: 0 ")) << outcome.out;
}

// a scene with a coupled rung or `fidelity: auto` gives the response of `spin-loaded`, the highest linear
// rung
TEST(Loads, StaticLoadsAreComputedByTheLinearEquationsOnEveryRung) {
  const TemporaryFolder folder;
  const auto answer = [&](const std::string& fidelity) {
    write_text(folder / "scene.yaml", cube() + "fidelity: " + fidelity + "\n");
    const Outcome outcome = run(kFreeflex + " loads --json --force c0=1,0,0 " + (folder / "scene.yaml"));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.out;
  };
  const std::string linear = answer("spin-loaded");
  EXPECT_TRUE(contains(linear, "c0")) << linear;
  for (const char* rung :
       {"coupled", "corotational", "full", "auto\ntolerance: {elastic: 0.1, horizon: 0.01}"})
    EXPECT_EQ(answer(rung), linear) << rung;
  const std::string plan = folder / "coupled.plan";
  write_text(folder / "scene.yaml", cube() + "fidelity: coupled\n");
  ASSERT_EQ(run(kFreeflex + " compile " + (folder / "scene.yaml") + " -o " + plan).exit_code, 0);
  const Outcome refused = run(kFreeflex + " loads --force c0=1,0,0 " + plan);
  EXPECT_EQ(refused.exit_code, 2) << refused.out;
  EXPECT_TRUE(contains(refused.err, "name the scene")) << refused.err;
}

}  // namespace
}  // namespace freeflex::testing
