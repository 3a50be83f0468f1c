#include "service/clock.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <ctime>

namespace freeflex::service {

std::int64_t MonotonicClock::now_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kSecond + now.tv_nsec;
}

void MonotonicClock::sleep_until(std::int64_t deadline_ns) noexcept {
  const timespec deadline{deadline_ns / kSecond, deadline_ns % kSecond};
  // the deadline is absolute, so after a signal the sleep continues to the same deadline
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr) == EINTR) {
  }
}

void Pacer::rebase(std::int64_t now_ns) noexcept {
  base_ns_ = now_ns;
  ticks_since_base_ = 0;
}

std::int64_t Pacer::deadline_ns() const noexcept {
  // each deadline is computed from the base, so a period that is not a whole number of nanoseconds causes no
  // drift
  return base_ns_ + std::llround(static_cast<double>(ticks_since_base_) * period_ns_);
}

void Pacer::wake(std::int64_t now_ns) noexcept {
  gap_ns_ = std::max(gap_ns_, now_ns - std::max(deadline_ns(), ended_ns_));
  woken_ns_ = now_ns;
}

void Pacer::finish_tick(std::int64_t now_ns) noexcept {
  ++ticks_since_base_;
  const std::int64_t lag = now_ns - deadline_ns();
  if (woken_ns_ != 0) gap_ns_ = std::max(gap_ns_, now_ns - woken_ns_);
  ended_ns_ = now_ns;
  if (lag > 0) {
    ++num_overruns_;
  } else {
    gap_ns_ = 0;
  }
  if (lag > kCatchUp) {
    ++num_slips_;
    slip_gap_ns_ = gap_ns_;
    gap_ns_ = 0;
    rebase(now_ns);
  }
}

std::string slip_text(double period, std::int64_t num_slips, std::int64_t stood_ns) {
  char text[320];
  if (stood_ns > 0) {
    std::snprintf(text, sizeof text,
                  "the process did not run for %.1f s (it was suspended by a signal, a debugger or the "
                  "machine), so the loop skips the lost time (slips so far: %lld)",
                  1e-9 * static_cast<double>(stood_ns), static_cast<long long>(num_slips));
    return text;
  }
  std::snprintf(
      text, sizeof text,
      "this machine does not hold the period of %.6g us, so the loop fell behind by more than %lld ms and "
      "skips the lost time (slips so far: %lld); use a lower --rate, a cheaper rung, fewer modes or "
      "points, or --time scaled=K",
      1e6 * period, static_cast<long long>(Pacer::kCatchUp / 1'000'000), static_cast<long long>(num_slips));
  return text;
}

}  // namespace freeflex::service
