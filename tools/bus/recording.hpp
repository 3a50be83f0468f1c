// What an LCM log holds of one daemon session: commands as they took effect, states, the plan's identity.
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

/// Where an applied_t stands in the log. Messages stay in the file: a long recording does not fit memory.
struct AppliedRecord {
  std::int64_t sequence = 0;
  std::int64_t tick = 0;
  std::int32_t kind = 0;    // applied_t constants
  std::int64_t offset = 0;  // [bytes]
};
/// Where a state_t stands in the log.
struct StateRecord {
  std::int64_t epoch = 0;
  std::int64_t tick = 0;
  double time = 0.0;  // [s]
  std::int64_t applied_count = 0;
  std::int64_t offset = 0;  // [bytes]
};
struct RecordedSession {
  std::int64_t session = 0;
  std::vector<AppliedRecord> applied;                                 // by sequence, repeats dropped
  std::vector<StateRecord> states;                                    // by epoch, then tick
  std::array<std::vector<PageRecord>, io::kNumMotionChannels> pages;  // as io::kMotionChannels
  UnsentCounts unsent;
  bool has_scene = false;  // the log holds a FREEFLEX_SCENE of it
  std::string plan_file;   // as it says
  double rate = 0.0;       // [Hz] as it says
  std::optional<std::uint64_t> plan_fingerprint;
  std::string contradiction;  // empty, or which message names another plan, file or rate than those before it
};
struct Recording {
  std::vector<RecordedSession> sessions;  // in the order in which they appear
  std::string error;    // why nothing can be taken: the file cannot be read, or is of another version
  std::string damage;   // empty, or what is not whole and was passed over, and where
  std::string warning;  // messages of POINTS, LOADS, STATUS that could not be read, if any
};

/// Reads the index of a log, of what is whole in it: linear in its records and sessions.
/// \param prefix  of the channel names
Recording read_recording(io::LogReader& log, const std::string& prefix);

/// The session asked for, or the only one. nullptr and a reason when there is none or the choice is open.
RecordedSession* choose_session(Recording& recording, std::optional<std::int64_t> session,
                                std::string& error);

/// Leaves of a session what is known to be complete: the applied records up to the first sequence that is
/// missing, and the states that contain none behind it. Empty, or what was taken out and why.
std::string cut_at_gap(RecordedSession& session);

/// The tick up to which the session tells all that took effect.
std::int64_t last_known_tick(const RecordedSession& session);

/// Two remarks as one.
std::string joined(const std::string& a, const std::string& b);

/// Empty when all messages name one plan, no applied sequence has two contents, and epochs, ticks and counts
/// of applied records agree with one another; else what contradicts, with its byte. \pre cut_at_gap was
/// called
std::string find_flaw(const RecordedSession& session);

/// [ticks] Most that may lie between two states, or before the first one: 115 days at 1 kHz. So a replay ends
/// also where a tick was forged with everything that it is checked against.
inline constexpr std::int64_t kMostUnseenTicks = 10'000'000'000;
/// Empty when the time of each state is that of its tick and no gap is longer than kMostUnseenTicks: so every
/// tick that is to be stepped to is borne out by a second number. \pre find_flaw is empty
/// \param period  [s] of a tick; 0: not known, gaps alone are looked at
std::string find_time_flaw(const RecordedSession& session, double period);

/// Hands out the records of a session in the order in which they took effect.
class CommandFeed {
 public:
  CommandFeed(io::LogReader& log, const RecordedSession& session, const Plan& plan);

  /// Kind of the next record at this tick, 0 when there is none.
  std::int32_t next_kind(std::int64_t tick) const;
  /// Takes a RESET. \pre next_kind is RESET
  void take_reset() { ++next_; }
  /// Takes all records of a tick up to a RESET: commands into commands, ended slots into ended.
  /// Empty, or what is wrong with the log.
  std::string take_commands(std::int64_t tick, std::vector<ForceCommand>& commands,
                            std::vector<freeflex_msgs::applied_t>& ended);
  /// Tick of the next record; nullopt after the last.
  std::optional<std::int64_t> next_tick() const;
  /// Records taken so far.
  std::int64_t num_taken() const { return static_cast<std::int64_t>(next_); }

 private:
  io::LogReader& log_;
  const RecordedSession& session_;
  io::NameTable names_;
  std::size_t next_ = 0;
};

}  // namespace freeflex::tools
