#include "service/realtime.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>

#include <cerrno>
#include <cfenv>
#include <cstring>
#include <limits>

namespace freeflex::service {

namespace {
constexpr int kPriority = 80;  // above threaded interrupts (50), below the kernel's own threads (99)
}

std::string lock_memory() {
  if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return {};
  return fmt::format(
      "memory is not locked ({}), so a page fault may delay a tick; allow it with 'ulimit -l unlimited' or "
      "'setcap cap_ipc_lock,cap_sys_nice+ep freeflexd'",
      std::strerror(errno));
}

std::string raise_priority() {
  // by default the kernel may wake ordinary threads 50 us late, so the slack is set to 1 ns
  prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
  const sched_param parameters{.sched_priority = kPriority};
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  if (error == 0) return {};
  return fmt::format(
      "SCHED_FIFO is refused ({}), so other programs may delay ticks; allow it with 'ulimit -r {}' "
      "(limits.conf: rtprio) or 'setcap cap_ipc_lock,cap_sys_nice+ep freeflexd'",
      std::strerror(error), kPriority);
}

bool has_default_arithmetic() {
  volatile double smallest_normal = std::numeric_limits<double>::min();
  volatile double denormal = smallest_normal / 4.0;  // zero if results are flushed to zero
  volatile double back = denormal * 4.0;             // zero if operands are flushed to zero
  return std::fegetround() == FE_TONEAREST && back == smallest_normal;
}

}  // namespace freeflex::service
