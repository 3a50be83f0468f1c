// Wall clock of the loop: deadlines, overruns, slips. Tests inject a clock of their own.
#pragma once

#include <time.h>

#include <cstdint>
#include <string>

namespace freeflex::service {

inline constexpr std::int64_t kSecond = 1'000'000'000;  // [ns]

/// [ns] CLOCK_BOOTTIME: goes on while the machine is suspended. The age of a command is measured by it.
inline std::int64_t boot_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_BOOTTIME, &now);
  return now.tv_sec * kSecond + now.tv_nsec;
}

/// Monotonic time. Used by the simulation thread only.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual std::int64_t now_ns() noexcept = 0;
  /// Goes on while the machine is suspended.
  virtual std::int64_t boot_ns() noexcept = 0;
  /// Returns at deadline_ns or, when that has passed, at once.
  virtual void sleep_until(std::int64_t deadline_ns) noexcept = 0;
};

/// CLOCK_MONOTONIC with absolute sleeps.
class MonotonicClock final : public Clock {
 public:
  std::int64_t now_ns() noexcept override;
  std::int64_t boot_ns() noexcept override { return service::boot_ns(); }
  void sleep_until(std::int64_t deadline_ns) noexcept override;
};

/// Deadlines of a paced loop. Tick n of a base stands at base + n * period; it is over in time when it ends
/// before the next stands. Every tick is executed: a late loop runs ticks back to back until it has caught
/// up. When it lags by more than kCatchUp it gives up the lost time, re-bases and counts a slip.
class Pacer {
 public:
  static constexpr std::int64_t kCatchUp = 200'000'000;  // [ns] lag beyond which catching up is hopeless

  /// \param period_ns [ns] wall time of a tick, > 0; need not be whole
  explicit Pacer(double period_ns) : period_ns_(period_ns) {}

  /// The next tick stands at now. Counts nothing: used at the start and after a hold.
  void rebase(std::int64_t now_ns) noexcept;
  /// [ns] when the next tick stands.
  std::int64_t deadline_ns() const noexcept;
  /// Whoever slept to deadline_ns() has woken.
  void wake(std::int64_t now_ns) noexcept;
  /// The tick that stood at deadline_ns() has ended.
  void finish_tick(std::int64_t now_ns) noexcept;

  std::int64_t num_overruns() const noexcept { return num_overruns_; }
  std::int64_t num_slips() const noexcept { return num_slips_; }
  /// [ns] Of the arrears of the latest slip, what came at one stroke: of a sleep, or of a tick. Small when
  /// every tick took a little too long.
  std::int64_t slip_gap_ns() const noexcept { return slip_gap_ns_; }

 private:
  double period_ns_;
  std::int64_t base_ns_ = 0;
  std::int64_t ticks_since_base_ = 0;
  std::int64_t num_overruns_ = 0;
  std::int64_t num_slips_ = 0;
  std::int64_t woken_ns_ = 0;  // 0: not noted
  std::int64_t ended_ns_ = 0;  // the last tick
  std::int64_t gap_ns_ = 0;    // the longest since the loop was last in time
  std::int64_t slip_gap_ns_ = 0;
};

/// What is said of a loop that slipped.  \param period  [s] simulated, of a tick
/// \param stood_ns  [ns] for which the whole process stood still; 0: it did not, the period is too short
std::string slip_text(double period, std::int64_t num_slips, std::int64_t stood_ns = 0);

}  // namespace freeflex::service
