// The clock of the loop, and a pacer that computes deadlines and counts overruns and slips. Tests use a
// simulated clock instead.
#pragma once

#include <time.h>

#include <cstdint>
#include <string>

namespace freeflex::service {

inline constexpr std::int64_t kSecond = 1'000'000'000;  // [ns]

/// Returns CLOCK_BOOTTIME [ns], which continues while the machine is suspended. Ages of commands are measured
/// with this clock.
inline std::int64_t boot_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_BOOTTIME, &now);
  return now.tv_sec * kSecond + now.tv_nsec;
}

/// A monotonic clock and its sleep. Each thread has its own object.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual std::int64_t now_ns() noexcept = 0;
  /// Returns a time [ns] that continues while the machine is suspended.
  virtual std::int64_t boot_ns() noexcept = 0;
  /// Sleeps until deadline_ns, or returns at once if that time has passed.
  virtual void sleep_until(std::int64_t deadline_ns) noexcept = 0;
};

/// CLOCK_MONOTONIC with absolute sleeps.
class MonotonicClock final : public Clock {
 public:
  std::int64_t now_ns() noexcept override;
  std::int64_t boot_ns() noexcept override { return service::boot_ns(); }
  void sleep_until(std::int64_t deadline_ns) noexcept override;
};

/// Deadlines of a paced loop. Tick n after a base is due at base + n * period. A tick is in time if it ends
/// before the next tick is due. Every tick is executed, so a late loop runs ticks without sleeping until the
/// loop has caught up. If the loop is late by more than kCatchUp, the loop gives up the lost time, takes the
/// present time as the new base and counts a slip.
class Pacer {
 public:
  static constexpr std::int64_t kCatchUp = 200'000'000;  // [ns] largest delay that is caught up

  /// \param period_ns [ns] wall time of a tick, > 0; need not be a whole number
  explicit Pacer(double period_ns) : period_ns_(period_ns) {}

  /// Makes the next tick due now. The loop calls this function at the start and after a hold. Counts no slip.
  void rebase(std::int64_t now_ns) noexcept;
  /// Returns the time at which the next tick is due [ns].
  std::int64_t deadline_ns() const noexcept;
  /// Records that the sleep to deadline_ns() has ended.
  void wake(std::int64_t now_ns) noexcept;
  /// Records that the tick that was due at deadline_ns() has ended.
  void finish_tick(std::int64_t now_ns) noexcept;

  std::int64_t num_overruns() const noexcept { return num_overruns_; }
  std::int64_t num_slips() const noexcept { return num_slips_; }
  /// Returns the longest delay of a single sleep or tick that contributed to the latest slip [ns]. The value
  /// is small if the slip came from many ticks that each took a little too long.
  std::int64_t slip_gap_ns() const noexcept { return slip_gap_ns_; }

 private:
  double period_ns_;
  std::int64_t base_ns_ = 0;
  std::int64_t ticks_since_base_ = 0;
  std::int64_t num_overruns_ = 0;
  std::int64_t num_slips_ = 0;
  std::int64_t woken_ns_ = 0;  // 0: not yet recorded
  std::int64_t ended_ns_ = 0;  // end of the last tick
  std::int64_t gap_ns_ = 0;    // the longest delay since the loop was last in time
  std::int64_t slip_gap_ns_ = 0;
};

/// Returns the log text for a slip.  \param period  [s] simulated time of a tick
/// \param stood_ns  [ns] time for which the whole process stood still; 0: it did not stand still, so the
///   period is too short
std::string slip_text(double period, std::int64_t num_slips, std::int64_t stood_ns = 0);

}  // namespace freeflex::service
