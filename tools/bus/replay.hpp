// The commands of a recording fed back at their ticks, every recorded state compared bit for bit.
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
  std::string plan = {};  // plan or scene file; empty: the one that the log names
  std::string prefix = channels::kDefaultPrefix;
  std::optional<std::int64_t> session = {};  // needed when the log holds several
};

/// The first thing that is not as recorded.
struct Difference {
  std::int64_t tick = 0;
  std::string what;  // "q[3]", "expired slots"
  std::string recorded, replayed;
};

struct ReplayOutcome {
  enum class Result : std::uint8_t {
    kIdentical,
    kDiffers,     // see difference
    kIncomplete,  // the log is damaged or lacks something; the states that were compared are as recorded
    kStopped,     // by Ctrl-C
    kError        // no log, no session or no plan to replay
  };
  Result result = Result::kIdentical;
  std::string error;  // why there is no answer
  std::string warning;
  std::optional<Difference> difference;
  std::int64_t ticks = 0;
  std::int64_t num_states = 0;            // compared
  std::int64_t num_commands = 0;          // fed back
  std::vector<Loss> losses;               // of each channel of the motion that is in the log
  std::vector<std::string> not_compared;  // what the log holds beside that, in words

  void warn(const std::string& text) { warning += (warning.empty() ? "" : "; ") + text; }
};

/// Reads the log, looks for what contradicts itself, then steps from tick 0 to the last recorded state. Of a
/// log that is damaged or lacks commands it takes the states up to which all commands are known. It ends
/// whatever the bytes of the log are: no tick is stepped to that is not checked before (see find_time_flaw).
ReplayOutcome replay(const ReplayRequest& request);

}  // namespace freeflex::tools
