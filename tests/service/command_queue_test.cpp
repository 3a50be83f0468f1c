// These tests check the decisions of the command queue that depend on the tick.
#include "service/command_queue.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <string>

#include "tests/service/rig.hpp"

namespace freeflex::testing {
namespace {

using io::Reason;
using service::CommandQueue;

constexpr int kPlenty = 100'000;  // free entries in the ring of APPLIED

TEST(CommandQueue, SchedulesACommandWithoutAStartTickForTheNextTick) {
  CommandQueue queue;
  const auto decision = queue.submit(make_push(1), 5, 41, kPlenty);
  EXPECT_EQ(decision.reason, Reason::kAccepted);
  EXPECT_EQ(decision.tick, 41);
  const auto due = queue.take_due(41);
  ASSERT_EQ(due.size(), 1u);
  EXPECT_EQ(due[0].sequence, 1);
  ASSERT_EQ(queue.due_received_ns().size(), 1u);
  EXPECT_EQ(queue.due_received_ns()[0], 5);
}

TEST(CommandQueue, RejectsALateStartUnlessTheCommandAllowsIt) {
  CommandQueue queue;
  EXPECT_EQ(queue.submit(make_push(1, 0, 40), 5, 41, kPlenty).reason, Reason::kLate);
  EXPECT_EQ(queue.submit(make_push(2, 0, 41), 5, 41, kPlenty).reason, Reason::kAccepted);
  ForceCommand late = make_push(3, 0, 40);
  late.late_policy = 1;
  const auto decision = queue.submit(late, 5, 41, kPlenty);
  EXPECT_EQ(decision.reason, Reason::kAccepted);
  EXPECT_EQ(decision.tick, 41);
}

TEST(CommandQueue, RejectsAStartTooFarAhead) {
  CommandQueue queue;
  EXPECT_EQ(queue.submit(make_push(1, 0, 41 + io::kMaxAheadTicks), 5, 41, kPlenty).reason, Reason::kAccepted);
  EXPECT_EQ(queue.submit(make_push(2, 0, 42 + io::kMaxAheadTicks), 5, 41, kPlenty).reason,
            Reason::kTooFarAhead);
  EXPECT_EQ(queue.submit(make_push(3, 0, INT64_MAX), 5, 41, kPlenty).reason, Reason::kTooFarAhead);
}

TEST(CommandQueue, RejectsAStartFromTheBusBeyondTheLimitOfTheScene) {
  CommandQueue queue(0.25, 60'000);
  EXPECT_EQ(queue.submit(make_push(1, 0, 41 + 60'000), 5, 41, kPlenty).reason, Reason::kAccepted);
  const auto refused = queue.submit(make_push(2, 0, 42 + 60'000), 5, 41, kPlenty);
  EXPECT_EQ(refused.reason, Reason::kTooFarAhead);
  EXPECT_EQ(refused.most, 60'000);
  ForceCommand of_operator = make_push(3, 0, 42 + 60'000);
  of_operator.sender = {'l', 'o', 'c', 'a', 'l', '.', 'a'};
  EXPECT_EQ(queue.submit(of_operator, 5, 41, kPlenty).reason, Reason::kAccepted);
}

TEST(CommandQueue, CommandsAreOrderedByStartTickAndThenByArrival) {
  CommandQueue queue;
  const std::vector<std::int64_t> starts{30, 10, 20, 10, 30, 20, 10};
  for (std::size_t i = 0; i < starts.size(); ++i) {
    queue.submit(make_push(static_cast<std::int64_t>(i), static_cast<int>(i), starts[i]), 5, 0, kPlenty);
  }
  std::vector<std::int64_t> order;
  for (std::int64_t tick = 0; tick <= 30; ++tick) {
    for (const ForceCommand& command : queue.take_due(tick)) {
      EXPECT_EQ(command.start_tick, tick);
      order.push_back(command.sequence);
    }
    queue.settle({});
  }
  EXPECT_EQ(order, (std::vector<std::int64_t>{1, 3, 6, 2, 5, 0, 4}));
  EXPECT_EQ(queue.num_pending(), 0);
}

TEST(CommandQueue, TheWaitForARequestedTickIsNotCountedAsLatency) {
  CommandQueue queue;
  queue.submit(make_push(1, 0, 12), 5, 10, kPlenty);
  EXPECT_EQ(queue.take_due(12).size(), 1u);
  EXPECT_TRUE(queue.due_received_ns().empty());
}

/// Returns the command with this sender.
ForceCommand of(const std::string& sender, ForceCommand command) {
  command.sender.fill('\0');
  std::ranges::copy(sender, command.sender.begin());
  return command;
}

TEST(CommandQueue, GivesASenderAtMostAQuarterOfItsPlacesAndReservesAQuarterForTheOperator) {
  CommandQueue queue;
  const auto submit = [&queue](const std::string& sender, int i) {
    return queue.submit(of(sender, make_push(i, i % 10, 100 + i)), 5, 0, kPlenty);
  };
  constexpr int kShare = CommandQueue::kMaxPending / 4;
  for (const char* sender : {"a", "b", "c"}) {
    for (int i = 0; i < kShare; ++i) ASSERT_EQ(submit(sender, i).reason, Reason::kAccepted) << sender << i;
    const auto refused = submit(sender, 0);
    EXPECT_EQ(refused.reason, Reason::kQueueFull);
    EXPECT_EQ(refused.found, kShare);
  }
  EXPECT_EQ(submit("d", 0).reason, Reason::kQueueFull)
      << "three senders fill the part of the queue for the bus";
  for (int i = 0; i < kShare; ++i) ASSERT_EQ(submit("local.e", i).reason, Reason::kAccepted) << i;
  EXPECT_EQ(submit("local.f", 0).reason, Reason::kQueueFull);
  EXPECT_EQ(queue.num_pending(), CommandQueue::kMaxPending);
  // four commands are due at tick 100 and leave the queue
  EXPECT_EQ(queue.take_due(100).size(), 4u);
  queue.settle({});
  for (const char* sender : {"d", "local.e"})
    EXPECT_EQ(submit(sender, 1).reason, Reason::kAccepted) << sender;
}

TEST(CommandQueue, TheShareOfASenderIsAParameterAndIsAtLeastOneSlot) {
  CommandQueue shared_by_one(1.0);
  int num_accepted = 0;
  for (int slot = 0; slot < kMaxSlots; ++slot)
    num_accepted +=
        shared_by_one.submit(make_push(slot, slot), 5, 0, kPlenty).reason == Reason::kAccepted ? 1 : 0;
  EXPECT_EQ(num_accepted, CommandQueue::kBusSlots) << "the operator's slots are reserved";
  CommandQueue small(1e-9);
  EXPECT_EQ(small.submit(make_push(1, 0), 5, 0, kPlenty).reason, Reason::kAccepted);
  small.take_due(0);
  small.settle({});
  EXPECT_EQ(small.submit(make_push(2, 1), 5, 0, kPlenty).reason, Reason::kNoSlotFree);
  EXPECT_EQ(small.submit(make_push(3, 0), 5, 0, kPlenty).reason, Reason::kAccepted);
}

TEST(CommandQueue, RejectsCommandsIfTheAppliedRingMayLackRoomForTheirEntries) {
  CommandQueue queue;
  // a command needs one entry, its end needs another, and one entry is reserved for a reset
  EXPECT_EQ(queue.submit(make_push(1), 5, 0, 2).reason, Reason::kQueueFull);
  EXPECT_EQ(queue.submit(make_push(1), 5, 0, 3).reason, Reason::kAccepted);
  EXPECT_EQ(queue.submit(make_push(2, 1), 5, 0, 4).reason, Reason::kQueueFull);
  EXPECT_EQ(queue.submit(make_push(2, 1), 5, 0, 5).reason, Reason::kAccepted);
  queue.take_due(0);
  queue.settle({});
  EXPECT_EQ(queue.num_owed(), 2) << "one entry is owed for the end of each command";
}

TEST(CommandQueue, LimitsTheSlotsOfAllSendersAndOfEachSender) {
  CommandQueue queue;
  constexpr int kShare = kMaxSlots / 4;
  for (const char* sender : {"test", "b", "c", "local.d"}) {
    for (int slot = 0; slot < kShare; ++slot) {
      const int start = slot < kShare / 2 ? -1 : 1000;  // half of the slots are in force, and half are
                                                        // reserved
      ASSERT_EQ(queue.submit(of(sender, make_push(slot, slot, start)), 5, 0, kPlenty).reason,
                Reason::kAccepted);
    }
    const auto refused = queue.submit(of(sender, make_push(99, kShare)), 5, 0, kPlenty);
    EXPECT_EQ(refused.reason, Reason::kNoSlotFree) << sender;
    EXPECT_EQ(refused.found, kShare);
  }
  queue.take_due(0);
  queue.settle({});
  ForceCommand other = of("other", make_push(1, 0));
  const auto refused = queue.submit(other, 5, 1, kPlenty);
  EXPECT_EQ(refused.reason, Reason::kNoSlotFree);
  EXPECT_EQ(refused.found, CommandQueue::kBusSlots);
  EXPECT_EQ(queue.submit(make_push(100, 3), 5, 1, kPlenty).reason, Reason::kAccepted)
      << "a sender may replace its own command";
  other.num_points = 0;
  EXPECT_EQ(queue.submit(other, 5, 1, kPlenty).reason, Reason::kAccepted)
      << "a clearing command needs no slot";
  // slot 5 ends, so one slot is free again
  queue.take_due(1);
  StepReport report;
  report.num_expiries = 1;
  report.expiries[0] = {make_push(0).sender, 5, 5, false};
  queue.settle(report);
  other.num_points = 1;
  EXPECT_EQ(queue.submit(other, 5, 2, kPlenty).reason, Reason::kAccepted);
  other.slot = 1;
  EXPECT_EQ(queue.submit(other, 5, 2, kPlenty).reason, Reason::kNoSlotFree);
}

std::array<char, kSenderSize> target(const std::string& name) { return of(name, make_push(0)).sender; }

TEST(CommandQueue, ClearingASenderEndsOnlyItsCommands) {
  CommandQueue queue;
  for (const char* sender : {"a", "b", "local.c"}) {
    for (int slot = 0; slot < 3; ++slot)
      ASSERT_EQ(queue.submit(of(sender, make_push(slot + 1, slot)), 5, 0, kPlenty).reason, Reason::kAccepted);
  }
  queue.take_due(0);
  queue.settle({});
  for (const char* sender : {"a", "b", "local.c"})
    ASSERT_EQ(queue.submit(of(sender, make_push(9, 9, 100)), 5, 1, kPlenty).reason, Reason::kAccepted);
  const auto cleared = [&](const char* name) {
    queue.clear_senders(target(name));
    const auto due = queue.take_due(1);
    EXPECT_EQ(static_cast<std::size_t>(queue.num_due_clearances()), due.size());
    std::multiset<std::string> ended;
    for (const ForceCommand& command : due) {
      EXPECT_TRUE(is_clearing(command));
      ended.insert(std::string(command.sender.data()) + " " + std::to_string(command.slot) + " " +
                   std::to_string(command.sequence));
    }
    queue.settle({});
    return ended;
  };
  EXPECT_EQ(cleared("a"), (std::multiset<std::string>{"a 0 1", "a 1 2", "a 2 3"}));
  EXPECT_EQ(queue.num_pending(), 2) << "the commands of b and of the operator remain";
  EXPECT_EQ(queue.num_owed(), 6 + 2 * 2);
  EXPECT_EQ(cleared("a"), (std::multiset<std::string>{})) << "nothing is left to clear";
  EXPECT_EQ(cleared("*"), (std::multiset<std::string>{"b 0 1", "b 1 2", "b 2 3"}));
  EXPECT_EQ(queue.num_owed(), 3 + 2) << "* means all senders on the bus, so the operator keeps its commands";
  EXPECT_EQ(cleared("local.c").size(), 3u);
  EXPECT_EQ(queue.num_owed(), 0);
}

TEST(CommandQueue, SlotsOfAClearedSenderAreFreeAtOnce) {
  CommandQueue queue(1.0);
  for (int slot = 0; slot < CommandQueue::kBusSlots; ++slot)
    ASSERT_EQ(queue.submit(make_push(slot + 1, slot), 5, 0, kPlenty).reason, Reason::kAccepted);
  queue.take_due(0);
  queue.settle({});
  EXPECT_EQ(queue.submit(of("b", make_push(1)), 5, 1, kPlenty).reason, Reason::kNoSlotFree);
  queue.clear_senders(target("test"));
  EXPECT_EQ(queue.submit(of("b", make_push(2)), 5, 1, kPlenty).reason, Reason::kAccepted);
  const auto due = queue.take_due(1);
  ASSERT_EQ(due.size(), static_cast<std::size_t>(CommandQueue::kBusSlots) + 1);
  EXPECT_EQ(due.back().sequence, 2) << "the slots are cleared before the new command is applied";
}

/// Compares the queue with the step for random commands of two senders. The commands have short durations,
/// empty slots, or start later.
TEST(CommandQueue, TheStepHasASlotForEveryAcceptedCommand) {
  const Plan plan = octahedron_plan();
  State state = make_state(plan);
  Workspace workspace = make_workspace(plan);
  StepReport report;
  CommandQueue queue;
  std::mt19937_64 engine(11);
  const auto draw = [&engine](int low, int high) {
    return std::uniform_int_distribution<int>(low, high)(engine);
  };
  int num_full = 0;
  int num_cleared = 0;
  for (std::int64_t tick = 0, sequence = 1; tick < 3000; ++tick) {
    for (int i = draw(0, 4); i > 0; --i) {
      ForceCommand command = make_push(sequence++, draw(0, 63), draw(0, 1) == 0 ? -1 : tick + draw(0, 40));
      if (draw(0, 1) == 0) command.sender = {'b'};
      command.duration_ticks = draw(1, 60);
      if (draw(0, 5) == 0) command.num_points = 0;
      num_full += queue.submit(command, 5, tick, kPlenty).reason == Reason::kNoSlotFree ? 1 : 0;
    }
    const bool is_cleared = draw(0, 99) == 0 && queue.can_clear(kPlenty);
    if (is_cleared) {
      queue.clear_senders({'b'});
      // a command after the clear must be accepted
      ForceCommand command = make_push(sequence++, draw(0, 63));
      command.sender = {'b'};
      ASSERT_EQ(queue.submit(command, 5, tick, kPlenty).reason, Reason::kAccepted);
    }
    const auto due = queue.take_due(tick);
    step(plan, state, {due}, workspace, report);
    if (is_cleared) {
      const auto slots = std::span(state.slots).first(static_cast<std::size_t>(state.num_slots));
      ASSERT_EQ(std::ranges::count_if(slots, [](const Slot& slot) { return slot.command.sender[0] == 'b'; }),
                1)
          << "tick " << tick;
      ++num_cleared;
    }
    // after the step, the last command for each slot must be in force
    for (const ForceCommand& command : due) {
      const auto later = due.subspan(static_cast<std::size_t>(&command - due.data()) + 1);
      const bool is_last = std::ranges::none_of(later, [&](const ForceCommand& other) {
        return other.slot == command.slot && other.sender == command.sender;
      });
      if (!is_last || command.num_points == 0) continue;
      const auto slots = std::span(state.slots).first(static_cast<std::size_t>(state.num_slots));
      ASSERT_TRUE(std::ranges::any_of(slots,
                                      [&](const Slot& slot) {
                                        return slot.command.sender == command.sender &&
                                               slot.command.sequence == command.sequence;
                                      }))
          << "tick " << tick << " sequence " << command.sequence;
    }
    queue.settle(report);
    ASSERT_EQ(queue.num_owed(), 2 * queue.num_pending() + state.num_slots)
        << "the queue knows how many slots are in force";
  }
  EXPECT_GT(num_cleared, 10);
  EXPECT_GT(num_full, 0) << "some commands were refused";
}

}  // namespace
}  // namespace freeflex::testing
