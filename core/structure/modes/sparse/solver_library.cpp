#include "core/structure/modes/sparse/solver_library.hpp"

#include <dlfcn.h>

#include <cstdlib>
#include <string>

#include "core/faults.hpp"

namespace freeflex {
namespace {

// Returns whether a message of the loader is about lack of memory. The loader gives no error number, so the
// message is compared with texts of glibc 2.36.
bool is_of_memory(const std::string& why) {
  for (const char* const word : {"map segment", "map zero-fill", "allocate", "out of memory"})
    if (why.find(word) != std::string::npos) return true;
  return false;
}

SolverLibrary load() {
  constexpr int kKeep = 0;  // keeps values set by the user
  setenv("OPENBLAS_NUM_THREADS", "1", kKeep);
  setenv("SCOTCH_PTHREAD_NUMBER", "1", kKeep);
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
    setenv("OPENBLAS_CORETYPE", "Haswell", kKeep);
#endif
  SolverLibrary library;
  void* const handle = dlopen(FREEFLEX_MUMPS_FILE, RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) {
    const std::string why = dlerror();
    const std::string what = join_text("the solver of large structures cannot be loaded (", why, ")");
    library.problem =
        is_of_memory(why)
            ? join_text("memory ran out, so ", what, kMoreMemory)
            : join_text(what, "; install MUMPS, which is the package libmumps-seq-5.5 on Debian 12");
    return library;
  }
  library.mumps = reinterpret_cast<decltype(library.mumps)>(dlsym(handle, "dmumps_c"));
  library.dgemm = reinterpret_cast<decltype(library.dgemm)>(dlsym(handle, "dgemm_"));
  library.dtrsm = reinterpret_cast<decltype(library.dtrsm)>(dlsym(handle, "dtrsm_"));
  library.reset_random =
      reinterpret_cast<decltype(library.reset_random)>(dlsym(handle, "SCOTCH_randomReset"));
  if (library.mumps == nullptr || library.dgemm == nullptr || library.dtrsm == nullptr)
    library.problem = FREEFLEX_MUMPS_FILE " has no dmumps_c or no BLAS; install MUMPS again";
  return library;
}

}  // namespace

const SolverLibrary& solver_library() {
  static const SolverLibrary library = load();
  return library;
}

}  // namespace freeflex
