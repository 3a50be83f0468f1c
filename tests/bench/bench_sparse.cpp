// Measures the time and the memory of the sparse set-up from a scene to its lowest modes, for masts and
// two-layer plates of springs. Other libraries compute the modes of the same structures for comparison.
//   bench_sparse [LARGEST]: sizes up to LARGEST points, 10,000 by default
//   bench_sparse mast|plate POINTS MODES: one structure, alone in its process
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <string>

#include "core/structure/structure.hpp"
#include "service/io/scene/machine.hpp"
#include "tests/support/large_scenes.hpp"
#include "tests/support/structures.hpp"
#ifdef FREEFLEX_MODAL_RIVALS
#include "tests/bench/modal_rivals.hpp"
#endif

namespace {

using namespace freeflex;

double peak_MB() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind("VmHWM:", 0) == 0) return std::strtod(line.c_str() + 6, nullptr) / 1024.0;
  return 0.0;
}

// Prints the times of the other libraries (rivals), and the relative differences of their frequencies from
// ours.
void print_rivals([[maybe_unused]] const Scene& scene, [[maybe_unused]] const Structure& ours) {
#ifdef FREEFLEX_MODAL_RIVALS
  const auto count = static_cast<int>(ours.omega.size());
  // the shift is as near to the lowest eigenvalues as that of our solver, because an expert would also choose
  // it so for the other libraries
  const double shift = ours.omega[std::min(count - 1, 5)] * ours.omega[std::min(count - 1, 5)];
  for (const testing::RivalModes& rival : testing::run_modal_rivals(scene, count, shift)) {
    if (!rival.problem.empty()) {
      std::printf("       %-8s %s\n", rival.name.c_str(), rival.problem.c_str());
      continue;
    }
    const Eigen::Index size = std::min<Eigen::Index>(count, rival.omega.size());
    const Eigen::ArrayXd off = rival.omega.head(size).array() / ours.omega.head(size).array() - 1.0;
    std::printf("       %-8s %8.2f s, frequencies off by %.1e at most, the lowest by %.1e\n",
                rival.name.c_str(), rival.seconds, off.abs().maxCoeff(), std::abs(off[0]));
  }
  std::fflush(stdout);
#else
  std::printf("       built without Spectra, ARPACK and CHOLMOD: no comparison\n");
#endif
}

bool run(const std::string& name, Scene scene, int count) {
  scene.publication = {};
  scene.pushable.clear();
  scene.loads.clear();
  scene.modes.count = count;
  // this resets the peak of memory
  std::ofstream("/proc/self/clear_refs") << "5";
  const std::clock_t cpu_begin = std::clock();
  const auto begin = std::chrono::steady_clock::now();
  Faults faults;
  const auto structure =
      build_structure_by(scene, SetupPath::kSparse, faults, {{}, 0.0, io::share_on_two_threads});
  const double cpu = static_cast<double>(std::clock() - cpu_begin) / CLOCKS_PER_SEC;
  const double spent = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (!structure) {
    std::printf("%-6s %7zu points: %s\n", name.c_str(), scene.points.size(),
                faults.empty() ? "no structure" : faults.back().message.c_str());
    return false;
  }
  std::printf(
      "%-6s %7zu points %7zu links %4ld modes %8.2f s (processor %.2f s) %7.0f MB, lowest %.9g rad/s, stated "
      "accuracy %.0e\n",
      name.c_str(), scene.points.size(), scene.links.size(), static_cast<long>(structure->omega.size()),
      spent, cpu, peak_MB(), structure->omega[0], structure->frequency_accuracy);
  std::fflush(stdout);
  print_rivals(scene, *structure);
  return true;
}

Scene make(const std::string& name, long points) {
  if (name == "mast") return testing::square_truss(static_cast<int>(points / 4));
  return testing::two_layer_plate(
      static_cast<int>(std::lround(std::sqrt(static_cast<double>(points) / 2.0))));
}

}  // namespace

int main(int argc, char** argv) {
  // set the BLAS kernels before the program is loaded again, so that ARPACK, CHOLMOD and our solver use the
  // same kernels
  if (setenv("OPENBLAS_CORETYPE", "Haswell", 0) == 0 && std::getenv("FREEFLEX_BENCH_AGAIN") == nullptr) {
    setenv("FREEFLEX_BENCH_AGAIN", "1", 1);
    setenv("OPENBLAS_NUM_THREADS", "1", 1);
    execv("/proc/self/exe", argv);
  }
  io::keep_freed_memory();
  if (argc == 4)
    return run(argv[1], make(argv[1], std::strtol(argv[2], nullptr, 10)), std::atoi(argv[3])) ? 0 : 1;
  const long largest = argc > 1 ? std::strtol(argv[1], nullptr, 10) : 10000;
  bool is_good = true;
  for (const char* name : {"mast", "plate"})
    for (const long points : {104L, 1000L, 10000L, 100000L})
      if (points <= largest) is_good = run(name, make(name, points), points == 100000 ? 300 : 100) && is_good;
  return is_good ? 0 : 1;
}
