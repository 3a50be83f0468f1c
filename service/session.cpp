#include "service/session.hpp"

#include <unistd.h>

#include <chrono>

namespace freeflex::service {

std::int64_t make_session() {
  constexpr std::int64_t kPidMask =
      (1 << 20) - 1;  // Linux numbers processes below 2^22; a collision needs the same ms
  const std::int64_t now_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(
                                  std::chrono::system_clock::now().time_since_epoch())
                                  .count();
  return (now_ns & ~kPidMask) | (getpid() & kPidMask);
}

}  // namespace freeflex::service
