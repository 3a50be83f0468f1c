// What an LCM log holds of one daemon session: commands as they took effect, states, the plan's identity.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/step/command.hpp"
#include "freeflex_msgs/applied_t.hpp"
#include "service/io/wire/codec.hpp"
#include "service/io/wire/log.hpp"

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
  std::int64_t applied_count = 0;
  std::int64_t offset = 0;  // [bytes]
};
struct RecordedSession {
  std::int64_t session = 0;
  std::vector<AppliedRecord> applied;  // by sequence, repeats dropped
  std::vector<StateRecord> states;     // by epoch, then tick
  std::string scene_name;
  std::string plan_file;  // empty: the log holds no FREEFLEX_SCENE
  double rate = 0.0;      // [Hz] 0: the log holds no FREEFLEX_SCENE
  std::optional<std::uint64_t> plan_fingerprint;
  std::string contradiction;  // empty, or which message names another plan than those before it
};
struct Recording {
  std::vector<RecordedSession> sessions;  // in the order in which they appear
  std::string error;                      // damage: what and where
  bool is_readable = true;                // false: the file could not be opened
};

/// Reads the index of a whole log. \param prefix  of the channel names
Recording read_recording(io::LogReader& log, const std::string& prefix);

/// The session asked for, or the only one. nullptr and a reason when there is none or the choice is open.
const RecordedSession* choose_session(const Recording& recording, std::optional<std::int64_t> session,
                                      std::string& error);

/// Empty when all messages name one plan and applied sequences run from 0 without a gap as far as the states
/// need them; else what is missing or contradicts.
std::string find_flaw(const RecordedSession& session);

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
