// Command slots: how commands add up, replace each other, expire and are cleared. A failed step does not
// change them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <random>

#include "tests/step/hand_plan.hpp"

namespace freeflex::testing {
namespace {

const std::vector<Mode> kFiveModes(5, Mode{100.0, 1.0, 1e-3, 0.0});

ForceCommand push(const char* sender, int slot, const Vec3& force, std::int64_t duration = 1000000) {
  ForceCommand command = hand_command(sender, slot);
  command.duration_ticks = duration;
  add_force(command, 0, force);
  return command;
}

/// Returns whether two states are equal in everything on which later steps depend.
bool is_same(const State& a, const State& b) {
  const MotionState &motion = a, &other = b;
  bool is_same = motion == other && a.num_slots == b.num_slots && a.slots_changed == b.slots_changed;
  for (std::size_t i = 0; i < static_cast<std::size_t>(std::min(a.num_slots, b.num_slots)); ++i)
    is_same &= a.slots[i].end_tick == b.slots[i].end_tick &&
               std::memcmp(&a.slots[i].command, &b.slots[i].command, sizeof(ForceCommand)) == 0;
  return is_same;
}

TEST(Slots, ForcesOfSlotsAddUpToTheSameBitsInAnyOrderOfArrival) {
  const StepPlan plan = hand_plan(1e-3, kFiveModes, 3);
  std::vector<ForceCommand> commands;
  for (int k = 0; k < 9; ++k)
    commands.push_back(
        push(k % 3 == 0 ? "alpha" : (k % 3 == 1 ? "beta" : "alph"), k, {1.0 / (k + 3), 0.1 * k, -1.0 / 7}));
  HandRun first(plan);
  first.run(20, commands);
  std::mt19937_64 engine(5);
  for (int k = 0; k < 5; ++k) {
    std::shuffle(commands.begin(), commands.end(), engine);
    HandRun other(plan);
    other.run(20, commands);
    EXPECT_TRUE(is_same(first.state, other.state));
  }
}

TEST(Slots, ACommandReplacesOnlyItsOwnSlot) {
  const StepPlan plan = hand_plan(1e-3, kFiveModes, 1);
  HandRun run(plan);
  const std::vector<ForceCommand> first = {push("a", 0, {1, 0, 0}), push("a", 1, {0, 2, 0}),
                                           push("b", 0, {0, 0, 4})};
  run.run(1, first);
  EXPECT_EQ(run.state.force_W, (Vec3{1, 2, 4}));
  const ForceCommand again = push("a", 1, {0, 16, 0});
  run.run(1, std::span(&again, 1));
  EXPECT_EQ(run.state.num_slots, 3);
  EXPECT_EQ(run.state.force_W, (Vec3{1, 16, 4}));
  const ForceCommand empty = hand_command("a", 0);
  run.run(1, std::span(&empty, 1));
  EXPECT_EQ(run.state.num_slots, 2);
  EXPECT_EQ(run.state.force_W, (Vec3{0, 16, 4}));
}

TEST(Slots, ACommandWithADurationEndsAfterItsDurationAndTheEndIsReported) {
  const StepPlan plan = hand_plan(1e-3, kFiveModes, 1);
  HandRun run(plan);
  ForceCommand command = push("a", 7, {1, 0, 0}, 3);
  command.sequence = 42;
  run.run(3, std::span(&command, 1));
  EXPECT_EQ(run.report.num_expiries, 0);
  EXPECT_EQ(run.state.force_W[0], 1.0);
  EXPECT_DOUBLE_EQ(run.state.v_WB[0] * plan.mass, 3e-3);
  run.run(1);
  ASSERT_EQ(run.report.num_expiries, 1);
  EXPECT_STREQ(run.report.expiries[0].sender.data(), "a");
  EXPECT_EQ(run.report.expiries[0].slot, 7);
  EXPECT_EQ(run.report.expiries[0].sequence, 42);
  EXPECT_FALSE(run.report.expiries[0].was_lease);
  EXPECT_EQ(run.state.force_W[0], 0.0);
  EXPECT_DOUBLE_EQ(run.state.v_WB[0] * plan.mass, 3e-3);
}

TEST(Slots, ALeaseLastsWhileItIsRenewedAndThenExpires) {
  const StepPlan plan = hand_plan(1e-3, kFiveModes, 1);
  HandRun run(plan);
  ForceCommand command = push("a", 0, {1, 0, 0}, 0);
  command.lease_ticks = 5;
  for (int k = 0; k < 10; ++k) {
    run.run(4, std::span(&command, 1));
    EXPECT_EQ(run.state.num_slots, 1);
  }
  run.run(1);
  EXPECT_EQ(run.state.num_slots, 1);
  run.run(1);
  ASSERT_EQ(run.report.num_expiries, 1);
  EXPECT_TRUE(run.report.expiries[0].was_lease);
  EXPECT_EQ(run.state.num_slots, 0);
}

TEST(Slots, AnExpiredCommandEndsBeforeItsSlotIsTakenAgain) {
  const StepPlan plan = hand_plan(1e-3, kFiveModes, 1);
  HandRun run(plan);
  const ForceCommand first = push("a", 0, {1, 0, 0}, 2), second = push("a", 0, {3, 0, 0});
  run.run(2, std::span(&first, 1));
  run.run(1, std::span(&second, 1));
  EXPECT_EQ(run.report.num_expiries, 1);
  EXPECT_EQ(run.state.force_W[0], 3.0);
}

TEST(Slots, ACommandBeyondSixtyFourActiveSlotsIsIgnored) {
  const StepPlan plan = hand_plan(1e-3, kFiveModes, 1);
  HandRun run(plan);
  std::vector<ForceCommand> commands;
  for (int k = 0; k < kMaxSlots; ++k) commands.push_back(push("a", k, {1, 0, 0}));
  run.run(1, commands);
  EXPECT_EQ(run.state.num_slots, kMaxSlots);
  const ForceCommand replaced = push("a", 3, {1, 0, 0}), empty = hand_command("z", 0),
                     more = push("b", 0, {1, 0, 0});
  EXPECT_TRUE(has_slot_for(run.state, replaced));
  EXPECT_TRUE(has_slot_for(run.state, empty));
  EXPECT_FALSE(has_slot_for(run.state, more));
  run.run(1, std::span(&more, 1));
  EXPECT_EQ(run.state.num_slots, kMaxSlots);
  EXPECT_EQ(run.state.force_W[0], static_cast<double>(kMaxSlots));
}

TEST(Slots, AResetClearsTheSlotsAndRestoresTheInitialState) {
  StepPlan plan = hand_plan(1e-3, kFiveModes, 1);
  plan.initial.w_B = {0.1, 0.2, 0.3};
  HandRun run(plan);
  const ForceCommand command = push("a", 0, {1, 0, 0});
  run.run(50, std::span(&command, 1));
  reset_state(plan, run.state);
  State fresh = make_state(plan);
  fresh.tick = fresh.epoch_start_tick = 50;
  fresh.epoch = 1;
  EXPECT_TRUE(is_same(run.state, fresh));
  HandRun other(plan);
  run.run(50);
  other.run(50);
  EXPECT_EQ(run.state.q, other.state.q);
  EXPECT_EQ(run.state.q_WB, other.state.q_WB);
}

TEST(NotFinite, AFailedStepDoesNotChangeTheState) {
  StepPlan plan = hand_plan(1e-3, kFiveModes, 2);
  plan.initial.w_B = {0.1, 0.2, 0.3};
  HandRun run(plan);
  const std::vector<ForceCommand> start = {push("a", 0, {1, 0, 0}, 10), push("b", 0, {1, 0, 0})};
  run.run(10, start);
  const State before = run.state;
  const double huge = std::numeric_limits<double>::max();
  for (const std::int32_t axes : {0, 1}) {
    ForceCommand bad = push("c", 0, {huge, huge, -huge});
    bad.axes = axes;
    add_force(bad, 1, {huge, huge, huge});
    EXPECT_EQ(run.step_once(std::span(&bad, 1)), StepStatus::kNotFinite);
    EXPECT_EQ(run.report.num_expiries, 0);
    EXPECT_TRUE(is_same(run.state, before));
  }
  // the later motion is the same as if the commands of the failed steps had never been sent
  HandRun other(plan);
  other.run(10, start);
  run.run(30);
  other.run(30);
  EXPECT_TRUE(is_same(run.state, other.state));
}

}  // namespace
}  // namespace freeflex::testing
