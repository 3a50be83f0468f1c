// Sends a signal to one process. Header only.
#pragma once

#include <signal.h>
#include <sys/types.h>

namespace freeflex::testing {

/// Sends a signal to a process. Returns false if there is no such process. Here -1 means "no process", but
/// for kill() it means every process of the machine.
inline bool send_signal(pid_t pid, int number) { return pid > 1 && kill(pid, number) == 0; }

}  // namespace freeflex::testing
