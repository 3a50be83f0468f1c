// MUMPS and its BLAS, loaded on the first set-up of a large structure.
#pragma once

#include <string>

namespace freeflex {

/// Functions of the solver. The library is loaded on demand, because neither a daemon that runs a plan nor
/// its network process needs it.
struct SolverLibrary {
  void (*mumps)() = nullptr;  // dmumps_c; its header has the signature
  void (*dgemm)(const char*, const char*, const int*, const int*, const int*, const double*, const double*,
                const int*, const double*, const int*, const double*, double*, const int*) = nullptr;
  void (*dtrsm)(const char*, const char*, const char*, const char*, const int*, const int*, const double*,
                const double*, const int*, double*, const int*) = nullptr;
  void (*reset_random)() = nullptr;  // function of SCOTCH; without this call an ordering depends on earlier
                                     // orderings
  std::string problem;               // reason why the library is not loaded; empty: it is loaded
};

/// Returns the library. Every call returns the same object. Each set-up of a scene must give equal bits on
/// every processor with AVX2. Therefore SCOTCH uses one thread (its ordering is random with more threads),
/// and OpenBLAS uses its AVX2 kernels (it would use its slowest kernels on processors newer than itself) and
/// one thread (its threads wait by spinning). The variables SCOTCH_PTHREAD_NUMBER, OPENBLAS_NUM_THREADS and
/// OPENBLAS_CORETYPE are not changed if they are set.
const SolverLibrary& solver_library();

}  // namespace freeflex
