// The commands of a case in a log, with which the case can be run again without its controller.
#pragma once

#include <memory>
#include <string>

#include "service/campaign/case.hpp"
#include "service/io/wire/log.hpp"
#include "service/io/wire/outbound.hpp"

namespace freeflex::campaign {

/// Writes the commands that take effect, and the last state, to a log that `freeflex run --log` reads.
class CommandTrace : public CaseObserver {
 public:
  explicit CommandTrace(const std::string& path) : writer_(path) {}

  void begin(const Plan& plan) override;
  void stepped(std::int64_t tick, const StepReport& report,
               const std::vector<ForceCommand>& commands) override;
  void end(const State& state) override;
  /// Gives the log its name. Returns an empty text or the error.
  std::string close() { return writer_.close(); }

 private:
  template <class Message>
  void put(const char* channel, std::int64_t tick, const Message& message);

  io::LogWriter writer_;
  const Plan* plan_ = nullptr;
  io::Stamp stamp_;
};

}  // namespace freeflex::campaign
