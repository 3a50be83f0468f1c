// The thread of the verdict gives the verdicts of a motion that is judged in step, a fixed number of ticks
// later.
#include "service/verdict_thread.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <deque>
#include <thread>
#include <vector>

#include "core/motion.hpp"
#include "tests/service/rig.hpp"
#include "tests/support/omissions.hpp"

namespace freeflex::testing {
namespace {

using service::JudgedTick;
using service::VerdictThread;

/// Returns the octahedron on the rung `separated`, which spins, with horizons of 0.1 s.
Scene spinning_octahedron() {
  Scene scene = octahedron();
  publish_everything(scene);
  scene.initial.angular_velocity = {0.3, 0.1, 0.2};
  scene.verdict.horizon = 0.1;
  return scene;
}

std::int64_t delay_of(const Plan& plan) { return plan.verdict.shadows.front().delay_ticks; }

void expect_same(const Verdict& found, const Verdict& wanted, std::int64_t tick) {
  EXPECT_EQ(found.tick, wanted.tick) << tick;
  EXPECT_EQ(found.level, wanted.level) << tick;
  EXPECT_EQ(found.cause, wanted.cause) << tick;
  EXPECT_EQ(found.error.position, wanted.error.position) << tick;
  EXPECT_EQ(found.error.attitude, wanted.error.attitude) << tick;
  EXPECT_EQ(found.error.deformation, wanted.error.deformation) << tick;
  EXPECT_EQ(found.own_error, wanted.own_error) << tick;
  EXPECT_EQ(found.displacement_now, wanted.displacement_now) << tick;
  EXPECT_EQ(found.scale, wanted.scale) << tick;
  EXPECT_EQ(found.stopped, wanted.stopped) << tick;
}

/// Feeds the thread from a motion that is judged in step, and has the verdicts that are due.
class Fed {
 public:
  explicit Fed(const Plan& plan) : motion(plan), thread(plan) {
    note();
    thread.take(motion);
  }
  ~Fed() { stop(); }
  Fed(const Fed&) = delete;
  Fed& operator=(const Fed&) = delete;

  void start() {
    runner_ = std::thread([this] { thread.run(); });
  }
  void stop() {
    thread.request_stop();
    if (runner_.joinable()) runner_.join();
  }
  /// Advances by one tick. If `waits`, waits for the verdict that is due, as a loop without a pace does.
  void advance(std::span<const ForceCommand> commands = {}, bool waits = true) {
    thread.command(motion.state().tick, commands);
    ASSERT_EQ(motion.advance(commands).status, StepStatus::kOk);
    note();
    if (waits) wait();
    thread.take(motion);
  }
  void reset() {
    motion.reset();
    waiting_.clear();
    due_ = {};
    note();
    thread.take(motion);
  }
  void wait() const {
    while (!thread.is_ready(motion.state().tick)) std::this_thread::yield();
  }
  void expect_due() {
    const std::int64_t tick = motion.state().tick, delay = delay_of(motion.plan());
    while (!waiting_.empty() && waiting_.front().now.tick + delay <= tick) {
      due_ = waiting_.front();
      waiting_.pop_front();
    }
    expect_same(thread.judged().now, due_.now, tick);
    expect_same(thread.judged().worst, due_.worst, tick);
  }

  Motion motion;
  VerdictThread thread;

 private:
  struct Judged {
    Verdict now, worst;
  };
  void note() {
    const std::int64_t newest = waiting_.empty() ? due_.now.tick : waiting_.back().now.tick;
    if (motion.verdict().tick > newest) waiting_.push_back({motion.verdict(), motion.worst()});
  }
  std::deque<Judged> waiting_;
  Judged due_;
  std::thread runner_;
};

TEST(VerdictThread, GivesTheVerdictsOfTheMotionInStepAFixedNumberOfTicksLater) {
  for (const Fidelity rung : {Fidelity::kRigid, Fidelity::kSeparated, Fidelity::kCoupled, Fidelity::kFull}) {
    Scene scene = spinning_octahedron();
    scene.fidelity = rung;
    const Plan plan = reduced_plan_of(scene);
    ASSERT_EQ(plan.verdict.shadows.size(), 1u);
    Fed fed(plan);
    fed.start();
    for (int tick = 0; tick < 450; ++tick) {
      std::vector<ForceCommand> commands;
      if (tick % 70 == 10) commands.push_back(make_push(tick, tick % 3, tick, tick % 2, 5.0));
      if (tick % 140 == 80) commands.push_back(make_push(1000 + tick, 1, tick, 2, -3.0));
      fed.advance(commands);
      fed.expect_due();
    }
    const PlanShadow& shadow = plan.verdict.shadows.front();
    EXPECT_GT(fed.thread.judged().now.tick,
              450 - delay_of(plan) - shadow.ticks - (shadow.every - 1) * shadow.horizon_ticks);
    EXPECT_GT(fed.thread.judged().now.error.attitude, 0.0) << "the errors are not all zero";
    EXPECT_EQ(fed.thread.num_late(), 0);
  }
}

TEST(VerdictThread, AResetBeginsAnEpochWithoutAVerdict) {
  const Plan plan = reduced_plan_of(spinning_octahedron());
  Fed fed(plan);
  fed.start();
  const ForceCommand push = make_push(1, 0, 0, 0, 5.0);
  for (int tick = 0; tick < 237; ++tick) fed.advance({&push, tick == 30 ? 1u : 0u});
  ASSERT_GE(fed.thread.judged().now.tick, 0);
  fed.reset();
  EXPECT_EQ(fed.thread.judged().tick, -1) << "verdicts of the last epoch do not count";
  for (int tick = 0; tick < 250; ++tick) {
    fed.advance();
    fed.expect_due();
    EXPECT_EQ(fed.thread.judged().tick < 0, tick + 1 < delay_of(plan)) << tick;
  }
  EXPECT_EQ(fed.thread.num_late(), 0);
}

// while a simulation holds, a sender may reset it many times at one tick
TEST(VerdictThread, ManyResetsAtOneTickLeaveTheVerdictsOfTheLast) {
  const Plan plan = reduced_plan_of(spinning_octahedron());
  Fed fed(plan);
  fed.start();
  for (int k = 0; k < 1000; ++k) {
    fed.reset();
    if (k % 10 == 9) std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  for (int tick = 0; fed.thread.has_fallen_behind() && tick < 10'000; ++tick) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    fed.reset();
  }
  ASSERT_FALSE(fed.thread.has_fallen_behind());
  for (int tick = 0; tick < 150; ++tick) {
    fed.advance();
    fed.expect_due();
  }
  EXPECT_GE(fed.thread.judged().tick, 1);
}

// of horizons that are not judged, the thread needs only the commands
TEST(VerdictThread, TakesMoreCommandsThanItsQueueHoldsInAHorizonThatIsNotJudged) {
  Scene scene = spinning_octahedron();
  scene.verdict.horizon = 1.0;
  scene.verdict.share = 1e-4;
  const Plan plan = reduced_plan_of(scene);
  ASSERT_GE(plan.verdict.shadows.front().every, 3);
  Fed fed(plan);
  fed.start();
  for (int tick = 0; tick < 3500; ++tick) {
    ForceCommand push = make_push(tick + 1, tick % 4, tick, tick % 3, 0.1);
    push.duration_ticks = 20;
    fed.advance({&push, 1});
    ASSERT_FALSE(fed.thread.has_fallen_behind()) << tick;
    fed.expect_due();
  }
}

TEST(VerdictThread, ResultsThatComeTooLateAreCountedAndSkipped) {
  const Plan plan = reduced_plan_of(spinning_octahedron());
  const PlanShadow& shadow = plan.verdict.shadows.front();
  Fed fed(plan);
  // the thread starts when the first results are overdue by 10 steps of the shadow
  const std::int64_t num_ticks = shadow.delay_ticks + 10 * shadow.ticks;
  for (std::int64_t tick = 0; tick < num_ticks; ++tick) fed.advance({}, false);
  ASSERT_FALSE(fed.thread.has_fallen_behind());
  EXPECT_EQ(fed.thread.judged().tick, -1);
  fed.start();
  fed.wait();
  fed.advance();
  // those for the ticks 0 to 10 steps, of which the last is due at num_ticks
  const std::int64_t wanted = 1 + (num_ticks - shadow.delay_ticks) / shadow.ticks;
  EXPECT_EQ(fed.thread.num_late(), wanted);
  for (int tick = 0; tick < 200; ++tick) fed.advance();
  fed.expect_due();
  EXPECT_EQ(fed.thread.num_late(), wanted);
}

TEST(VerdictThread, AThreadThatFallsFarBehindJudgesAgainAfterAReset) {
  const Plan plan = reduced_plan_of(spinning_octahedron());
  Fed fed(plan);
  for (int tick = 0; tick < 2000 && !fed.thread.has_fallen_behind(); ++tick) fed.advance({}, false);
  ASSERT_TRUE(fed.thread.has_fallen_behind()) << "the queue of states has an end";
  EXPECT_TRUE(fed.thread.is_ready(fed.motion.state().tick)) << "a loop without a pace does not wait";
  fed.start();
  for (int tick = 0; tick < 300; ++tick) fed.advance();
  EXPECT_TRUE(fed.thread.has_fallen_behind());
  EXPECT_EQ(fed.thread.judged().tick, -1) << "what is judged late is skipped";
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // the thread makes room
  fed.reset();
  EXPECT_FALSE(fed.thread.has_fallen_behind());
  for (int tick = 0; tick < 300; ++tick) {
    fed.advance();
    fed.expect_due();
  }
}

// a shadow that starts within an epoch would start from the initial state of the scene
TEST(VerdictThread, AResetWhileTheQueueIsFullDoesNotStartAShadowWithinTheEpoch) {
  const Plan plan = reduced_plan_of(spinning_octahedron());
  Fed fed(plan);
  for (int tick = 0; tick < 2000 && !fed.thread.has_fallen_behind(); ++tick) fed.advance({}, false);
  ASSERT_TRUE(fed.thread.has_fallen_behind());
  fed.reset();
  EXPECT_TRUE(fed.thread.has_fallen_behind()) << "there is no room for the state at the start of the epoch";
  fed.start();
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  for (int tick = 0; tick < 300; ++tick) fed.advance();
  EXPECT_TRUE(fed.thread.has_fallen_behind());
  EXPECT_EQ(fed.thread.judged().tick, -1);
  fed.reset();
  EXPECT_FALSE(fed.thread.has_fallen_behind());
}

TEST(VerdictThread, MoreCommandsAtOneTickThanTheQueueHoldsEndTheVerdictOfTheEpoch) {
  const Plan plan = reduced_plan_of(spinning_octahedron());
  Fed fed(plan);
  std::vector<ForceCommand> commands;
  for (int k = 0; k < 1025; ++k) commands.push_back(make_push(k + 1, 0, 0));
  fed.thread.command(0, std::span(commands).first(1024));
  EXPECT_FALSE(fed.thread.has_fallen_behind());
  fed.thread.command(0, std::span(commands).last(1));
  EXPECT_TRUE(fed.thread.has_fallen_behind());
}

// a command that makes the step fail never acts, so the shadow of the next epoch must not have it either
TEST(VerdictThread, CommandsOfAFailedStepAreNotPassed) {
  const Plan plan = reduced_plan_of(spinning_octahedron());
  VerdictThread verdicts(plan);
  FakeClock clock;
  Rig rig(plan, {.timing = kAsap, .until_tick = 400}, clock, service::Output::kMostWaiting, &verdicts);
  ForceCommand huge = make_push(1, 0, 100, 0, 5e307);
  for (int point = 1; point < 6; ++point) add_force(huge, point, Eigen::Vector3d(1e308, 1e308, 1e308));
  rig.push(huge);
  bool has_reset = false;
  clock.on_sleep = [&] {
    std::this_thread::sleep_for(std::chrono::microseconds(20));
    if (rig.tick() == 100 && !has_reset) has_reset = rig.control(freeflex_msgs::control_t::RESET);
  };
  std::thread thread([&] { verdicts.run(); });
  rig.run();
  verdicts.request_stop();
  thread.join();
  ASSERT_TRUE(has_reset) << "the step at tick 100 fails";
  ASSERT_EQ(rig.simulation.state().epoch, 1);
  Motion motion(plan);
  while (motion.state().tick < 300 - delay_of(plan)) motion.advance();
  Verdict wanted = motion.verdict();
  wanted.tick += 100;
  expect_same(verdicts.judged().now, wanted, 400);
}

// the loop passes commands and states of all kinds, and waits for the thread if it has no pace
TEST(VerdictThread, ALoopWithoutAPacePublishesTheVerdictsOfTheMotionInStep) {
  const Plan plan = reduced_plan_of(spinning_octahedron());
  VerdictThread verdicts(plan);
  FakeClock clock;
  clock.on_sleep = [] { std::this_thread::sleep_for(std::chrono::microseconds(20)); };
  Rig rig(plan, {.timing = kAsap, .until_tick = 400}, clock, service::Output::kMostWaiting, &verdicts);
  rig.push(make_push(1, 0, 100, 0, 5.0));
  std::thread thread([&] { verdicts.run(); });
  rig.run();
  verdicts.request_stop();
  thread.join();

  Motion motion(plan);
  const ForceCommand push = make_push(1, 0, 100, 0, 5.0);
  while (motion.state().tick < 400 - delay_of(plan))
    motion.advance({&push, motion.state().tick == 100 ? 1u : 0u});
  EXPECT_EQ(verdicts.num_late(), 0);
  expect_same(verdicts.judged().now, motion.verdict(), 400);
  expect_same(verdicts.judged().worst, motion.worst(), 400);
  ASSERT_EQ(rig.output->num_accepted.load(), 1);
}

}  // namespace
}  // namespace freeflex::testing
