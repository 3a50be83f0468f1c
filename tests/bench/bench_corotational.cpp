// This program measures the cost of a tick on the rung `corotational`, on a frame of 20 points and 40 beams
// (54 modes) and on a line of 100 beams (298 modes). Each is measured with short ticks, with ticks that are
// so long that stiff modes are filtered (THEORY 12.82), and with damping of true strains (THEORY 12.114).
#include <benchmark/benchmark.h>

#include <algorithm>
#include <string>

#include "core/plan/make_plan.hpp"
#include "core/step/step.hpp"
#include "core/structure/structure.hpp"
#include "tests/reference/random.hpp"
#include "tests/setup/make_scene.hpp"

namespace {

using namespace freeflex;
using Eigen::Vector3d;
using freeflex::testing::add_link;
using freeflex::testing::add_point;
using freeflex::testing::Random;

// A lattice of 5 x 2 x 2 points, all a little off their places: its 36 edges and four diagonals.
Scene frame() {
  Random random(1);
  Scene scene;
  const auto number = [](int x, int y, int z) { return x + 5 * (y + 2 * z); };
  for (int i = 0; i < 20; ++i)
    add_point(
        scene, 1.0 + 0.3 * random.one(),
        Vector3d(i % 5, i / 5 % 2, i / 10) + 0.1 * random.vector());  // NOLINT(bugprone-integer-division)
  const Beam beam{2e5, 300.0, 200.0, 400.0, {0.3, 0.2, 0.9}};
  for (int y = 0; y < 2; ++y)
    for (int z = 0; z < 2; ++z)
      for (int x = 0; x < 4; ++x) add_link(scene, number(x, y, z), number(x + 1, y, z), beam);
  for (int x = 0; x < 5; ++x) {
    for (int z = 0; z < 2; ++z) add_link(scene, number(x, 0, z), number(x, 1, z), beam);
    for (int y = 0; y < 2; ++y) add_link(scene, number(x, y, 0), number(x, y, 1), beam);
  }
  for (int x = 0; x < 4; ++x) add_link(scene, number(x, 0, x % 2), number(x + 1, 1, 1 - x % 2), beam);
  return scene;
}

Scene line() {
  Scene scene;
  for (int i = 0; i < 101; ++i) add_point(scene, 0.25, {0.1 * i, 0.0, 0.0});
  for (int i = 0; i < 100; ++i) add_link(scene, i, i + 1, Beam{6.4e5, 560.0, 750.0, 750.0, {0.0, 1.0, 0.0}});
  return scene;
}

// The lowest modes move by some `kick` of the size, and the fastest mode advances by `phase` [rad] in a tick.
void set_in_motion(Scene& scene, double phase, double kick) {
  scene.fidelity = Fidelity::kCorotational;
  Faults faults;
  const Structure structure = *build_structure(scene, faults);
  Eigen::Index first = 0;
  while (structure.omega[first] == 0.0) ++first;
  const double lowest = structure.omega[first];
  scene.rate = structure.omega.maxCoeff() / phase;
  scene.initial.angular_velocity = 0.1 * std::min(lowest, 20.0) * Vector3d(0.3, -0.5, 0.7);
  const auto count = static_cast<Eigen::Index>(scene.points.size());
  Eigen::VectorXd V = Eigen::VectorXd::Zero(3 * count);
  Random random(2);
  for (Eigen::Index l = first; l < std::min(first + 6, structure.omega.size()); ++l)
    V += random.one() * lowest / structure.omega[l] * structure.shapes.col(l).head(3 * count);
  const double size = structure.mass_properties.r.colwise().norm().maxCoeff();
  V *= kick * size * std::sqrt(static_cast<double>(count)) / V.norm();
  for (Eigen::Index i = 0; i < count; ++i)
    scene.initial.points.push_back({static_cast<int>(i), Vector3d::Zero(), lowest * V.segment<3>(3 * i)});
}

// Runs 400 ticks from the start of the motion, again and again.
void run(benchmark::State& bench, Scene scene, double damping) {
  const double phase = static_cast<double>(bench.range(0)) / 10.0,
               kick = 1e-4 * static_cast<double>(bench.range(1));
  if (damping > 0.0) scene.damping.modal_ratio = damping;
  set_in_motion(scene, phase, kick);
  Faults faults;
  const auto structure = build_structure(scene, faults);
  const Plan plan = *make_full_plan(scene, *structure, Fidelity::kCorotational, faults);
  State state = make_state(plan);
  Workspace workspace = make_workspace(plan);
  StepReport report;
  constexpr int kTicks = 400;
  for (auto _ : bench) {
    reset_state(plan, state);
    for (int k = 0; k < kTicks; ++k) step(plan, state, {}, workspace, report);
    if (report.status != StepStatus::kOk) bench.SkipWithError("the step failed");
  }
  bench.SetLabel(std::to_string(plan.num_elastic) + " modes" +
                 (plan.coupled.curve.is_filtered ? ", filtered" : "") +
                 (plan.coupled.damps_true_strains ? ", strains damped" : ""));
  bench.counters["tick"] =
      benchmark::Counter(kTicks, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void tick_of_frame(benchmark::State& bench) { run(bench, frame(), 0.0); }
void tick_of_damped_frame(benchmark::State& bench) { run(bench, frame(), 0.005); }
void tick_of_line(benchmark::State& bench) { run(bench, line(), 0.0); }
// phase of the fastest mode in a tick [0.1 rad], kick over the size [1e-4]
BENCHMARK(tick_of_frame)
    ->ArgNames({"phase", "kick"})
    ->Args({15, 10})
    ->Args({60, 10})
    ->Args({15, 100})
    ->Args({60, 100});
BENCHMARK(tick_of_damped_frame)->ArgNames({"phase", "kick"})->Args({15, 10});
BENCHMARK(tick_of_line)->ArgNames({"phase", "kick"})->Args({15, 10})->Args({60, 10});

}  // namespace
