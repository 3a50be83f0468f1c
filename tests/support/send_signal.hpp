// Sends a signal to one process. Header only.
#pragma once

#include <signal.h>
#include <sys/types.h>

namespace freeflex::testing {

/// Sends a signal to a process. Returns false if `pid` is at most 1 or there is no such process. A pid of -1,
/// which callers use for "no process", must not reach kill(), because for kill() it means every process of
/// the machine.
inline bool send_signal(pid_t pid, int number) { return pid > 1 && kill(pid, number) == 0; }

}  // namespace freeflex::testing
