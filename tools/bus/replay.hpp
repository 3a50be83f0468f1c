// Replays a recording. The replay applies the recorded commands at their ticks and compares every recorded
// state and every recorded verdict bit for bit.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "messages/channels.hpp"
#include "tools/bus/losses.hpp"

namespace freeflex::tools {

struct ReplayRequest {
  std::string log = {};   // LCM event log
  std::string plan = {};  // plan or scene file; empty: the file that the log names
  std::string prefix = channels::kDefaultPrefix;
  std::optional<std::int64_t> session = {};  // needed if the log contains several sessions
};

/// The first difference from the recording.
struct Difference {
  std::int64_t tick = 0;
  std::string what;  // "q[3]", "slots that ended"
  std::string recorded, replayed;
};

struct ReplayOutcome {
  enum class Result : std::uint8_t {
    kIdentical,
    kDiffers,     // see difference
    kIncomplete,  // the log is damaged or incomplete, but all states that were compared are identical
    kStopped,     // Ctrl-C stopped the replay
    kError        // no log, no session or no plan to replay
  };
  Result result = Result::kIdentical;
  std::string error;  // the reason why the result is kIncomplete, kStopped or kError
  std::string warning;
  std::optional<Difference> difference;
  std::int64_t ticks = 0;
  std::int64_t num_states = 0;            // states compared
  std::int64_t num_verdicts = 0;          // verdicts compared
  std::int64_t num_commands = 0;          // commands applied
  std::vector<Loss> losses;               // losses on each channel of the motion that is in the log
  std::vector<std::string> not_compared;  // numbers of POINTS and LOADS messages, as texts

  void warn(const std::string& text) { warning += (warning.empty() ? "" : "; ") + text; }
};

/// Reads the log, looks for contradictions, then steps from tick 0 to the last recorded state. If the log is
/// damaged or lacks commands, replays up to the last state before which all commands are known. The replay
/// ends for any bytes in the log, because every tick is checked before the replay steps to it (see
/// find_time_flaw).
ReplayOutcome replay(const ReplayRequest& request);

}  // namespace freeflex::tools
