// This program measures the cost of the set-up, which consists of the seconds from a scene to a plan, the
// peak memory, and the size of the plan.
#include <benchmark/benchmark.h>
#include <malloc.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <string>

#include "core/plan/file/plan_bytes.hpp"
#include "core/plan/make_plan.hpp"
#include "core/structure/structure.hpp"
#include "service/io/scene/input.hpp"
#include "tests/support/structures.hpp"

namespace {

using namespace freeflex;

/// Returns the value of a line of /proc/self/status in kB, or 0 if the line is missing.
double status_kB(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind(key + ":", 0) == 0) return std::strtod(line.c_str() + key.size() + 1, nullptr);
  }
  return 0.0;
}

/// Gives freed memory back to the system, because reusing this memory would not raise the peak. Then resets
/// the peak to the present resident size.
void reset_peak() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
}

void set_up(benchmark::State& state, const Scene& scene) {
  double peak_kB = 0.0;
  std::size_t bytes = 0;
  Eigen::Index modes = 0;
  for (auto _ : state) {
    state.PauseTiming();
    reset_peak();
    const double before_kB = status_kB("VmRSS");
    state.ResumeTiming();
    Faults faults;
    const auto structure = build_structure(scene, faults);
    const auto plan = structure ? make_full_plan(scene, *structure, scene.fidelity, faults) : std::nullopt;
    if (!plan) {
      state.SkipWithError("no plan");
      return;
    }
    state.PauseTiming();
    peak_kB = std::max(peak_kB, status_kB("VmHWM") - before_kB);
    bytes = plan_to_bytes(*plan).size();
    modes = structure->omega.size();
    state.ResumeTiming();
  }
  state.counters["points"] = static_cast<double>(scene.points.size());
  state.counters["modes"] = static_cast<double>(modes);
  state.counters["peak_MB"] = peak_kB / 1024.0;
  state.counters["plan_MB"] = static_cast<double>(bytes) / (1024.0 * 1024.0);
}

void truss(benchmark::State& state) {
  set_up(state, testing::square_truss(static_cast<int>(state.range(0))));
}
// the structures have 20, 104 and 248 points, and all points are published
BENCHMARK(truss)->ArgName("sections")->Arg(5)->Arg(26)->Arg(62)->Unit(benchmark::kMillisecond);

void rotor(benchmark::State& state) {
  const io::SceneResult result = io::read_scene(FREEFLEX_SOURCE_DIR "/service/scenes/rotor.yaml");
  if (!result.scene) {
    state.SkipWithError("rotor.yaml has faults");
    return;
  }
  set_up(state, *result.scene);
}
BENCHMARK(rotor)->Unit(benchmark::kMillisecond);

}  // namespace
