// What the machine gives a set-up.
#pragma once

namespace freeflex::io {

/// [MB] for SetupProgress: what the machine has, or less where limits of this process leave less (`ulimit
/// -v`, `ulimit -d`) beside what it has taken and the BLAS will take.
double machine_memory_MB();

}  // namespace freeflex::io
