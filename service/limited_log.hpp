// Lines of the log that the network or a loop can repeat, at most ten of a kind in any second.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>

namespace freeflex::service {

enum class LineKind : std::size_t {
  kIngressEnded,  // and is started again
  kNotHeard,      // packets: the socket's queue is full
  kOtherDaemon,   // publishes on our prefix
  kFault,
  kRecovery,  // from a fault, by RESET
  kReplan,    // a part that was left out is back
  kNotSent,   // messages
  kSlip,
  kRefused,  // a command without a right key
};
inline constexpr std::size_t kNumLineKinds = static_cast<std::size_t>(LineKind::kRefused) + 1;

/// Writes to spdlog's default logger, at the level of the kind.
void write_line(LineKind kind, const std::string& text);

/// Each kind by itself: kMost lines in any second are written. The next holds the kind back for a second;
/// then one line tells how many were held back and what the last of them said, whether or not another
/// follows. That line is one of the kMost. Each thread that logs has one of its own; not for the simulation
/// thread.
class LimitedLog {
 public:
  static constexpr int kMost = 10;  // lines in any second
  using Write = std::function<void(LineKind, const std::string&)>;

  explicit LimitedLog(Write write = write_line) : write_(std::move(write)) {}

  /// Writes the text, or holds it back.  \param now_ns  [ns] of a clock that never goes back
  void say(LineKind kind, std::int64_t now_ns, const std::string& text);
  /// Writes the counts of seconds that are over. Call it many times a second.
  void turn(std::int64_t now_ns);
  /// Writes the counts of seconds that have begun: nothing is said after it.
  void end();

 private:
  struct Record {
    std::array<std::int64_t, kMost> written_ns{};  // of the latest lines, as a ring
    std::int64_t num_written = 0;
    std::int64_t num_held = 0;  // since held_since_ns
    std::int64_t held_since_ns = 0;
    std::string last_held;
  };
  void put(LineKind kind, std::int64_t now_ns, const std::string& text);
  void put_count(LineKind kind, std::int64_t now_ns);

  Write write_;
  std::array<Record, kNumLineKinds> records_{};
};

}  // namespace freeflex::service
