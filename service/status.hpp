// Assembles FREEFLEX_STATUS. Publisher thread.
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

/// What every message of one daemon has in common.
struct Identity {
  std::int64_t session = 0;
  std::uint64_t plan_fingerprint = 0;
  std::string plan_file;  // absolute
  Timing timing{};
  CommandLimits limits{};
};

/// A count that the ingress keeps, as far as it can be true: not negative, never falling, growing no faster
/// than a machine receives.
class ReportedCount {
 public:
  static constexpr std::int64_t kMostAtOnce = 1'000'000;  // between two reports, 100 ms or less
  std::int64_t take(std::int64_t said) {
    if (said > last_) last_ += std::min(said - last_, kMostAtOnce);
    return last_;
  }

 private:
  std::int64_t last_ = 0;
};

class StatusReporter {
 public:
  StatusReporter(const Plan& plan, const Identity& identity, const Output& output, const SharedBlock& shared,
                 const IngressCounts& ingress);

  /// Status of a snapshot at wall time utime [us]; sends_failed is the publisher's to fill.
  freeflex_msgs::status_t report(const Snapshot& snapshot, std::int64_t utime);
  /// Once a second: moves the window of the percentiles on.
  void turn();

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
  std::array<ReportedCount, io::kNumReasons> rejected_;  // by reason
};

/// Why the loop is in fault, in words; empty when it is not.
std::string fault_text(const Snapshot& snapshot);

}  // namespace freeflex::service
