// These tests compare verdicts with the true error on a random motion of each family of structures, on four
// rungs. `verdict_kinds_long_test` has more of them.
#include "tests/motion/verdict_kinds.hpp"

#include "core/plan/explain.hpp"

namespace freeflex::testing {
namespace {

class VerdictOnKinds : public ::testing::TestWithParam<Family> {};

TEST_P(VerdictOnKinds, IsCorrectForARandomMotion) { judge_family(GetParam(), 1, 1); }

INSTANTIATE_TEST_SUITE_P(All, VerdictOnKinds, ::testing::ValuesIn(all_families()),
                         [](const auto& instance) { return std::string(instance.param.name); });

/// Judges a motion whose estimates were wrong once, and returns the number of errors that can be compared.
int judge_again(const char* family, unsigned seed) {
  const KindCounts counts = judge_family(
      *std::ranges::find(all_families(), std::string(family), [](const Family& each) { return each.name; }),
      seed, 1);
  EXPECT_EQ(counts.close, counts.comparable);
  return counts.comparable;
}
// The points of rigid links move on arcs in the truth, and on tangents in a state below corotational.
TEST(EstimatesOnKinds, SeesTheArcsOfRigidLinks) { EXPECT_GE(judge_again("RigidLinks", 10), 3); }
// Ticks of 66 Hz do not resolve the modes of 684 and 938 rad/s.
TEST(EstimatesOnKinds, ResolvesFastModesThatTheTicksDoNot) { EXPECT_GE(judge_again("RigidLinks", 33), 1); }
// Pulses begin and end between ticks.
TEST(EstimatesOnKinds, SeesHowThePulsesOfAPlateMoveToTicks) { EXPECT_GE(judge_again("Plates", 4), 4); }

TEST(EstimatesOnKinds, AnExplanationContainsTheArcsOfRigidLinks) {
  const RandomMotion random(*std::ranges::find(all_families(), std::string("RigidLinks"),
                                               [](const Family& each) { return each.name; }),
                            10);
  Scene scene = random.specimen().scene;
  scene.fidelity = Fidelity::kCoupled;
  Faults faults;
  const auto structure = build_structure(scene, faults);
  const auto plan = make_plan(scene, *structure, faults);
  ASSERT_TRUE(plan);
  Motion motion(*plan);
  for (std::int64_t k = 0; k < random.ticks(); ++k) ASSERT_EQ(motion.advance().status, StepStatus::kOk);
  const auto effects = explain_motion(scene, *structure, *plan, random.end());
  ASSERT_TRUE(effects && !effects->empty());
  // the distance at the end is 0.263 of the scale with the arcs, and 0.163 without them
  EXPECT_GT(effects->front().most.deformation, 0.9 * motion.verdict().error.deformation);
}

}  // namespace
}  // namespace freeflex::testing
