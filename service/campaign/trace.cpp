#include "service/campaign/trace.hpp"

#include <cmath>

#include "core/plan/file/plan_bytes.hpp"
#include "messages/channels.hpp"

namespace freeflex::campaign {

template <class Message>
void CommandTrace::put(const char* channel, std::int64_t tick, const Message& message) {
  const auto utime = std::llround(static_cast<double>(tick) * plan_->period * 1e6);
  writer_.write(std::string(channels::kDefaultPrefix) + channel, utime, io::encode(message));
}

void CommandTrace::begin(const Plan& plan) {
  plan_ = &plan;
  stamp_ = {};
  stamp_.session = 1;
  stamp_.plan_fingerprint = plan_fingerprint(plan);
}

void CommandTrace::stepped(std::int64_t tick, const StepReport& report,
                           const std::vector<ForceCommand>& commands) {
  stamp_.utime = std::llround(static_cast<double>(tick) * plan_->period * 1e6);
  for (std::int32_t i = 0; i < report.num_expiries; ++i) {
    const Expiry& expiry = report.expiries[index(i)];
    put(channels::kApplied, tick, io::make_applied_expiry(expiry, tick, stamp_.applied_count++, stamp_));
  }
  for (const ForceCommand& command : commands)
    put(channels::kApplied, tick, io::make_applied_force(command, tick, stamp_.applied_count++, stamp_));
}

void CommandTrace::end(const State& state) {
  stamp_.utime = std::llround(static_cast<double>(state.tick) * plan_->period * 1e6);
  put(channels::kState, state.tick, io::make_state_message(*plan_, state, stamp_));
}

}  // namespace freeflex::campaign
