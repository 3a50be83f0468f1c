// The contents of an LCM log for one session of a daemon, which are the commands that took effect, the
// states, and the plan.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/step/command.hpp"
#include "freeflex_msgs/applied_t.hpp"
#include "service/io/wire/codec.hpp"
#include "service/io/wire/log.hpp"
#include "tools/bus/losses.hpp"

namespace freeflex::tools {

/// Position of an applied_t in the log. Messages stay in the file, because a long recording does not fit in
/// memory.
struct AppliedRecord {
  std::int64_t sequence = 0;
  std::int64_t tick = 0;
  std::int32_t kind = 0;    // one of the constants in applied_t
  std::int64_t offset = 0;  // [bytes]
};
/// Position of a state_t in the log.
struct StateRecord {
  std::int64_t epoch = 0;
  std::int64_t tick = 0;
  double time = 0.0;  // [s]
  std::int64_t applied_count = 0;
  std::int64_t offset = 0;  // [bytes]
};
/// The verdict that a STATUS publishes.
struct VerdictRecord {
  std::int64_t epoch = 0, tick = 0;  // of the state that was judged
  std::int32_t validity = 0;
  // [m], [rad], [m], [m] errors of position, attitude and deformation, and the scale
  std::array<double, 4> values{};
};
struct RecordedSession {
  std::int64_t session = 0;
  std::vector<AppliedRecord> applied;  // ordered by sequence, without repeated records
  std::vector<StateRecord> states;     // ordered by epoch, then by tick
  std::array<std::vector<PageRecord>, kNumMotionChannels> pages;  // in the order of kMotionChannels
  std::vector<VerdictRecord> verdicts;                            // ordered by epoch, then by tick
  UnsentCounts unsent;
  bool has_scene = false;  // true if the log contains a FREEFLEX_SCENE of the session
  std::string plan_file;   // from FREEFLEX_SCENE
  double rate = 0.0;       // [Hz] from FREEFLEX_SCENE
  std::optional<std::uint64_t> plan_fingerprint;
  std::string contradiction;  // text about a message whose plan, file or rate differs from that of earlier
                              // messages; empty if there is none
};
struct Recording {
  std::vector<RecordedSession> sessions;  // sessions in the order in which they appear
  // the reason why nothing can be read, because the file is not accessible or is of another version
  std::string error;
  std::string damage;  // text that says which damaged part was skipped, empty if there is none
  // a text about the messages of POINTS, LOADS and STATUS that could not be read. The text is empty if there
  // are none.
  std::string warning;
};

/// Reads the index of the intact part of a log. The time is O(n log n) in the number n of records and
/// sessions.
/// \param prefix  first part of the channel names
Recording read_recording(io::LogReader& log, const std::string& prefix);

/// Returns the requested session or, if none is requested, the only session. If there is no such session, or
/// if none is requested and there are several, sets `error` to the reason and returns nullptr.
RecordedSession* choose_session(Recording& recording, std::optional<std::int64_t> session,
                                std::string& error);

/// Cuts a session at the first APPLIED event that is missing. Removes the later APPLIED events and the states
/// that include an event that is missing or removed. Returns what was removed and why, or an empty text if
/// nothing was removed.
std::string cut_at_gap(RecordedSession& session);

/// Returns the tick up to which the session contains all commands that took effect.
std::int64_t last_known_tick(const RecordedSession& session);

/// Joins two texts.
std::string joined(const std::string& a, const std::string& b);

/// Returns the first contradiction and its byte. Returns an empty text if all messages refer to one plan, no
/// two APPLIED events with one sequence differ in content, and epochs, ticks and counts of APPLIED events
/// agree with each other.  \pre cut_at_gap was called
std::string find_flaw(const RecordedSession& session);

/// [ticks] Largest gap between two records, or before the first record, that a replay steps through: 115 days
/// at 1 kHz. With this limit a replay ends even if somebody forged a tick and all numbers that the tick is
/// checked against.
inline constexpr std::int64_t kMostUnrecordedTicks = 10'000'000'000;
/// Returns a text about the first state whose time disagrees with its tick, or about a gap above
/// kMostUnrecordedTicks, or an empty text if there is none. So every tick to which the replay steps agrees
/// with a second number of the recording.  \pre find_flaw returned an empty text  \param period  [s] period
/// of a tick; 0: not known, only gaps are checked
std::string find_time_flaw(const RecordedSession& session, double period);

/// Returns the records of a session one after another, in the order in which they took effect.
class CommandFeed {
 public:
  CommandFeed(io::LogReader& log, const RecordedSession& session, const Plan& plan);

  /// Returns the kind of the next record at this tick, or 0 if there is none.
  std::int32_t next_kind(std::int64_t tick) const;
  /// Takes a RESET.  \pre next_kind is RESET
  void take_reset() { ++next_; }
  /// Takes all records of a tick up to a RESET. Appends commands to `commands` and ended slots to `ended`.
  /// Returns an empty text or the error of the log.
  std::string take_commands(std::int64_t tick, std::vector<ForceCommand>& commands,
                            std::vector<freeflex_msgs::applied_t>& ended);
  /// Returns the tick of the next record, or nullopt after the last record.
  std::optional<std::int64_t> next_tick() const;
  /// Returns the number of records taken so far.
  std::int64_t num_taken() const { return static_cast<std::int64_t>(next_); }

 private:
  io::LogReader& log_;
  const RecordedSession& session_;
  io::NameTable names_;
  std::size_t next_ = 0;
};

}  // namespace freeflex::tools
