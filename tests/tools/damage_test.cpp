// A damaged byte is reported or changes nothing, complete records are replayed, and every replay ends.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <stdexcept>

#include "tests/tools/damage_cases.hpp"

namespace freeflex::testing {
namespace {

using freeflex_msgs::state_t;

// [bytes] offsets of fields in a message, counted from the beginning of its fingerprint
constexpr std::size_t kSession = 16, kEpoch = 24, kTick = 32;

/// Returns event number `which` of a channel. Indices start at 0.
const io::LogEvent& event_on(const std::string& channel, std::size_t which) {
  for (const io::LogEvent& event : real().events)
    if (event.channel == channel && which-- == 0) return event;
  throw std::runtime_error("no such event");
}
std::size_t name_at(const io::LogEvent& event) {
  return static_cast<std::size_t>(event.offset + io::kLogHeaderBytes);
}
std::size_t message_at(const io::LogEvent& event) { return name_at(event) + event.channel.size(); }

/// Replays the recording with a change to its list of events.
ReplayOutcome replay_edited(const std::function<void(std::vector<io::LogEvent>&)>& change,
                            const std::string& prefix = channels::kDefaultPrefix) {
  const TemporaryFolder folder;
  std::vector<io::LogEvent> events = real().events;
  change(events);
  io::LogWriter writer(folder / "changed.log");
  for (const io::LogEvent& event : events) writer.write(event.channel, event.utime, event.bytes);
  EXPECT_EQ(writer.close(), "");
  return tools::replay({.log = folder / "changed.log", .prefix = prefix});
}

void edit_state(io::LogEvent& event, const std::function<void(state_t&)>& change) {
  state_t state;
  ASSERT_TRUE(io::decode_message(event.bytes, state));
  change(state);
  event.bytes = io::encode(state);
}

TEST(Damage, EachOf2000FlippedBytesIsReportedOrHarmless) {
  const Tally tally = flip_bytes(2'000, 11);
  EXPECT_GT(tally.refused, 300);
  EXPECT_GT(tally.differs, 600);
}

std::int64_t end_of(const io::LogEvent& event) {
  return event.offset + io::kLogHeaderBytes +
         static_cast<std::int64_t>(event.channel.size() + event.bytes.size());
}

/// Holds the numbers of ticks, states and commands that a replay compared.
using Compared = std::array<std::int64_t, 3>;
Compared compared(const ReplayOutcome& outcome) {
  return {outcome.ticks, outcome.num_states, outcome.num_commands};
}

TEST(Damage, ACutRecordingIsReplayedUpToTheLastCompleteRecord) {
  // all cuts are after the first STATE and SCENE, because without these messages there would be nothing to
  // replay
  const auto first = static_cast<std::size_t>(end_of(event_on("FREEFLEX_SCENE", 0)));
  std::mt19937_64 random(7);
  std::vector<std::size_t> cuts;
  for (std::size_t k = 1; k < 40; ++k) cuts.push_back(first + k);
  for (int k = 0; k < 60; ++k) cuts.push_back(first + random() % (real().bytes.size() - first));
  for (const std::size_t cut : cuts) {
    std::int64_t begin = 0, all = 0;  // offset and size of the record that is cut
    for (const io::LogEvent& event : real().events)
      if (event.offset <= static_cast<std::int64_t>(cut)) begin = event.offset, all = end_of(event) - begin;
    const auto there = static_cast<std::int64_t>(cut) - begin;
    if (there == 0) continue;
    const ReplayOutcome whole = real().replay(real().bytes.substr(0, static_cast<std::size_t>(begin)));
    ASSERT_EQ(whole.result, ReplayResult::kIdentical) << whole.error;
    const ReplayOutcome outcome = real().replay(real().bytes.substr(0, cut));
    EXPECT_EQ(outcome.result, ReplayResult::kIncomplete) << cut;
    EXPECT_EQ(compared(outcome), compared(whole)) << cut;
    const bool is_in_header = there < io::kLogHeaderBytes;
    EXPECT_TRUE(contains(outcome.error,
                         "damaged at byte " + std::to_string(begin) + ": the file ends inside a record"))
        << outcome.error;
    EXPECT_TRUE(contains(outcome.error, std::to_string(there) + " of " +
                                            std::to_string(is_in_header ? io::kLogHeaderBytes : all) +
                                            " bytes" + (is_in_header ? " of its header" : "") +
                                            "; the motion is known up to tick " +
                                            std::to_string(whole.ticks)))
        << outcome.error;
  }
}

// the record before the damaged sync word is not read either, because its lengths may be damaged instead of
// the sync word
TEST(Damage, ADamagedSyncWordLosesTwoRecordsAndTheStatesThatDependOnThem) {
  int num_with_command = 0;
  const std::vector<io::LogEvent>& events = real().events;
  for (std::size_t i = 9; i + 1 < events.size(); i += 7) {
    const ReplayOutcome outcome = real().replay_flipped(static_cast<std::size_t>(events[i].offset), 0x10);
    EXPECT_EQ(outcome.result, ReplayResult::kIncomplete) << i << outcome.error;
    EXPECT_TRUE(contains(outcome.error, "damaged at byte " + std::to_string(events[i].offset) +
                                            ": no record starts here; nothing is read from byte " +
                                            std::to_string(events[i - 1].offset) + " to byte " +
                                            std::to_string(events[i + 1].offset)))
        << outcome.error;
    std::int64_t known = std::int64_t{1} << 62;  // number of APPLIED records before the first gap
    for (const std::size_t lost : {i - 1, i}) {
      freeflex_msgs::applied_t applied;
      if (events[lost].channel == "FREEFLEX_APPLIED" && io::decode_message(events[lost].bytes, applied))
        known = std::min(known, applied.applied_sequence);
    }
    std::int64_t num_states = 0;
    for (const io::LogEvent& event : events) {
      state_t state;
      const bool is_lost = &event == &events[i - 1] || &event == &events[i];
      if (event.channel == "FREEFLEX_STATE" && !is_lost && io::decode_message(event.bytes, state))
        num_states += static_cast<int>(state.applied_count <= known);
    }
    EXPECT_EQ(outcome.num_states, num_states) << i << outcome.error;
    if (known > std::int64_t{1} << 60) continue;
    ++num_with_command;
    EXPECT_TRUE(contains(outcome.error,
                         "the APPLIED event with sequence " + std::to_string(known) + " is missing, so "))
        << outcome.error;
  }
  EXPECT_GT(num_with_command, 1);
}

TEST(Damage, AChangedEpochOrTickOfAStateIsDetected) {
  const io::LogEvent& state = event_on("FREEFLEX_STATE", 20);
  for (const std::size_t field : {kEpoch, kTick}) {
    for (std::size_t at = message_at(state) + field; at < message_at(state) + field + 8; ++at) {
      for (int mask = 1; mask < 256; mask += 3) {
        const ReplayOutcome outcome = real().replay_flipped(at, mask);
        EXPECT_EQ(outcome.result, ReplayResult::kIncomplete) << at << " " << mask;
        EXPECT_TRUE(contains(outcome.error, "at byte " + std::to_string(state.offset) + ","))
            << outcome.error;
      }
    }
  }
}

TEST(Damage, EveryChangedTickFieldOfACommandIsDetected) {
  Tally tally;
  for (const std::size_t which :
       {0, 3, 7, 8, 9}) {  // a force, a lost lease, a reset, the last force and its end
    const std::size_t tick = message_at(event_on("FREEFLEX_APPLIED", which)) + kTick;
    for (std::size_t at = tick; at < tick + 8; ++at)
      for (int mask = 1; mask < 256; mask += 12)
        expect_accounted(real().replay_flipped(at, mask), tally, std::to_string(at));
  }
  EXPECT_EQ(tally.unchanged, 0);
}

TEST(Damage, ADamagedChannelNameIsReportedAtItsByte) {
  for (const char* channel : {"FREEFLEX_STATE", "FREEFLEX_APPLIED", "FREEFLEX_SCENE"}) {
    const io::LogEvent& event = event_on(channel, 2);
    for (std::size_t at = name_at(event); at < message_at(event); ++at) {
      for (int bit = 0; bit < 8; ++bit) {
        const ReplayOutcome outcome = real().replay_flipped(at, 1 << bit);
        EXPECT_EQ(outcome.result, ReplayResult::kIncomplete) << channel << at;
        EXPECT_GT(outcome.num_states, 0) << channel << at;
        EXPECT_TRUE(contains(outcome.error, ", so the channel name is damaged at byte " + std::to_string(at)))
            << outcome.error;
      }
    }
  }
}

TEST(Damage, ADamagedSessionNumberIsReportedAtItsByte) {
  for (const char* channel : {"FREEFLEX_STATE", "FREEFLEX_APPLIED", "FREEFLEX_SCENE"}) {
    const std::size_t session = message_at(event_on(channel, 1)) + kSession;
    for (std::size_t at = session; at < session + 8; ++at) {
      const ReplayOutcome outcome = real().replay_flipped(at, 0x21);
      EXPECT_EQ(outcome.result, ReplayResult::kIncomplete) << channel << at;
      EXPECT_GT(outcome.num_states, 0) << channel << at;
      EXPECT_TRUE(contains(outcome.error, ", so that number is damaged at byte " + std::to_string(at)))
          << outcome.error;
    }
  }
}

TEST(Damage, ADamagedLengthThatCoversTheNextRecordsIsDetected) {
  // the test sets one byte of a length to every value with which the record would end where a later record
  // ends
  std::map<std::int64_t, bool> is_end{{static_cast<std::int64_t>(real().bytes.size()), true}};
  for (const io::LogEvent& event : real().events) is_end[event.offset] = true;
  int num_tried = 0;
  for (const io::LogEvent& event : real().events) {
    const auto header = static_cast<std::size_t>(event.offset);
    const auto end = static_cast<std::int64_t>(message_at(event) + event.bytes.size());
    for (std::size_t at = header + 20; at < header + 28; ++at) {
      const int shift = static_cast<int>(3 - (at - header) % 4) * 8;
      const int found = static_cast<unsigned char>(real().bytes[at]);
      for (int value = 0; value < 256; ++value) {
        const std::int64_t other = end + (std::int64_t{value - found} << shift);
        if (value == found || other <= event.offset || !is_end.contains(other)) continue;
        const ReplayOutcome outcome = real().replay_flipped(at, value ^ found);
        EXPECT_EQ(outcome.result, ReplayResult::kIncomplete) << at;
        EXPECT_TRUE(contains(outcome.error, "damaged at byte " + std::to_string(event.offset)))
            << outcome.error;
        ++num_tried;
      }
    }
  }
  EXPECT_GT(num_tried, 50);
}

TEST(Damage, AForgedTickBeyondTheLongestGapIsRefused) {
  const ReplayOutcome outcome = replay_edited([](auto& events) {
    for (std::size_t i = events.size(); i-- > 0;) {
      if (events[i].channel != "FREEFLEX_STATE") continue;
      // the last state, which includes every command, gets a forged tick and the time of this tick
      return edit_state(events[i], [](state_t& state) {
        const std::int64_t first = state.tick - std::llround(state.time * 1000.0);
        state.tick = std::int64_t{1} << 40;
        state.time = static_cast<double>(state.tick - first) * 0.001;
      });
    }
  });
  EXPECT_EQ(outcome.result, ReplayResult::kIncomplete);
  EXPECT_TRUE(contains(outcome.error, "10000000000 ticks without records are replayed"))
      << outcome.error << outcome.ticks;
}

const tools::Loss& state_loss(const ReplayOutcome& outcome) {
  if (outcome.losses.size() != 1) throw std::runtime_error("not the losses of STATE alone");
  return outcome.losses.front();
}

TEST(Damage, LostStatesAreCounted) {
  const ReplayOutcome lost = replay_edited([](auto& events) {
    int which = 0;
    std::erase_if(events, [&](const io::LogEvent& event) {
      return event.channel == "FREEFLEX_STATE" && (which++ % 10) == 5;
    });
  });
  EXPECT_EQ(lost.result, ReplayResult::kIdentical) << lost.error;
  EXPECT_EQ(state_loss(real().whole).num_ticks, 0) << real().whole.warning;
  EXPECT_EQ(lost.num_states + state_loss(lost).num_ticks, real().whole.num_states);
  EXPECT_EQ(state_loss(lost).num_lost_in_transit(), state_loss(lost).num_ticks);
  EXPECT_TRUE(contains(lost.warning, " not in the log, first at tick 500")) << lost.warning;
  const ReplayOutcome late = replay_edited([](auto& events) {
    const std::int64_t first = event_on("FREEFLEX_STATE", 0).offset;
    std::erase_if(events, [first](const io::LogEvent& event) { return event.offset <= first; });
  });
  EXPECT_EQ(late.result, ReplayResult::kIdentical) << late.error;
  EXPECT_EQ(state_loss(late).num_ticks, 1);
  EXPECT_EQ(state_loss(late).num_before, 1);
}

TEST(Damage, MessagesOfOtherProgramsAreIgnored) {
  const ReplayOutcome outcome = replay_edited([](auto& events) {
    for (std::size_t i = events.size(); i-- > 0;) {
      if (events[i].channel != "FREEFLEX_STATE") continue;
      // the test adds a state of another session on GREEFLEX_STATE, a copy of the state on OBSERVER_STATE,
      // and three bytes on the unrelated channel FREEFLEX_STATF
      io::LogEvent other = events[i];
      edit_state(other, [](state_t& state) { state.session ^= 0x5a5a5a5a5a; });
      other.channel = "GREEFLEX_STATE";
      io::LogEvent passed_on = events[i];
      passed_on.channel = "OBSERVER_STATE";
      io::LogEvent rubbish = events[i];
      rubbish.channel = "FREEFLEX_STATF";
      rubbish.bytes.resize(3);
      events.insert(events.begin() + static_cast<std::ptrdiff_t>(i), {other, passed_on, rubbish});
    }
  });
  EXPECT_EQ(outcome.result, ReplayResult::kIdentical) << outcome.error;
  EXPECT_EQ(outcome.num_states, real().whole.num_states);
}

TEST(Damage, RunsWithOneSessionNumberAreSeparatedByTheirPrefixes) {
  // every session of `freeflex run` has the number 1, so only their prefixes distinguish two runs in one log
  const auto both = [](auto& events) {
    const std::vector<io::LogEvent> one = events;
    for (io::LogEvent event : one) {
      event.channel.replace(0, 8, "FREEFLEY");
      events.push_back(event);
    }
  };
  for (const char* prefix : {"FREEFLEX", "FREEFLEY"}) {
    const ReplayOutcome outcome = replay_edited(both, prefix);
    EXPECT_EQ(outcome.result, ReplayResult::kIdentical) << outcome.error;
    EXPECT_EQ(outcome.num_states, real().whole.num_states);
  }
}

TEST(Damage, OfManySessionsOnlyTheFirstAreListed) {
  const ReplayOutcome outcome = replay_edited([](auto& events) {
    const io::LogEvent state = event_on("FREEFLEX_STATE", 0);
    for (int i = 0; i < 1000; ++i) {
      events.push_back(state);
      edit_state(events.back(), [i](state_t& of) { of.session = std::int64_t{i} << 10 | 7; });
      events.push_back(events.back());
    }
  });
  EXPECT_EQ(outcome.result, ReplayResult::kError);
  EXPECT_TRUE(contains(outcome.error, "several sessions")) << outcome.error;
  EXPECT_TRUE(contains(outcome.error, " and 981 more")) << outcome.error;
}

}  // namespace
}  // namespace freeflex::testing
