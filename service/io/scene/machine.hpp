// Memory available for a set-up.
#pragma once

namespace freeflex::io {

/// Returns the memory for SetupProgress [MB]: the machine's memory, or less if limits of this process
/// (`ulimit -v`, `ulimit -d`) leave less in addition to the memory that the process and the BLAS use already.
double machine_memory_MB();

}  // namespace freeflex::io
