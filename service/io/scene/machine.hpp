// What the machine gives a set-up, and how a program that makes one is started.
#pragma once

namespace freeflex::io {

/// [MB] for SetupProgress: what the machine has, or less where limits of this process leave less (`ulimit
/// -v`, `ulimit -d`) beside what it has taken and the BLAS will take.
double machine_memory_MB();

/// First in main: starts the program again where an OpenBLAS would start threads of its own. It does so when
/// it is loaded, nothing here uses them, and each asks for 128 MB of address space, without end where a limit
/// refuses them. Comes back otherwise, and where it cannot.
void start_without_blas_threads(char** argv);

}  // namespace freeflex::io
