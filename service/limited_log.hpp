// Writes log lines that the network or a loop can repeat, at most ten of a kind in any second.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>

namespace freeflex::service {

enum class LineKind : std::size_t {
  kIngressEnded,  // an ingress process ended and is replaced
  kNotHeard,      // packets are lost because the socket's queue is full
  kOtherDaemon,   // another daemon publishes on this daemon's prefix
  kFault,
  kRecovery,  // a RESET ended a fault
  kReplan,    // a switch to the fallback plan
  kNotSent,   // messages could not be sent
  kSlip,
  kRefused,  // the verifier refused a command and did not answer it
  kVerdict,  // the verdict came too late
};
inline constexpr std::size_t kNumLineKinds = static_cast<std::size_t>(LineKind::kVerdict) + 1;

/// Writes the text to spdlog's default logger at the level of the kind.
void write_line(LineKind kind, const std::string& text);

/// Limits each kind separately to kMost lines in any second. A line that exceeds the limit starts a window of
/// one second in which lines of this kind are suppressed. After the window, one line gives the number of
/// suppressed lines and the text of the last one. This line counts as one of the kMost lines. Each thread
/// that logs has its own object. The simulation thread must not use a LimitedLog.
class LimitedLog {
 public:
  static constexpr int kMost = 10;  // lines in any second
  using Write = std::function<void(LineKind, const std::string&)>;

  explicit LimitedLog(Write sink = write_line) : write_(std::move(sink)) {}

  /// Writes the text or suppresses it.  \param now_ns  [ns] time of a monotonic clock
  void write(LineKind kind, std::int64_t now_ns, const std::string& text);
  /// For each window that has ended, writes how many lines were suppressed in it. Must be called many times a
  /// second.
  void write_due(std::int64_t now_ns);
  /// Writes the numbers of suppressed lines of all windows that have not ended. Call it last.
  void end();

 private:
  struct Record {
    std::array<std::int64_t, kMost> written_ns{};  // times of the latest lines, used as a ring
    std::int64_t num_written = 0;
    std::int64_t num_held = 0;  // lines suppressed since held_since_ns
    std::int64_t held_since_ns = 0;
    std::string last_held;
  };
  void put(LineKind kind, std::int64_t now_ns, const std::string& text);
  void put_count(LineKind kind, std::int64_t now_ns);

  Write write_;
  std::array<Record, kNumLineKinds> records_{};
};

}  // namespace freeflex::service
