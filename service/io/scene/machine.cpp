#include "service/io/scene/machine.hpp"

#include <malloc.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <system_error>
#include <thread>

#include "core/limits.hpp"

namespace freeflex::io {
namespace {

// returns the memory [MB] that a limit leaves besides the memory in use, or `otherwise` if that is less or
// there is no limit
double left_of(__rlimit_resource resource, double taken_MB, double otherwise) {
  rlimit limit{};
  if (getrlimit(resource, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return otherwise;
  constexpr double kBuffer = 1e-6 * static_cast<double>(kBlasBuffer);
  // at least 1e-3 MB, because 0 would mean that the memory is unknown
  return std::clamp(1e-6 * static_cast<double>(limit.rlim_cur) - taken_MB - kBuffer, 1e-3, otherwise);
}

}  // namespace

double machine_memory_MB() {
  const double page_MB = 1e-6 * static_cast<double>(sysconf(_SC_PAGE_SIZE));
  double memory = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * page_MB;
  // six numbers of pages: total, resident, shared, text, libraries, data with stack (proc(5))
  double pages[6] = {};
  std::ifstream taken("/proc/self/statm");
  for (double& each : pages) taken >> each;
  memory = left_of(RLIMIT_AS, pages[0] * page_MB, memory);
  return left_of(RLIMIT_DATA, pages[5] * page_MB, memory);
}

void keep_freed_memory() {
  constexpr int kAll = 1 << 30;  // [B] no array of a set-up is larger by much
  mallopt(M_MMAP_THRESHOLD, kAll);
  mallopt(M_TRIM_THRESHOLD, kAll);
}

void share_on_two_threads(int count, const std::function<void(int)>& work) {
  std::atomic<int> next{0};
  const auto run = [&] {
    for (int k = next++; k < count; k = next++) work(k);
  };
  std::thread other;
  if (count > 1 && std::thread::hardware_concurrency() > 1) {
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    try {
      other = std::thread(run);
    } catch (const std::system_error&) {  // no more threads are allowed
    }
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
  }
  run();
  if (other.joinable()) other.join();
}

}  // namespace freeflex::io
