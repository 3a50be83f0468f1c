// This program measures the cost of a tick of 306 modes, from C++ and through the C interface with 1 or 1000
// ticks per call.
#include <benchmark/benchmark.h>

#include <memory>
#include <optional>
#include <string>

#include "core/step/step.hpp"
#include "service/c/freeflex.h"
#include "service/io/scene/input.hpp"

namespace {

using namespace freeflex;

const std::string kScene = std::string(FREEFLEX_SOURCE_DIR) + "/service/scenes/truss104.yaml";

void from_cpp(benchmark::State& state) {
  const std::optional<Plan> plan = io::load_plan(kScene).plan;
  State motion = make_state(*plan);
  Workspace workspace = make_workspace(*plan);
  StepReport report;
  for (auto _ : state) {
    step(*plan, motion, Inputs{}, workspace, report);
    benchmark::DoNotOptimize(motion.q.data());
  }
}
BENCHMARK(from_cpp)->Repetitions(5);

void from_c(benchmark::State& state) {
  freeflex_plan* plan = nullptr;
  freeflex_motion* motion = nullptr;
  if (freeflex_plan_open(kScene.c_str(), nullptr, nullptr, &plan) != FREEFLEX_OK ||
      freeflex_motion_new(plan, 0, &motion) != FREEFLEX_OK)
    return state.SkipWithError(freeflex_last_error());
  const auto ticks = state.range(0);
  for (auto _ : state) benchmark::DoNotOptimize(freeflex_motion_step(motion, ticks));
  state.SetItemsProcessed(state.iterations() * ticks);
  freeflex_motion_free(motion);
  freeflex_plan_free(plan);
}
BENCHMARK(from_c)->ArgName("ticks")->Arg(1)->Arg(1000)->Repetitions(5);

}  // namespace
