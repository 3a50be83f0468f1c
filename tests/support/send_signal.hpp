// A signal to one process. Header only.
#pragma once

#include <signal.h>
#include <sys/types.h>

namespace freeflex::testing {

/// False when there is no such process. kill() by itself takes -1, which here means that there is none, for
/// every process of the machine.
inline bool send_signal(pid_t pid, int number) { return pid > 1 && kill(pid, number) == 0; }

}  // namespace freeflex::testing
