// The sparse set-up: seconds and memory from a scene to its lowest modes, on masts and two-layer plates of
// springs.   bench_sparse [LARGEST]: sizes up to so many points, 10,000 unless said
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "core/structure/structure.hpp"
#include "tests/support/large_scenes.hpp"
#include "tests/support/structures.hpp"

namespace {

using namespace freeflex;

double peak_MB() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind("VmHWM:", 0) == 0) return std::strtod(line.c_str() + 6, nullptr) / 1024.0;
  return 0.0;
}

void run(const char* name, Scene scene, int count) {
  scene.publication = {};
  scene.pushable.clear();
  scene.loads.clear();
  scene.modes.count = count;
  // the peak from here on
  std::ofstream("/proc/self/clear_refs") << "5";
  const auto begin = std::chrono::steady_clock::now();
  Faults faults;
  const auto structure = build_structure_by(scene, SetupPath::kSparse, faults);
  const double spent = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (!structure) {
    std::printf("%-6s %7zu points: %s\n", name, scene.points.size(),
                faults.empty() ? "no structure" : faults.back().message.c_str());
    return;
  }
  std::printf(
      "%-6s %7zu points %7zu links %4ld modes %8.2f s %7.0f MB, lowest %.9g rad/s, stated accuracy %.0e\n",
      name, scene.points.size(), scene.links.size(), static_cast<long>(structure->omega.size()), spent,
      peak_MB(), structure->omega[0], structure->frequency_accuracy);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const long largest = argc > 1 ? std::strtol(argv[1], nullptr, 10) : 10000;
  const auto is_wanted = [&](long points) { return points <= largest; };
  run("mast", testing::square_truss(26), 100);
  run("mast", testing::square_truss(250), 100);
  if (is_wanted(10000)) run("mast", testing::square_truss(2500), 100);
  if (is_wanted(100000)) run("mast", testing::square_truss(25000), 300);
  run("plate", testing::two_layer_plate(22), 100);
  if (is_wanted(10000)) run("plate", testing::two_layer_plate(70), 100);
  if (is_wanted(100000)) run("plate", testing::two_layer_plate(223), 300);
}
