// Requests timely execution from the kernel. Returns log texts if the kernel refuses.
#pragma once

#include <string>
#include <vector>

namespace freeflex::service {

/// Locks the process in memory. Returns an empty string, or one line that says what was refused, the
/// consequence and the remedy.
std::string lock_memory();

/// Gives the calling thread priority over all ordinary threads (SCHED_FIFO), and exact timers. Returns an
/// empty string or one line, as lock_memory() does.
std::string raise_priority();

/// Returns true if this thread uses the default arithmetic of IEEE 754, which rounds results to nearest and
/// keeps denormals. The bits of a run depend on this setting, and a library built with -ffast-math changes it
/// for the whole process.
bool has_default_arithmetic();

}  // namespace freeflex::service
