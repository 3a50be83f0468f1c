// Each cause of a verdict has a text with a remedy, which fits into the C interface.
#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "tests/motion/watched.hpp"

namespace freeflex::testing {
namespace {

using Level = Verdict::Level;
using Cause = Verdict::Cause;

Plan truss_plan(const char* load = "push", double tolerance = 0.0) {
  Scene scene = watched_truss(Fidelity::kSeparated, 10.0);
  scene.loads[0].name = load;
  scene.tolerance = tolerance;
  Plan plan = reduced_plan_of(scene);
  plan.verdict.fast_loads = {0};
  plan.verdict.shared = SharedError::kInside;
  plan.verdict.shared_text = "the inside of link 'K' is not known; compare with a model of its parts";
  return plan;
}

Verdict verdict_with(Cause cause) {
  Verdict verdict;
  verdict.level = Level::kWatch;
  verdict.cause = cause;
  verdict.tick = 100;
  verdict.error = {1.23e-3, 4.56e-3, 7.89e-5};
  verdict.own_error = 2.5e-5;
  verdict.displacement_now = 2e-4;
  verdict.scale = 1e-3;
  verdict.stopped = StepStatus::kNotFinite;
  return verdict;
}

TEST(VerdictText, EachCauseHasATextWithARemedy) {
  const std::map<Cause, std::vector<std::string>> expected{
      {Cause::kDeformation,
       {"deformation differs from", "rung corotational at", "; set fidelity: corotational",
        "freeflex run --explain", "7.9 % of 0.001 m (recent peak displacement)"}},
      {Cause::kPosition, {"the centre of mass is 0.0012 m from", "; set fidelity: corotational"}},
      {Cause::kAttitude, {"the attitude is 0.0046 rad from", "; set fidelity: corotational"}},
      {Cause::kLost, {"stopped, because it became infinite", "reduce the loads, raise the rate"}},
      {Cause::kCoarse,
       {"may itself be wrong by 2.5 % of 0.001 m (recent peak", "set verdict: {step: S} to a shorter step"}},
      {Cause::kRigid, {"the motion has no elastic modes", "deforms by 7.9e-05 m", "set a higher rung"}},
      {Cause::kFastLoad, {"load 'push' changes faster than the ticks", "raise the rate"}},
      {Cause::kRinging, {"fast modes ring, and the same motion on the rung corotational", "raise the rate"}},
      {Cause::kGrowth, {"grows fast, and only one horizon in 1 is judged", "raise verdict: {share: S}"}},
      {Cause::kMissedLoad, {"one horizon in 1 is judged, and larger loads act", "raise verdict: {share: S}"}},
      {Cause::kAttractor, {"the attractor is so near", "check the position with another program"}},
      {Cause::kShared,
       {"the inside of link 'K'", "compare with a model of its parts", "estimated error 7.9 %"}},
  };
  const Plan plan = truss_plan();
  for (const auto& [cause, parts] : expected) {
    const std::string text = text_of(plan, verdict_with(cause));
    std::printf("%s\n", text.c_str());
    for (const std::string& part : parts)
      EXPECT_NE(text.find(part), std::string::npos) << part << " in: " << text;
    EXPECT_LT(text.size(), 256U) << text;
    EXPECT_EQ(describe(plan, verdict_with(cause)), "watch (" + text + ")");
  }
  EXPECT_EQ(text_of(plan, verdict_with(Cause::kNone)), "");
}

// The field of the C interface has 256 bytes. The longest figures and a name of 64 letters fit too.
TEST(VerdictText, TheLongestTextFitsIntoTheCInterface) {
  Plan plan = truss_plan(std::string(64, 'x').c_str(), 1.2345e-123);
  plan.verdict.shared_text =
      "no rung with true geometry supports the scene, so second-order terms of links are not judged (" +
      std::string(80, 'y') + ")";
  plan.verdict.shadows[0].plan.period = 1.0 / 1234567.0;
  for (int k = 1; k <= static_cast<int>(Cause::kShared); ++k) {
    Verdict verdict = verdict_with(static_cast<Cause>(k));
    verdict.error = {1.2345e-123, 1.2345e-123, 0.2000001e-123};
    verdict.scale = plan.verdict.tolerance;
    verdict.stopped = StepStatus::kTurnedTooFar;
    const std::string text = text_of(plan, verdict);
    EXPECT_LT(text.size(), 256U) << text.size() << ": " << text;
  }
}

TEST(VerdictText, TheRemedyForAShadowOnTheSameRungIsAHigherRate) {
  Scene scene = watched_truss(Fidelity::kCorotational, 10.0);
  scene.integration.by = IntegrateBy::kModes;
  const std::string text = text_of(reduced_plan_of(scene), verdict_with(Cause::kDeformation));
  EXPECT_NE(text.find("at 4000 Hz; raise the rate; estimated"), std::string::npos) << text;
  scene.integration.by = IntegrateBy::kPoints;
  const std::string of_points = text_of(reduced_plan_of(scene), verdict_with(Cause::kDeformation));
  EXPECT_NE(of_points.find("at 4000 Hz; set a smaller accuracy under integration, or"), std::string::npos)
      << of_points;
}

// Without elastic modes all rungs are the same, so only the rate helps.
TEST(VerdictText, TheRemedyForABodyWithoutModesIsAHigherRate) {
  Scene scene;
  add_point(scene, 1.0, Eigen::Vector3d::Zero());
  scene.points[0].inertia = Eigen::Vector3d(1.0, 2.0, 2.5).asDiagonal();
  const std::string text = text_of(reduced_plan_of(scene), verdict_with(Cause::kAttitude));
  EXPECT_NE(text.find("; raise the rate"), std::string::npos) << text;
  EXPECT_EQ(text.find("fidelity"), std::string::npos) << text;
}

TEST(VerdictText, AStoppedShadowNamesWhy) {
  const Plan plan = truss_plan();
  for (const auto& [status, part] : {std::pair{StepStatus::kNotFinite, "it became infinite"},
                                     {StepStatus::kNoEquilibrium, "a joint found no equilibrium"},
                                     {StepStatus::kNoFrame, "bodies turned too far"},
                                     {StepStatus::kTurnedTooFar, "bodies turned too far"},
                                     {StepStatus::kOpenJoint, "a ball joint could not be closed"}}) {
    Verdict verdict = verdict_with(Cause::kLost);
    verdict.stopped = status;
    const std::string text = text_of(plan, verdict);
    EXPECT_NE(text.find(part), std::string::npos) << text;
    EXPECT_EQ(error_text(plan, verdict), "not known");
  }
}

TEST(VerdictText, ALoadWithoutANameIsCountedFromOne) {
  const std::string text = text_of(truss_plan(""), verdict_with(Cause::kFastLoad));
  EXPECT_EQ(text.find("load 1 changes"), 0U) << text;
}

TEST(VerdictText, TheErrorIsReportedAsAPercentageOfAStatedScale) {
  Plan plan = truss_plan();
  Verdict verdict;
  verdict.tick = 1;
  verdict.error.deformation = 1.2e-6, verdict.scale = 1e-3, verdict.displacement_now = 1e-4;
  EXPECT_EQ(error_text(plan, verdict), "0.12 % of 0.001 m (recent peak displacement)");
  verdict.displacement_now = 1e-3;
  EXPECT_EQ(error_text(plan, verdict), "0.12 % of 0.001 m (displacement)");
  plan.verdict.tolerance = 1e-3;
  EXPECT_EQ(error_text(plan, verdict), "0.12 % of 0.001 m (tolerance)");
  verdict.error.deformation = 2.53e-3;
  EXPECT_EQ(error_text(plan, verdict), "250 % of 0.001 m (tolerance)");
  verdict.error.deformation = 0.5;
  EXPECT_EQ(error_text(plan, verdict), "more than 10 times 0.001 m (tolerance)");
  verdict.tick = -1;
  EXPECT_EQ(error_text(plan, verdict), "not known");
  EXPECT_EQ(share_text(0.0, 0.0), "0 % of");
}

// The text must not report "watch: ... 2 %" if 2 % is the limit of "good".
TEST(VerdictText, AFigureAboveALimitIsNeverRoundedToTheLimit) {
  EXPECT_EQ(share_text(0.0203, 1.0), "2.03 % of");
  EXPECT_EQ(share_text(0.02003, 1.0), "2.003 % of");
  EXPECT_EQ(share_text(0.2012, 1.0), "20.1 % of");
  EXPECT_EQ(share_text(0.02, 1.0), "2 % of");
  EXPECT_EQ(share_text(0.0197, 1.0), "2 % of");
  EXPECT_EQ(share_text(0.0213, 1.0), "2.1 % of");
}

}  // namespace
}  // namespace freeflex::testing
