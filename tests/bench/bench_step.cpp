// This program measures the cost of a tick and of reading a point against the number of modes. The modes and
// mode-shape rows are invented, because the cost depends only on their number.
#include <benchmark/benchmark.h>

#include "core/plan/make_plan.hpp"
#include "core/step/readout.hpp"
#include "tests/step/hand_plan.hpp"

namespace {

using namespace freeflex;

constexpr double kPeriod = 1e-3;

StepPlan make_plan(std::int64_t num_modes, int num_points = 8) {
  std::vector<testing::Mode> modes;
  for (std::int64_t l = 0; l < num_modes; ++l) {
    const double omega = 10.0 + 2.0 * static_cast<double>(l);
    modes.push_back({omega, 0.01 * omega, 1e-3 / omega, 0.0});
  }
  return testing::hand_plan(kPeriod, modes, num_points);
}

ForceCommand push_points(int num_points, std::int32_t axes) {
  ForceCommand command = testing::hand_command("bench", 0, axes);
  for (int k = 0; k < num_points; ++k) testing::add_force(command, k, {0.48e-3, 0.6e-3, 0.64e-3});
  return command;
}

// Reports the number of modes that are advanced or read per second.
void report_modes(benchmark::State& state) { state.SetItemsProcessed(state.iterations() * state.range(0)); }

// Measures a step under forces on num_points points, in world axes (0) or body axes (1). World forces on one
// point are projected directly, and those on five points by a table.
void step_under(benchmark::State& state, int num_points, std::int32_t axes) {
  const StepPlan plan = make_plan(state.range(0));
  testing::HandRun run(plan);
  const ForceCommand command = push_points(num_points, axes);
  run.step_once({&command, 1});
  for (auto _ : state) benchmark::DoNotOptimize(run.step_once());
  report_modes(state);
}
void all_modes(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgName("modes");
  for (const std::int64_t num_modes : {6, 54, 300, 306, 738, 1494, 2994}) benchmark->Arg(num_modes);
}
BENCHMARK_CAPTURE(step_under, no_load, 0, 0)->Apply(all_modes);
BENCHMARK_CAPTURE(step_under, one_world_point, 1, 0)->Apply(all_modes);
BENCHMARK_CAPTURE(step_under, five_world_points, 5, 0)->Apply(all_modes);
BENCHMARK_CAPTURE(step_under, one_body_point, 1, 1)->Apply(all_modes);

// Steps a body without modes that tumbles by the given angle per tick.
void tumble(benchmark::State& state) {
  StepPlan plan = testing::hand_plan(kPeriod, {});
  const double spin = 1e-3 * static_cast<double>(state.range(0)) / kPeriod;
  plan.initial.w_B = {0.36 * spin, 0.48 * spin, 0.8 * spin};
  testing::HandRun run(plan);
  for (auto _ : state) benchmark::DoNotOptimize(run.step_once());
}
BENCHMARK(tumble)->ArgName("mrad")->Arg(1)->Arg(10)->Arg(30)->Arg(100)->Arg(300)->Arg(1000)->Arg(3000)->Arg(
    30000);

// Measures a step at which a command takes effect, so that slots, load pattern and table are computed again.
void step_with_command(benchmark::State& state) {
  const StepPlan plan = make_plan(state.range(0));
  testing::HandRun run(plan);
  const ForceCommand command = push_points(5, 0);
  for (auto _ : state) benchmark::DoNotOptimize(run.step_once({&command, 1}));
  report_modes(state);
}
BENCHMARK(step_with_command)->Apply(all_modes);

// Reads position, velocity and acceleration of 64 points, one after another.
void read_out_point(benchmark::State& state) {
  constexpr int kPoints = 64;
  const StepPlan plan = make_plan(state.range(0), kPoints);
  testing::HandRun run(plan);
  run.step_once();
  int point = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(read_point(plan, run.state, point));
    point = (point + 1) % kPoints;
  }
  report_modes(state);
}
BENCHMARK(read_out_point)->Apply(all_modes);

void read_out_invariants(benchmark::State& state) {
  const StepPlan plan = make_plan(state.range(0));
  testing::HandRun run(plan);
  run.step_once();
  for (auto _ : state) benchmark::DoNotOptimize(read_invariants(plan, run.state));
  report_modes(state);
}
BENCHMARK(read_out_invariants)->Apply(all_modes);

}  // namespace
