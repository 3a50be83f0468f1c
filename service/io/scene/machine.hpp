// Memory and processors for a set-up.
#pragma once

#include <functional>

namespace freeflex::io {

/// Returns the memory [MB] that a set-up may use (SetupProgress): the memory of the machine, or, if that is
/// less, the memory that the limits of this process (`ulimit -v`, `ulimit -d`) leave besides the memory in
/// use and a buffer of the BLAS.
double machine_memory_MB();

/// Calls work(k) for k from 0 to count - 1 on two threads, if the machine has two processors and allows
/// another thread (SetupProgress::share). The second thread takes no signals.
void share_on_two_threads(int count, const std::function<void(int)>& work);

/// Makes this process keep the memory that it frees. malloc_trim(0) gives the memory back to the system. The
/// set-up of a large structure allocates and frees arrays of megabytes thousands of times, and memory that is
/// new to the process costs page faults: 15 of 102 s for a mast of 100,000 points. The peak memory of
/// that set-up rises by 11 %.
void keep_freed_memory();

}  // namespace freeflex::io
