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
  for (const auto& [of_a, of_b] :
       {std::pair(a.verdict().error, b.verdict().error), std::pair(a.worst().error, b.worst().error)}) {
    EXPECT_EQ(of_a.position, of_b.position);
    EXPECT_EQ(of_a.attitude, of_b.attitude);
    EXPECT_EQ(of_a.deformation, of_b.deformation);
  }
  EXPECT_EQ(a.verdict().scale, b.verdict().scale);
  EXPECT_EQ(a.verdict().own_error, b.verdict().own_error);
}

TEST(Motion, GivesTheBitsAndTheVerdictOfTheStepAndTheJudgementByHand) {
  const Plan plan = truss_plan();
  Motion motion(plan);
  State state = make_state(plan);
  Workspace workspace = make_workspace(plan);
  Judgement judgement(plan);
  StepReport report;
  judgement.take(state);
  const ForceCommand command = push();
  for (int tick = 0; tick < 120; ++tick) {
    const std::span<const ForceCommand> commands(&command, tick == 7 ? 1U : 0U);
    const std::int64_t now = state.tick;
    step(plan, state, {commands}, workspace, report);
    judgement.command(now, commands);
    judgement.take(state);
    EXPECT_EQ(motion.advance(commands).status, StepStatus::kOk);
  }
  EXPECT_EQ(static_cast<const MotionState&>(motion.state()), static_cast<const MotionState&>(state));
  EXPECT_EQ(motion.verdict().error.deformation, judgement.now().error.deformation);
  EXPECT_EQ(motion.verdict().error.position, judgement.now().error.position);
  EXPECT_EQ(motion.verdict().tick, judgement.now().tick);
  EXPECT_GT(motion.verdict().error.deformation, 0.0);
  EXPECT_NEAR(motion.time(), 120 * plan.period, 1e-15);
}

TEST(Motion, AfterAResetTheVerdictIsThatOfANewMotion) {
  const Plan plan = truss_plan();
  Motion motion(plan);
  const Motion fresh(plan);
  const ForceCommand command = push();
  motion.advance({&command, 1});
  for (int tick = 1; tick < 120; ++tick) motion.advance();
  ASSERT_GT(motion.verdict().error.deformation, 0.0);
  motion.reset();
  EXPECT_EQ(motion.verdict().error.deformation, fresh.verdict().error.deformation);
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
  EXPECT_EQ(alone.verdict().tick, -1);
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
