// A Motion steps, judges, resets and copies as one.
#include "core/motion.hpp"

#include <gtest/gtest.h>

#include "tests/motion/watched.hpp"
#include "tests/support/simulation.hpp"

namespace freeflex::testing {
namespace {

Plan truss_plan() { return reduced_plan_of(watched_truss(Fidelity::kSeparated, 0.05)); }

ForceCommand push() {
  ForceCommand command = make_command(0, 1, Axes::kBody, 30);
  add_force(command, 1, {40.0, -30.0, 20.0});
  return command;
}

void expect_same(const Motion& a, const Motion& b) {
  EXPECT_EQ(static_cast<const MotionState&>(a.state()), static_cast<const MotionState&>(b.state()));
  EXPECT_EQ(a.verdict().tick, b.verdict().tick);
  EXPECT_EQ(a.verdict().level, b.verdict().level);
  EXPECT_EQ(a.verdict().error, b.verdict().error);
  EXPECT_EQ(a.worst().error, b.worst().error);
}

TEST(Motion, GivesTheBitsAndTheVerdictOfTheStepAndTheJudgementByHand) {
  const Plan plan = truss_plan();
  Motion motion(plan);
  State state = make_state(plan);
  Workspace workspace = make_workspace(plan);
  Budget budget = make_budget(plan);
  Judgement judgement(plan);
  StepReport report;
  judgement.take(state, budget);
  const ForceCommand command = push();
  for (int tick = 0; tick < 120; ++tick) {
    const std::span<const ForceCommand> commands(&command, tick == 7 ? 1U : 0U);
    step(plan, state, {commands}, workspace, budget, report);
    judgement.take(state, budget);
    EXPECT_EQ(motion.advance(commands).status, StepStatus::kOk);
  }
  EXPECT_EQ(static_cast<const MotionState&>(motion.state()), static_cast<const MotionState&>(state));
  EXPECT_EQ(motion.verdict().error, judgement.now().error);
  EXPECT_GT(motion.verdict().error, 0.0);
  EXPECT_EQ(motion.read_budget().total.elastic, read_budget(plan, state, budget).total.elastic);
  EXPECT_NEAR(motion.time(), 120 * plan.period, 1e-15);
}

TEST(Motion, AfterAResetTheVerdictIsThatOfANewMotion) {
  const Plan plan = truss_plan();
  Motion motion(plan);
  const Motion fresh(plan);
  const ForceCommand command = push();
  motion.advance({&command, 1});
  for (int tick = 1; tick < 120; ++tick) motion.advance();
  ASSERT_GT(motion.verdict().error, 0.0);
  motion.reset();
  EXPECT_EQ(motion.verdict().error, fresh.verdict().error);
  EXPECT_EQ(motion.verdict().level, fresh.verdict().level);
  EXPECT_EQ(motion.worst().tick, fresh.worst().tick);
}

TEST(Motion, ACopyContinuesWithTheSameBitsAndLeavesTheOriginalAlone) {
  const Plan plan = truss_plan();
  Motion motion(plan), whole(plan);
  const ForceCommand command = push();
  motion.advance({&command, 1});
  whole.advance({&command, 1});
  for (int tick = 1; tick < 60; ++tick) motion.advance(), whole.advance();
  Motion copy(motion);
  const State before = motion.state();
  for (int tick = 60; tick < 130; ++tick) copy.advance(), whole.advance();
  EXPECT_EQ(static_cast<const MotionState&>(motion.state()), static_cast<const MotionState&>(before));
  expect_same(copy, whole);
  EXPECT_EQ(copy.read_budget().total.elastic, whole.read_budget().total.elastic);
  for (int tick = 60; tick < 130; ++tick) motion.advance();
  expect_same(motion, whole);
}

TEST(Motion, AMotionThatIsNotWatchedHasTheSameBits) {
  const Plan plan = truss_plan();
  Motion watched(plan), alone(plan, kMotionAlone);
  const ForceCommand command = push();
  for (int tick = 0; tick < 100; ++tick) {
    const std::span<const ForceCommand> commands(&command, tick == 3 ? 1U : 0U);
    watched.advance(commands), alone.advance(commands);
  }
  EXPECT_EQ(static_cast<const MotionState&>(watched.state()), static_cast<const MotionState&>(alone.state()));
  EXPECT_FALSE(alone.has_verdict());
  EXPECT_EQ(alone.read_budget().age, 0.0);
}

TEST(Motion, ATickThatFailsChangesNothingAndAResetBeginsANewEpoch) {
  const Plan plan = truss_plan();
  Motion motion(plan);
  for (int tick = 0; tick < 20; ++tick) motion.advance();
  const Motion before(motion);
  ForceCommand huge = push();
  huge.points[0].force = {1e308, 1e308, 1e308};
  EXPECT_EQ(motion.advance({&huge, 1}).status, StepStatus::kNotFinite);
  expect_same(motion, before);
  motion.reset();
  EXPECT_EQ(motion.state().tick, 20);
  EXPECT_EQ(motion.state().epoch, 1);
  EXPECT_EQ(motion.time(), 0.0);
  EXPECT_EQ(motion.worst().tick, -1);
  EXPECT_EQ(static_cast<const Frame&>(motion.state()), static_cast<const Frame&>(make_state(plan)));
}

}  // namespace
}  // namespace freeflex::testing
