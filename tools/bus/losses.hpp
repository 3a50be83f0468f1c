// What a daemon published by its scene's rates and a recording does not hold, and who lost it.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/step/plan.hpp"
#include "freeflex_msgs/status_t.hpp"
#include "service/io/wire/outbound.hpp"

namespace freeflex::tools {

struct RecordedSession;

/// One page of POINTS or LOADS.
struct PageRecord {
  std::int64_t tick = 0;
  std::int64_t epoch = 0;
  std::int32_t page = 0;  // from 0
  std::int32_t num_pages = 0;
};

/// What the daemon's status said of messages that it did not send, at its first and its last word in the log.
struct UnsentCounts {
  void take(const freeflex_msgs::status_t& status);

  struct Range {
    std::int64_t first = 0, last = 0;
    std::int64_t size() const { return last - first; }
  };
  bool has_any = false;
  std::array<Range, io::kNumMotionChannels> dropped;  // as io::kMotionChannels
  Range failed;                                       // sends that the network did not take, of any channel
  std::int64_t end_tick = -1;                         // at which the daemon ended, when it said so
};

/// Ticks of one channel of the motion.
struct Loss {
  std::string channel;          // "STATE"
  std::int64_t num_ticks = 0;   // that the daemon publishes and the log does not hold whole
  std::int64_t first_tick = 0;  // of them
  std::int64_t num_before = 0;  // before the first that the log holds: lost, or it began later
  std::int64_t num_unsent = 0;  // of the rest, as many as the daemon counts as not sent between its first and
                                // its last status in the log
  std::int64_t num_on_way() const { return num_ticks - num_before - num_unsent; }  // sent, and lost
};

/// For each channel of the motion of which the log holds anything; to its last tick there, or to the end of
/// the daemon when its last status says that.
/// \pre find_flaw is empty
std::vector<Loss> find_losses(const RecordedSession& session, const Plan& plan);

/// In words; empty when nothing is missing.
std::string describe(const Loss& loss, const UnsentCounts& counts);

}  // namespace freeflex::tools
