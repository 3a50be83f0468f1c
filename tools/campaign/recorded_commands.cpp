#include "tools/campaign/recorded_commands.hpp"

#include <optional>

#include "core/plan/file/plan_bytes.hpp"
#include "messages/channels.hpp"

namespace freeflex::campaign {

using freeflex_msgs::applied_t;

RecordedCommander::RecordedCommander(const std::string& log) : log_(log), error_(read(log)) {}

std::string RecordedCommander::read(const std::string& log) {
  const auto fault = [&](const std::string& why) { return "commands: '" + log + "': " + why; };
  if (!log_.error().empty()) return fault(log_.error());
  recording_ = tools::read_recording(log_, channels::kDefaultPrefix);
  if (!recording_.error.empty()) return fault(recording_.error);
  std::string problem;
  session_ = tools::choose_session(recording_, std::nullopt, problem);
  if (session_ == nullptr) return fault(tools::joined(recording_.damage, problem));
  const std::string loss = tools::joined(recording_.damage, tools::cut_at_gap(*session_));
  if (!loss.empty()) return fault("the log is incomplete: " + loss);
  if (const std::string flaw = tools::find_flaw(*session_); !flaw.empty()) return fault(flaw);
  for (const tools::AppliedRecord& record : session_->applied)
    if (record.kind == applied_t::RESET)
      return fault("it has a reset at tick " + std::to_string(record.tick) +
                   ", after which a case would begin anew; record commands without resets");
  return {};
}

bool RecordedCommander::is_foreign_to(const Plan& plan) const {
  return session_->plan_fingerprint.value_or(plan_fingerprint(plan)) != plan_fingerprint(plan);
}

std::string RecordedCommander::begin(const std::shared_ptr<const CasePlan>& plan, const Case& of,
                                     Watch watch) {
  const double rate = 1.0 / plan->plan.period;
  if (session_->rate > 0.0 && std::abs(session_->rate - rate) > 1e-9 * rate)
    return "the commands were recorded at " + std::to_string(session_->rate) +
           " ticks per second, but the case has " + std::to_string(rate);
  feed_ = std::make_unique<tools::CommandFeed>(log_, *session_, plan->plan);
  return Commander::begin(plan, of, watch);
}

std::string RecordedCommander::take(std::vector<ForceCommand>& commands) {
  ended_.clear();
  return feed_->take_commands(motion().tick(), commands, ended_);
}

}  // namespace freeflex::campaign
