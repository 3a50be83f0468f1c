// Memory available for a set-up.
#pragma once

namespace freeflex::io {

/// Returns the memory [MB] that a set-up may use (SetupProgress): the memory of the machine, or, if that is
/// less, the memory that the limits of this process (`ulimit -v`, `ulimit -d`) leave besides the memory in
/// use and a buffer of the BLAS.
double machine_memory_MB();

}  // namespace freeflex::io
