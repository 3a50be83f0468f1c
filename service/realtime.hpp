// What a thread asks of the kernel to be on time, and what it means when that is refused.
#pragma once

#include <string>
#include <vector>

namespace freeflex::service {

/// Keeps the process in memory. Empty, or one line: what was refused, what it means, how to allow it.
std::string lock_memory();

/// Runs the calling thread before all ordinary ones (SCHED_FIFO) with exact timers. As lock_memory().
std::string raise_priority();

/// True when this thread computes as IEEE 754 has it by default: round to nearest, denormals kept. The bits
/// of a run depend on it, and a library built with -ffast-math changes it for the whole process.
bool has_default_arithmetic();

}  // namespace freeflex::service
