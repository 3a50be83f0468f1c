// The simulation thread: takes commands, executes ticks, and passes the results to the publisher. All time
// modes use the same step function and differ only in pace.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/motion.hpp"
#include "service/clock.hpp"
#include "service/command_queue.hpp"
#include "service/output.hpp"
#include "service/shared.hpp"
#include "service/verdict_thread.hpp"

namespace freeflex::service {

/// Time mode: how simulated time follows wall time.
struct Timing {
  enum class Kind { kRealtime, kScaled, kLockstep, kAsap };
  Kind kind = Kind::kRealtime;
  double scale = 1.0;  // [-] simulated seconds per wall second; realtime and scaled only

  bool is_paced() const { return kind == Kind::kRealtime || kind == Kind::kScaled; }
};
/// Parses "realtime", "scaled=K" (K finite, > 0), "lockstep" or "asap". Returns nullopt for any other text.
std::optional<Timing> parse_timing(const std::string& text);
std::string timing_name(const Timing& timing);

struct LoopSettings {
  Timing timing{};
  bool starts_holding = false;
  std::int64_t until_tick = 0;  // the loop ends at this tick, 0 if never
  bool may_bus_clear = false;   // true: accepts CLEAR from the bus, because the verifier checks keys
  NotJudged not_judged = NotJudged::kOff;  // why nothing is judged, if there is no verdict thread
  CommandLimits limits{};
};

using InboundRing = decltype(SharedBlock::inbound);

/// The simulation loop. run() allocates no memory, takes no lock, writes no log and opens no file. Its only
/// system calls sleep or read the clock.
class Simulation {
 public:
  /// The largest number of commands from the bus that are taken at one tick. Further commands wait in the
  /// ring for the next tick.
  static constexpr int kMaxDrained = 64;

  /// \param verdicts  judges the motion; nullptr: nothing is judged
  Simulation(const Plan& plan, const LoopSettings& settings, Clock& clock, InboundRing& inbound,
             Output& output, VerdictThread* verdicts);

  /// Body of the simulation thread.
  void run() noexcept;
  /// Makes run() return after the present tick. Any thread may call this function.
  void request_stop() noexcept { is_stopping_.store(true, std::memory_order_relaxed); }

  /// \pre run() is not running
  const State& state() const { return motion_.state(); }
  std::int64_t applied_count() const { return applied_count_; }

 private:
  static constexpr std::int64_t kForever = -1;

  // loop.cpp: the pace
  bool is_stopping() const noexcept { return is_stopping_.load(std::memory_order_relaxed); }
  bool is_advancing() const noexcept { return steps_left_ != 0; }
  Mode mode() const noexcept;
  std::optional<std::int64_t> wait_for_tick() noexcept;
  std::optional<std::int64_t> wait_idle() noexcept;
  void wait_for_verdict() noexcept;
  void advance(std::int64_t woken_ns) noexcept;
  void set_steps(std::int64_t steps) noexcept;

  // loop.cpp: output
  void push_applied(std::int32_t kind, const ForceCommand* command, const Expiry* expiry) noexcept;
  void enter_fault(std::span<const ForceCommand> due, const StepReport& report) noexcept;
  void fill(const State& state, Snapshot& draft) const noexcept;
  void offer_motion(std::size_t channel) noexcept;
  void offer_status() noexcept;
  void offer_all() noexcept;
  void offer_due() noexcept;

  // loop_control.cpp: commands
  void drain() noexcept;
  void handle_force(const ForceCommand& command, std::int64_t received_ns) noexcept;
  void handle_control(const io::ControlCommand& control, std::int64_t received_ns) noexcept;
  template <class Command>
  bool refuse_old(const Command& command, std::int64_t received_ns) noexcept;
  io::Reason obey(const io::ControlCommand& control) noexcept;
  io::Reason reset() noexcept;
  io::Reason clear_senders(const std::array<char, kSenderSize>& target) noexcept;
  std::int64_t most_count(std::int32_t command) const noexcept;
  void answer(AckEntry entry) noexcept;

  const Plan& plan_;
  const LoopSettings settings_;
  Clock& clock_;
  InboundRing& inbound_;
  Output& output_;
  std::unique_ptr<io::NameTable> names_;  // own copy, because the copy in shared memory is not trusted
  std::array<std::int64_t, kNumMotionChannels> every_{};  // [ticks] interval between two publications; 0:
                                                          // off

  Motion motion_;
  VerdictThread* const verdicts_;
  CommandQueue command_queue_;
  Pacer pacer_;
  std::unique_ptr<InboundEntry> inbound_entry_;
  std::unique_ptr<AppliedEntry> applied_entry_;

  std::int64_t steps_left_ = 0;  // kForever after a RUN
  bool has_faulted_ = false;
  bool ran_before_fault_ = false;
  FaultNote fault_;
  std::int64_t applied_count_ = 0;
  FreeMotion free_;
  std::int64_t next_reoffer_ns_ = 0;
  std::atomic<bool> is_stopping_{false};
};

}  // namespace freeflex::service
