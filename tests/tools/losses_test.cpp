// These tests check the number of messages that a recording lacks. The daemon's STATUS shows how many of
// these messages were never sent.
#include "tools/bus/losses.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tools/bus/recording.hpp"

namespace freeflex::testing {
namespace {

using freeflex_msgs::status_t;
using tools::Loss;
using tools::RecordedSession;

/// Returns a plan at 1 kHz that publishes each channel every 20 ticks.
Plan every_20_ticks() {
  Plan plan;
  plan.period = 1e-3;
  plan.rates = {50.0, 50.0, 50.0};
  return plan;
}

status_t dropped(std::int64_t states, std::int64_t points, std::int64_t tick = 0,
                 std::int32_t mode = status_t::RUNNING) {
  status_t status{};
  status.states_dropped = states;
  status.points_dropped = points;
  status.tick = tick;
  status.mode = mode;
  return status;
}

void add_states(RecordedSession& session, std::initializer_list<std::int64_t> ticks) {
  for (const std::int64_t tick : ticks) session.pages[kStateChannel].push_back({tick, 0, 0, 1});
}

Loss loss_of(const RecordedSession& session, const char* channel = "STATE") {
  for (const Loss& loss : find_losses(session, every_20_ticks()))
    if (loss.channel == channel) return loss;
  ADD_FAILURE() << "no loss of " << channel;
  return {};
}

TEST(Losses, ACompleteRecordingHasNoLosses) {
  RecordedSession session;
  add_states(session, {0, 20, 40, 40, 47, 60});  // there is a hold at tick 47, and one message occurs twice
  session.unsent.take(dropped(0, 0, 79, status_t::STOPPED));
  EXPECT_EQ(loss_of(session).num_ticks, 0);
  EXPECT_EQ(describe(loss_of(session), session.unsent), "");
  EXPECT_EQ(find_losses(session, every_20_ticks()).size(), 1u)
      << "a channel that was not recorded is not reported";
}

TEST(Losses, UnsentMessagesAreDistinguishedFromMessagesLostInTransit) {
  RecordedSession session;
  add_states(session,
             {40, 60, 160, 180, 220});  // ticks 0 and 20 are before the recording; 80 to 140 and 200 are lost
  session.unsent.take(dropped(7, 0));   // the 7 messages were dropped before the log began
  session.unsent.take(dropped(10, 0));
  const Loss loss = loss_of(session);
  EXPECT_EQ(loss.num_ticks, 7);
  EXPECT_EQ(loss.first_tick, 0);
  EXPECT_EQ(loss.num_before, 2);
  EXPECT_EQ(loss.num_unsent, 3);
  EXPECT_EQ(loss.num_lost_in_transit(), 2);
  EXPECT_EQ(describe(loss, session.unsent),
            "STATE of 7 ticks that the daemon publishes at the scene's rate is not in the log, first at "
            "tick 0. Of these, 2 are from before the log begins; 3 were not sent, by the counts of the "
            "status; 2 were lost in "
            "transit");
}

TEST(Losses, HaveNoKnownCauseIfTheRecordingHasNoStatus) {
  RecordedSession session;
  add_states(session, {0, 40});
  EXPECT_EQ(describe(loss_of(session), session.unsent),
            "STATE of 1 tick that the daemon publishes at the scene's rate is not in the log, first at tick "
            "20. Of these, 1 was not sent or lost in transit (no status in the log)");
}

TEST(Losses, AreCountedUpToTheLastTickOfTheDaemon) {
  RecordedSession session;
  add_states(session, {0, 20, 40});
  session.unsent.take(dropped(0, 0, 95));
  EXPECT_EQ(loss_of(session).num_ticks, 0) << "the recording may have ended before the daemon did";
  session.unsent.take(dropped(0, 0, 100, status_t::STOPPED));
  EXPECT_EQ(loss_of(session).num_ticks, 3);
  EXPECT_EQ(loss_of(session).first_tick, 60);
}

TEST(Losses, ATickIsCompleteOnlyIfAllItsPagesAreThere) {
  RecordedSession session;
  auto& pages = session.pages[kPointsChannel];
  for (const std::int64_t tick : {0, 20, 40, 60})
    for (const std::int32_t page : {2, 0, 1})
      if (tick != 40 || page != 1) pages.push_back({tick, 0, page, 3});
  pages.push_back({40, 0, 2, 3});  // a repeated page does not replace the missing one
  pages.push_back({40, 1, 1, 3});  // a page of another epoch does not replace the missing page either
  session.unsent.take(dropped(5, 0));
  session.unsent.take(dropped(9, 0));
  const Loss loss = loss_of(session, "POINTS");
  EXPECT_EQ(loss.num_ticks, 1);
  EXPECT_EQ(loss.first_tick, 40);
  EXPECT_EQ(loss.num_unsent, 0) << "all unsent messages are on the channel STATE";
}

TEST(Losses, DamagedNumbersGiveNoNegativeCount) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();
  RecordedSession session;
  add_states(session, {kLeast, -1, 0, kMost - 3, kMost});
  session.unsent.take(dropped(kLeast, kMost, kMost, status_t::STOPPED));
  session.unsent.take(dropped(kMost, kLeast));
  const Loss loss = loss_of(session);
  EXPECT_GT(loss.num_ticks, 0);
  EXPECT_GE(loss.num_lost_in_transit(), 0);
}

}  // namespace
}  // namespace freeflex::testing
