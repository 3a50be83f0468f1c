#include "service/io/scene/machine.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "core/limits.hpp"

namespace freeflex::io {
namespace {

extern "C" void openblas_set_num_threads(int count) __attribute__((weak));

// [MB] that a limit leaves beside what is taken
double left_of(__rlimit_resource resource, double taken_MB, double otherwise) {
  rlimit limit{};
  if (getrlimit(resource, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return otherwise;
  const double buffer = openblas_set_num_threads == nullptr ? 0.0 : 1e-6 * kBlasBuffer;
  // not 0, which is: not known
  return std::clamp(1e-6 * static_cast<double>(limit.rlim_cur) - taken_MB - buffer, 1e-3, otherwise);
}

}  // namespace

double machine_memory_MB() {
  const double page_MB = 1e-6 * static_cast<double>(sysconf(_SC_PAGE_SIZE));
  double memory = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * page_MB;
  // pages: all, resident, shared, text, libraries, data and stack   (proc(5))
  double pages[6] = {};
  std::ifstream taken("/proc/self/statm");
  for (double& each : pages) taken >> each;
  memory = left_of(RLIMIT_AS, pages[0] * page_MB, memory);
  return left_of(RLIMIT_DATA, pages[5] * page_MB, memory);
}

void start_without_blas_threads(char** argv) {
  constexpr const char* kThreads = "OPENBLAS_NUM_THREADS";
  const char* const threads = std::getenv(kThreads);
  if (openblas_set_num_threads == nullptr || (threads != nullptr && std::strcmp(threads, "1") == 0)) return;
  if (setenv(kThreads, "1", 1) == 0) execv("/proc/self/exe", argv);
}

}  // namespace freeflex::io
