// Replays a recording with one changed byte within this process, and counts the outcomes.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "core/plan/file/plan_bytes.hpp"
#include "messages/channels.hpp"
#include "service/io/scene/input.hpp"
#include "service/io/wire/codec.hpp"
#include "service/io/wire/decode.hpp"
#include "service/io/wire/log.hpp"
#include "service/io/wire/outbound.hpp"
#include "tests/tools/log_events.hpp"
#include "tests/tools/shell.hpp"
#include "tools/bus/replay.hpp"

namespace freeflex::testing {

using tools::ReplayOutcome;
using ReplayResult = ReplayOutcome::Result;

/// Holds the golden recording of the frame with SCENE messages as the daemon sends them. The golden recording
/// itself lacks SCENE, because SCENE contains the path of the plan file, which differs between machines. Only
/// every eighth STATUS is kept, because the STATUS messages are most of the bytes and a replay does not need
/// them.
class RealRecording {
 public:
  RealRecording() {
    const std::string plan_file = kGolden + "frame.plan";
    const io::PlanResult loaded = io::load_plan(plan_file, 0.0);
    EXPECT_TRUE(loaded.plan);
    io::LogWriter writer(path);
    io::Stamp stamp{.plan_fingerprint = plan_fingerprint(*loaded.plan)};
    std::int64_t scene_utime = 0;
    int num_status = 0;
    for (const io::LogEvent& event : read_events(kGolden + "frame.log")) {
      if (event.channel == "FREEFLEX_STATUS" && num_status++ % 8 != 0) continue;
      writer.write(event.channel, event.utime, event.bytes);
      freeflex_msgs::state_t state;
      if (event.channel != "FREEFLEX_STATE" || !io::decode_message(event.bytes, state)) continue;
      if (state.utime < scene_utime + 1'000'000) continue;  // [us] once a second
      stamp.utime = scene_utime = state.utime;
      stamp.session = state.session;
      for (const auto& page : io::make_scene_messages(*loaded.plan, false, plan_file, stamp))
        writer.write("FREEFLEX_SCENE", stamp.utime, io::encode(page));
    }
    EXPECT_EQ(writer.close(), "");
    bytes = read_text(path);
    events = read_events(path);
    whole = tools::replay({.log = path});
    EXPECT_EQ(whole.result, ReplayResult::kIdentical) << whole.error;
  }

  /// Replays a recording that has the bytes `changed`.
  ReplayOutcome replay(const std::string& changed) const {
    const std::string other = folder / "changed.log";
    write_text(other, changed);
    return tools::replay({.log = other});
  }
  ReplayOutcome replay_flipped(std::size_t at, int mask) const {
    std::string changed = bytes;
    changed[at] = static_cast<char>(changed[at] ^ mask);
    return replay(changed);
  }

  TemporaryFolder folder;
  std::string path = folder / "real.log";
  std::string bytes;
  std::vector<io::LogEvent> events;
  ReplayOutcome whole;
};
inline const RealRecording& real() {
  static const RealRecording recording;
  return recording;
}

/// Counts the outcomes of replays after changes of one byte.
struct Tally {
  int refused = 0, differs = 0, warned = 0, unchanged = 0;
};

/// Expects that the replay refused the changed recording, reported a difference or a warning, or compared the
/// complete recording and found it identical. Counts the outcome in `tally`.
inline void expect_accounted(const ReplayOutcome& outcome, Tally& tally, const std::string& which) {
  const ReplayOutcome& whole = real().whole;
  if (outcome.result == ReplayResult::kIncomplete || outcome.result == ReplayResult::kError) {
    EXPECT_FALSE(outcome.error.empty()) << which;
    ++tally.refused;
  } else if (outcome.result == ReplayResult::kDiffers) {
    EXPECT_TRUE(outcome.difference && !outcome.difference->what.empty()) << which;
    ++tally.differs;
  } else if (outcome.warning != whole.warning) {
    ++tally.warned;
  } else {
    EXPECT_EQ(outcome.result, ReplayResult::kIdentical) << which;
    EXPECT_EQ(outcome.num_states, whole.num_states) << which;
    EXPECT_EQ(outcome.num_commands, whole.num_commands) << which;
    EXPECT_EQ(outcome.ticks, whole.ticks) << which;
    ++tally.unchanged;
  }
}

/// Sets random bytes to random values, one at a time, and replays each changed recording.
inline Tally flip_bytes(int count, std::uint64_t seed) {
  const RealRecording& recording = real();
  std::mt19937_64 random(seed);
  Tally tally;
  for (int i = 0; i < count; ++i) {
    const std::size_t at = random() % recording.bytes.size();
    const int mask = static_cast<int>(1 + random() % 255);
    expect_accounted(recording.replay_flipped(at, mask), tally,
                     "byte " + std::to_string(at) + " with mask " + std::to_string(mask));
  }
  std::printf("%d flips in %zu bytes: %d refused, %d differ, %d with a warning, %d changed nothing\n", count,
              recording.bytes.size(), tally.refused, tally.differs, tally.warned, tally.unchanged);
  return tally;
}

}  // namespace freeflex::testing
