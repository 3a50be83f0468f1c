#include "core/structure/solver_library.hpp"

#include <dlfcn.h>

#include <cstdlib>

#include "core/scene/faults.hpp"

namespace freeflex {
namespace {

SolverLibrary load() {
  constexpr int kKeep = 0;  // what the user has set
  setenv("OPENBLAS_NUM_THREADS", "1", kKeep);
  setenv("SCOTCH_PTHREAD_NUMBER", "1", kKeep);
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
    setenv("OPENBLAS_CORETYPE", "Haswell", kKeep);
#endif
  SolverLibrary library;
  void* const handle = dlopen(FREEFLEX_MUMPS_FILE, RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) {
    library.problem = join_text("the solver of large structures cannot be loaded (", dlerror(),
                                "): install MUMPS, on Debian 12 the package libmumps-seq-5.5");
    return library;
  }
  library.mumps = reinterpret_cast<decltype(library.mumps)>(dlsym(handle, "dmumps_c"));
  library.dgemm = reinterpret_cast<decltype(library.dgemm)>(dlsym(handle, "dgemm_"));
  library.dtrsm = reinterpret_cast<decltype(library.dtrsm)>(dlsym(handle, "dtrsm_"));
  library.reset_random =
      reinterpret_cast<decltype(library.reset_random)>(dlsym(handle, "SCOTCH_randomReset"));
  if (library.mumps == nullptr || library.dgemm == nullptr || library.dtrsm == nullptr)
    library.problem = FREEFLEX_MUMPS_FILE " has no dmumps_c or no BLAS: install MUMPS again";
  return library;
}

}  // namespace

const SolverLibrary& solver_library() {
  static const SolverLibrary library = load();
  return library;
}

}  // namespace freeflex
