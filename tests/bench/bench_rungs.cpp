// This program measures the cost of a tick of the 20-point truss on each rung of the fidelity ladder, and the
// cost of the verdict.
#include <benchmark/benchmark.h>

#include <string>

#include "core/error/judgement.hpp"
#include "core/motion.hpp"
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

// Measures the time of a tick with the verdict, in step with the motion.
void tick_with_verdict(benchmark::State& bench) {
  const auto rung = static_cast<Fidelity>(bench.range(0));
  const Plan plan = compiled(truss(rung));
  Motion motion(plan);
  for (auto _ : bench) benchmark::DoNotOptimize(motion.advance().status);
  bench.SetLabel(name_of(rung));
}
BENCHMARK(tick_with_verdict)
    ->DenseRange(static_cast<int>(Fidelity::kRigid), static_cast<int>(Fidelity::kFull))
    ->ArgName("rung");

// Measures the cost of the verdict in a tick, as the mean over the steps of the shadow, against the number of
// modes of the scene.
void judge(benchmark::State& bench) {
  const char* const names[] = {"truss-s1", "truss104", "truss-s3"};
  const char* const name = names[bench.range(0)];
  Faults faults;
  const Scene scene =
      *io::read_scene(std::string(FREEFLEX_SOURCE_DIR "/service/scenes/") + name + ".yaml").scene;
  const auto structure = build_structure(scene, faults);
  const Plan plan = *make_plan(scene, *structure, faults);
  State state = make_state(plan);
  Workspace workspace = make_workspace(plan);
  Judgement judgement(plan);
  StepReport report;
  judgement.take(state);
  step(plan, state, {}, workspace, report);
  for (auto _ : bench) {
    judgement.take(state);
    ++state.tick;
  }
  bench.SetLabel(std::string(name) + ", " + std::to_string(plan.num_elastic) + " modes");
}
BENCHMARK(judge)->DenseRange(0, 2)->ArgName("scene");

}  // namespace
