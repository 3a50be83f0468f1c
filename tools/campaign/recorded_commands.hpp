// The commands of a recording, applied to every case of a campaign.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "service/campaign/case.hpp"
#include "tools/bus/recording.hpp"

namespace freeflex::campaign {

/// Applies the commands of a recording at their ticks. The recording may be of another plan: its commands act
/// on the points, groups and wheels that have the same numbers.
class RecordedCommander : public Commander {
 public:
  explicit RecordedCommander(const std::string& log);
  /// Returns why the recording cannot be used, or an empty text.
  const std::string& error() const { return error_; }
  /// Returns the tick up to which the recording has all commands.
  std::int64_t known_until() const { return tools::last_known_tick(*session_); }

  /// Returns true if the recording is known to be of another plan.
  bool is_foreign_to(const Plan& plan) const;

  std::string begin(const std::shared_ptr<const CasePlan>& plan, const Case& of, Watch watch) override;
  std::string take(std::vector<ForceCommand>& commands) override;

 private:
  // reads the recording. Returns an empty text or the error.
  std::string read(const std::string& log);

  io::LogReader log_;
  tools::Recording recording_;
  tools::RecordedSession* session_ = nullptr;
  std::unique_ptr<tools::CommandFeed> feed_;
  std::vector<freeflex_msgs::applied_t> ended_;
  std::string error_;
};

}  // namespace freeflex::campaign
