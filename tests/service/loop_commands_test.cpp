// These tests check which commands the simulation loop takes (how many in a tick, from which senders, up to
// what age), and that it drops invalid entries.
#include <gtest/gtest.h>

#include <map>
#include <memory>

#include "service/loop.hpp"
#include "tests/service/rig.hpp"

namespace freeflex::testing {
namespace {

using freeflex_msgs::applied_t;
using freeflex_msgs::control_t;
using io::Reason;
using service::LoopSettings;
using service::Timing;

TEST(Loop, TakesABoundedNumberOfCommandsPerTickAndAnswersAllOfThem) {
  const Plan plan = octahedron_plan();
  Rig rig(plan, {.timing = kAsap, .until_tick = 20});
  for (int i = 0; i < 200; ++i) ASSERT_TRUE(rig.push(make_push(i + 1, i % 16)));
  rig.run();
  ASSERT_EQ(rig.acks.size(), 200u);
  ASSERT_EQ(rig.applied.size(), 200u);
  for (int i = 0; i < 200; ++i) {
    const auto at = static_cast<std::size_t>(i);
    EXPECT_EQ(rig.acks[at].sequence, i + 1);
    EXPECT_EQ(rig.acks[at].tick, i / service::Simulation::kMaxDrained);
    EXPECT_EQ(rig.applied[at].tick, rig.acks[at].tick);
    EXPECT_EQ(rig.applied[at].command.sequence, i + 1);
  }
}

TEST(Loop, LeavesCommandsInTheRingWhileThereIsNoRoomForTheirAnswers) {
  const Plan plan = octahedron_plan();
  Rig rig(plan, {.timing = kAsap, .until_tick = 2000});
  std::int64_t sequence = 1;
  std::int64_t num_pushed = 0;
  rig.clock.on_sleep = [&] {
    for (service::AppliedEntry entry; rig.output->applied.try_pop(entry);) rig.applied.push_back(entry);
    for (int i = 0; i < 100; ++i) num_pushed += rig.push(make_push(sequence++, 0)) ? 1 : 0;
    rig.take_motion();
  };
  rig.run();  // acknowledgements are not read before the end of the run
  ASSERT_GT(num_pushed, service::Output::kNumAcks);
  ASSERT_LE(rig.acks.size(), static_cast<std::size_t>(service::Output::kNumAcks));
  for (std::size_t i = 1; i < rig.acks.size(); ++i) ASSERT_GT(rig.acks[i].sequence, rig.acks[i - 1].sequence);
  std::size_t num_forces = 0;
  for (const auto& entry : rig.applied) num_forces += entry.kind == applied_t::FORCE ? 1 : 0;
  EXPECT_EQ(num_forces, rig.acks.size()) << "every command that was taken is answered";
}

TEST(Loop, ObeysTheOperatorDespiteManyCommandsFromTheBus) {
  const Plan plan = octahedron_plan();
  Rig rig(plan, {.timing = kAsap, .until_tick = 2000});
  const auto entry = std::make_unique<service::InboundEntry>();
  const auto operate = [&](std::int64_t sequence, std::int32_t command) {
    entry->received_ns = rig.clock.boot_ns();
    entry->kind = service::InboundKind::kControl;
    entry->control = {{'l', 'o', 'c', 'a', 'l', '.', 'o'}, sequence, command, 0};
    return rig.output->operator_commands.try_push(*entry);
  };
  // nobody reads answers to the bus, so after some ticks the loop takes no more commands from the bus
  std::int64_t sequence = 1;
  bool has_reset = false;
  bool has_stopped = false;
  rig.clock.on_sleep = [&] {
    for (service::AppliedEntry applied; rig.output->applied.try_pop(applied);) {
    }
    for (int i = 0; i < 100; ++i) rig.push(make_push(sequence++, 0));
    rig.take_motion();
    if (rig.tick() >= 1000 && !has_reset) has_reset = operate(1, control_t::RESET);
    if (rig.tick() >= 1500 && !has_stopped) has_stopped = operate(2, control_t::STOP);
  };
  rig.run();
  EXPECT_LT(rig.tick(), 1600);
  EXPECT_EQ(rig.simulation.state().epoch, 1);
  service::AckEntry answer;
  for (const std::int64_t expected : {1, 2}) {
    ASSERT_TRUE(rig.output->operator_acks.try_pop(answer));
    EXPECT_EQ(answer.sequence, expected);
    EXPECT_EQ(answer.reason, Reason::kAccepted);
  }
  for (const auto& ack : rig.acks)
    ASSERT_EQ(ack.sender[0], 't') << "answers to the operator are not sent to the bus";
}

TEST(Loop, AClearFromTheBusIsObeyedOnlyIfKeysAreChecked) {
  const Plan plan = octahedron_plan();
  for (const bool may_bus_clear : {false, true}) {
    Rig rig(plan, {.timing = kAsap, .until_tick = 200, .may_bus_clear = may_bus_clear});
    rig.push(make_push(1, 0));
    rig.push(make_push(2, 1, 150));
    bool has_sent = false;
    rig.clock.on_sleep = [&] {
      rig.take_motion();
      if (has_sent || rig.tick() < 50) return;
      has_sent = true;
      rig.control(control_t::CLEAR, 0, "test");
    };
    rig.run();
    ASSERT_EQ(rig.acks.size(), may_bus_clear ? 4u : 3u);
    if (!may_bus_clear) {
      EXPECT_EQ(rig.acks.back().reason, Reason::kNotGranted);
      continue;
    }
    EXPECT_EQ(rig.acks[2].reason, Reason::kCleared) << "the waiting command is answered a second time";
    EXPECT_EQ(rig.acks[2].sequence, 2);
    EXPECT_EQ(rig.acks[3].reason, Reason::kAccepted);
    ASSERT_EQ(rig.applied.size(), 2u);
    EXPECT_EQ(rig.applied[1].kind, applied_t::CLEARED);
    EXPECT_EQ(rig.applied[1].tick, rig.acks[3].tick);
    EXPECT_EQ(rig.applied[1].expiry.sequence, 1);
    EXPECT_EQ(rig.simulation.state().num_slots, 0);
  }
}

TEST(Loop, IgnoresCommandsFromTheBusUnderANameOfTheOperator) {
  const Plan plan = octahedron_plan();
  Rig rig(plan, {.timing = kAsap, .until_tick = 5});
  ForceCommand forged = make_push(1);
  forged.sender = {'l', 'o', 'c', 'a', 'l', '.', 'x'};
  rig.push(forged);
  rig.push(make_push(2));
  rig.run();
  ASSERT_EQ(rig.acks.size(), 1u);
  EXPECT_EQ(rig.acks[0].sequence, 2);
  service::AckEntry answer;
  EXPECT_FALSE(rig.output->operator_acks.try_pop(answer));
}

TEST(Loop, DropsEveryInvalidEntryOfTheRing) {
  const Plan plan = octahedron_plan();
  Rig rig(plan, {.timing = kAsap, .until_tick = 10});
  ForceCommand bad = make_push(1);
  bad.num_points = 1'000'000;
  rig.push(bad);
  bad = make_push(2);
  bad.points[0].point = 77;
  rig.push(bad);
  bad = make_push(3);
  bad.sender.fill('x');
  rig.push(bad);
  bad = make_push(4);
  bad.slot = -3;
  rig.push(bad);
  rig.control(control_t::STEP, -1);
  rig.control(77);
  service::InboundEntry unknown{};
  unknown.kind = static_cast<service::InboundKind>(99);
  rig.inbound->try_push(unknown);
  rig.push(make_push(5));
  rig.run();
  ASSERT_EQ(rig.acks.size(), 1u);
  EXPECT_EQ(rig.acks[0].sequence, 5);
}

TEST(Loop, EveryModeRefusesCommandsThatWaitedTooLong) {
  const Plan plan = octahedron_plan();
  for (LoopSettings settings :
       {LoopSettings{.timing = kRealtime, .until_tick = 10}, LoopSettings{.timing = kAsap, .until_tick = 10},
        LoopSettings{.timing = kLockstep, .until_tick = 10},
        LoopSettings{.timing = kRealtime, .starts_holding = true, .until_tick = 10}}) {
    settings.limits.max_age = 0.5;
    Rig rig(plan, settings);
    constexpr std::int64_t kMilli = 1'000'000;
    rig.push(make_push(1));
    rig.control(control_t::RESET);
    rig.clock.suspend(20 * kMilli);  // at the end two commands are 520 ms old, and two 500 ms
    rig.push(make_push(2));
    rig.control(control_t::SHAPES, 1);
    rig.clock.suspend(500 * kMilli);
    const bool is_holding = settings.starts_holding || settings.timing.kind == Timing::Kind::kLockstep;
    rig.clock.on_sleep = [&] {
      if (rig.next_sequence == 1'000'002) rig.control(control_t::STEP, 10);
      rig.take_motion();
    };
    if (!is_holding) rig.clock.on_sleep = [&] { rig.take_motion(); };
    rig.run();
    std::map<std::int64_t, service::AckEntry> answers;
    for (const auto& ack : rig.acks) answers[ack.sequence] = ack;
    EXPECT_EQ(answers.at(1).reason, Reason::kTooOld);
    EXPECT_GE(answers.at(1).found, 520) << "[ms]";
    EXPECT_EQ(answers.at(1'000'000).reason, Reason::kTooOld) << "controls are refused too";
    EXPECT_EQ(rig.simulation.state().epoch, 0);
  }
}

TEST(Loop, AcceptsCommandsUpToTheAgeLimitAndCorrectsImpossibleReceptionTimes) {
  const Plan plan = octahedron_plan();
  Rig rig(plan, {.timing = kAsap, .until_tick = 2});
  rig.push(make_push(1));
  rig.clock.suspend(1'000'000'000);  // exactly the default max_age, in nanoseconds
  auto entry = std::make_unique<service::InboundEntry>();
  entry->kind = service::InboundKind::kForce;
  for (const std::int64_t received_ns : {INT64_MIN, std::int64_t{-1}, INT64_MAX}) {
    entry->force = make_push(static_cast<std::int64_t>(rig.next_sequence++));
    entry->received_ns = received_ns;
    rig.inbound->try_push(*entry);
  }
  rig.run();
  ASSERT_EQ(rig.acks.size(), 4u);
  for (const auto& ack : rig.acks) EXPECT_EQ(ack.reason, Reason::kAccepted) << ack.sequence;
}

}  // namespace
}  // namespace freeflex::testing
