#include "service/clock.hpp"

#include <cerrno>
#include <cmath>
#include <ctime>

namespace freeflex::service {

namespace {
constexpr std::int64_t kSecond = 1'000'000'000;  // [ns]
}

std::int64_t MonotonicClock::now_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kSecond + now.tv_nsec;
}

void MonotonicClock::sleep_until(std::int64_t deadline_ns) noexcept {
  const timespec deadline{deadline_ns / kSecond, deadline_ns % kSecond};
  // an absolute deadline survives a signal: sleep again to the same one
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr) == EINTR) {
  }
}

void Pacer::rebase(std::int64_t now_ns) noexcept {
  base_ns_ = now_ns;
  ticks_since_base_ = 0;
}

std::int64_t Pacer::deadline_ns() const noexcept {
  // from the base each time: a period that is no whole number of nanoseconds does not drift
  return base_ns_ + std::llround(static_cast<double>(ticks_since_base_) * period_ns_);
}

void Pacer::finish_tick(std::int64_t now_ns) noexcept {
  ++ticks_since_base_;
  const std::int64_t lag = now_ns - deadline_ns();
  if (lag > 0) ++num_overruns_;
  if (lag > kCatchUp) {
    ++num_slips_;
    rebase(now_ns);
  }
}

}  // namespace freeflex::service
