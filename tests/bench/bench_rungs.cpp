// This program measures the cost of a tick of the 20-point truss on each rung of the fidelity ladder, and the
// cost of the live error budget.
#include <benchmark/benchmark.h>

#include <string>

#include "core/error/budget.hpp"
#include "core/error/judgement.hpp"
#include "core/plan/make_plan.hpp"
#include "core/structure/structure.hpp"
#include "service/io/scene/input.hpp"

namespace {

using namespace freeflex;

Scene truss(Fidelity rung) {
  Scene scene = *io::read_scene(FREEFLEX_SOURCE_DIR "/service/scenes/truss-s1.yaml").scene;
  scene.fidelity = rung;
  scene.rate = 1000.0;
  return scene;
}

Plan compiled(const Scene& scene) {
  Faults faults;
  const auto structure = build_structure(scene, faults);
  return *make_plan(scene, *structure, faults);
}

void tick(benchmark::State& bench) {
  const auto rung = static_cast<Fidelity>(bench.range(0));
  const Plan plan = compiled(truss(rung));
  State state = make_state(plan);
  Workspace workspace = make_workspace(plan);
  StepReport report;
  for (auto _ : bench) step(plan, state, {}, workspace, report);
  bench.SetLabel(name_of(rung));
  bench.counters["parts"] = plan.coupled.num_substeps;
}
BENCHMARK(tick)
    ->DenseRange(static_cast<int>(Fidelity::kRigid), static_cast<int>(Fidelity::kFull))
    ->ArgName("rung");

// Measures the time of a tick with the shadows of the error budget.
void tick_with_budget(benchmark::State& bench) {
  const auto rung = static_cast<Fidelity>(bench.range(0));
  Scene scene = truss(rung);
  scene.error_budget.horizon = 2.0;
  const Plan plan = compiled(scene);
  State state = make_state(plan);
  Workspace workspace = make_workspace(plan);
  Budget budget = make_budget(plan);
  StepReport report;
  for (auto _ : bench) step(plan, state, {}, workspace, budget, report);
  bench.SetLabel(name_of(rung));
}
BENCHMARK(tick_with_budget)
    ->DenseRange(static_cast<int>(Fidelity::kSeparated), static_cast<int>(Fidelity::kFull))
    ->ArgName("rung");

// Measures the cost of the verdict in a tick against the number of modes of the scene.
void judge(benchmark::State& bench) {
  const char* const names[] = {"truss-s1", "truss104", "truss-s3"};
  const char* const name = names[bench.range(0)];
  Faults faults;
  const Scene scene =
      *io::read_scene(std::string(FREEFLEX_SOURCE_DIR "/service/scenes/") + name + ".yaml").scene;
  const auto structure = build_structure(scene, faults);
  const Plan plan = *make_full_plan(scene, *structure, Fidelity::kSeparated, faults);
  State state = make_state(plan);
  Workspace workspace = make_workspace(plan);
  Judgement judgement(plan);
  Budget no_budget;
  StepReport report;
  step(plan, state, {}, workspace, report);
  for (auto _ : bench) judgement.take(state, no_budget);
  bench.SetLabel(std::string(name) + ", " + std::to_string(plan.num_elastic) + " modes");
}
BENCHMARK(judge)->DenseRange(0, 2)->ArgName("scene");

// Measures the time to read the error budget for the status.
void read_out_budget(benchmark::State& bench) {
  Scene scene = truss(Fidelity::kSeparated);
  scene.error_budget.horizon = 2.0;
  const Plan plan = compiled(scene);
  State state = make_state(plan);
  Budget budget = make_budget(plan);
  read_budget(plan, state, budget);  // the shadows start from the state
  for (auto _ : bench) benchmark::DoNotOptimize(read_budget(plan, state, budget));
}
BENCHMARK(read_out_budget);

}  // namespace
