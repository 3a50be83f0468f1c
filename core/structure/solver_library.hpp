// MUMPS and the BLAS under it, loaded where the first large structure is set up and nowhere else.
#pragma once

#include <string>

namespace freeflex {

/// A daemon that runs a plan, and the process that reads the network for it, have no use for a solver: so it
/// is no dependency of the program but loaded when it is asked for.
struct SolverLibrary {
  void (*mumps)() = nullptr;  // dmumps_c, to be called as its header declares it
  void (*dgemm)(const char*, const char*, const int*, const int*, const int*, const double*, const double*,
                const int*, const double*, const int*, const double*, double*, const int*) = nullptr;
  std::string problem;  // why there is none; empty: it is there
};

/// The same at each call. An OpenBLAS is told to take one thread, for its threads wait by spinning, and the
/// kernels of a processor with AVX2 where there is one: it takes its slowest on processors that are newer
/// than itself, and with the same kernels everywhere the modes have the same bits. OPENBLAS_NUM_THREADS and
/// OPENBLAS_CORETYPE that are set stay as they are.
const SolverLibrary& solver_library();

}  // namespace freeflex
