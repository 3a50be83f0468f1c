// Assembles FREEFLEX_STATUS. Publisher thread only.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>

#include "freeflex_msgs/status_t.hpp"
#include "service/loop.hpp"
#include "service/motion_status.hpp"
#include "service/output.hpp"
#include "service/shared.hpp"

namespace freeflex::service {

/// Values that are the same in all messages of one daemon.
struct Identity {
  std::int64_t session = 0;
  std::uint64_t plan_fingerprint = 0;
  std::string plan_file;  // absolute path
  Timing timing{};
  CommandLimits limits{};
};

/// A count of the ingress, limited to plausible values. The limited count is not negative, never decreases,
/// and grows no faster than a machine can receive messages.
class ReportedCount {
 public:
  // largest increase between two reports, which are at most 100 ms apart
  static constexpr std::int64_t kMostAtOnce = 1'000'000;
  std::int64_t take(std::int64_t reported) {
    if (reported > last_) last_ += std::min(reported - last_, kMostAtOnce);
    return last_;
  }

 private:
  std::int64_t last_ = 0;
};

class StatusReporter {
 public:
  StatusReporter(const Plan& plan, const Identity& identity, const Output& output, const SharedBlock& shared,
                 const IngressCounts& ingress);

  /// Returns the STATUS message of a snapshot at wall time utime [us]. The publisher fills in sends_failed.
  freeflex_msgs::status_t report(const Snapshot& snapshot, std::int64_t utime);
  /// Advances the window of the percentiles. Must be called once a second.
  void advance_window();

 private:
  void fill_counts(freeflex_msgs::status_t& status);
  void fill_timing(freeflex_msgs::status_t& status) const;

  const Plan& plan_;
  const Identity& identity_;
  const Output& output_;
  const SharedBlock& shared_;
  const IngressCounts& ingress_;
  MotionStatus motion_;
  SlidingPercentiles lateness_, compute_, command_latency_;
  ReportedCount received_, dropped_answers_;
  std::array<ReportedCount, io::kNumReasons> rejected_;  // rejections by reason
};

/// Returns the cause of the loop's fault as text, or an empty text if there is no fault.
std::string fault_text(const Snapshot& snapshot);

}  // namespace freeflex::service
