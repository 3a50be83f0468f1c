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
  void (*dtrsm)(const char*, const char*, const char*, const char*, const int*, const int*, const double*,
                const double*, const int*, double*, const int*) = nullptr;
  void (*reset_random)() = nullptr;  // of SCOTCH, whose orders otherwise go by what it has ordered before
  std::string problem;               // why there is none; empty: it is there
};

/// The same at each call. So that the same scene has the same bits each time, and on every processor with
/// AVX2, SCOTCH is told to take one thread, for with more its order is by chance, and an OpenBLAS one thread,
/// for its threads wait by spinning, and the kernels of AVX2: on processors newer than itself it takes its
/// slowest. SCOTCH_PTHREAD_NUMBER, OPENBLAS_NUM_THREADS and OPENBLAS_CORETYPE that are set stay as they are.
const SolverLibrary& solver_library();

}  // namespace freeflex
