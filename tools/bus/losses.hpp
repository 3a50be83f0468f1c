// Finds messages that a daemon published at its scene's rates but that a recording lacks, and where they were
// lost.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/plan.hpp"
#include "freeflex_msgs/status_t.hpp"
#include "service/io/wire/outbound.hpp"

namespace freeflex::tools {

struct RecordedSession;

/// Tick, epoch and number of one page of POINTS or LOADS, or of a STATE, which is one page.
struct PageRecord {
  std::int64_t tick = 0;
  std::int64_t epoch = 0;
  std::int32_t page = 0;  // from 0
  std::int32_t num_pages = 0;
};

/// The daemon's counts of messages that it did not send, in the first and in the last STATUS of the log.
struct UnsentCounts {
  void take(const freeflex_msgs::status_t& status);

  struct Range {
    std::int64_t first = 0, last = 0;
    std::int64_t size() const { return last - first; }
  };
  bool has_any = false;
  std::array<Range, kNumMotionChannels> dropped;  // in the order of kMotionChannels
  Range failed;                                   // messages on all channels that the network refused
  std::int64_t end_tick = -1;  // tick at which the daemon ended, if a STATUS reports it, else -1
};

/// The ticks that a recording lacks on one channel of the motion.
struct Loss {
  std::string channel;          // "STATE"
  std::int64_t num_ticks = 0;   // ticks that the daemon published and that are not complete in the log
  std::int64_t first_tick = 0;  // the first of these ticks
  // number of missing ticks before the first tick in the log, which were lost or are older than the log
  std::int64_t num_before = 0;
  std::int64_t num_unsent = 0;  // number of the other missing ticks that were not sent, from the daemon's
                                // counts in the first and the last STATUS of the log
  // number of ticks that were sent but lost in transit
  std::int64_t num_lost_in_transit() const { return num_ticks - num_before - num_unsent; }
};

/// Returns the losses on each channel of the motion that is in the log, up to the channel's last tick in the
/// log. If the daemon's last STATUS gives the tick at which the daemon ended, the losses are those up to that
/// tick.
/// \pre find_flaw returned an empty text
std::vector<Loss> find_losses(const RecordedSession& session, const Plan& plan);

/// Returns a loss as text, or an empty text if nothing is missing.
std::string describe(const Loss& loss, const UnsentCounts& counts);

}  // namespace freeflex::tools
