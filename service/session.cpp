#include "service/session.hpp"

#include <unistd.h>

#include <chrono>

namespace freeflex::service {

std::int64_t make_session() {
  constexpr std::int64_t kPidMask =
      (1 << 20) - 1;  // low 20 bits of process ids, which Linux keeps below 2^22. Two sessions are equal only
                      // if both daemons start in the same ms
  const std::int64_t now_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(
                                  std::chrono::system_clock::now().time_since_epoch())
                                  .count();
  return (now_ns & ~kPidMask) | (getpid() & kPidMask);
}

}  // namespace freeflex::service
