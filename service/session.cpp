#include "service/session.hpp"

#include <unistd.h>

#include <chrono>

namespace freeflex::service {

std::int64_t make_session() {
  constexpr std::int64_t kPidMask =
      (1 << 20) - 1;  // Linux keeps process ids below 2^22. Two sessions are equal only if the daemons start
                      // within about 1 ms and their ids agree in the low 20 bits
  const std::int64_t now_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(
                                  std::chrono::system_clock::now().time_since_epoch())
                                  .count();
  return (now_ns & ~kPidMask) | (getpid() & kPidMask);
}

}  // namespace freeflex::service
