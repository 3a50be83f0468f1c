// Measures the time of a tick on the rung `coupled` for several numbers of modes and points, once with sums
// over points and once with tables over pairs of modes (THEORY 12.52). Both take about the same time if the
// number of tables times the number of modes is kTablesPerPoint (core/plan/rungs/kinetics.hpp) times the
// number of points.
#include <benchmark/benchmark.h>

#include <map>
#include <numeric>
#include <string>

#include "core/plan/compile.hpp"
#include "core/plan/rungs/kinetics.hpp"
#include "core/step/step.hpp"
#include "core/structure/structure.hpp"

namespace {

using namespace freeflex;

// Returns a row of box-shaped cells, in which springs join every two points of a cell.
Scene lattice(int num_points) {
  Scene scene;
  const int length = num_points / 4;
  for (int k = 0; k < num_points; ++k) {
    PointMass point;
    point.name = std::to_string(k);
    point.mass = 1.0 + 0.01 * (k % 7);
    point.position = {1.0 * (k / 4), 1.0 * (k % 2), 1.0 * (k / 2 % 2)};
    scene.points.push_back(point);
  }
  const auto join = [&](int a, int b) {
    Link link;
    link.name = std::to_string(scene.links.size());
    link.points = {a, b};
    link.kind = Spring{1e4};
    scene.links.push_back(link);
  };
  for (int cell = 0; cell < length; ++cell)
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) {
        if (a < b) join(4 * cell + a, 4 * cell + b);
        if (cell + 1 < length) join(4 * cell + a, 4 * cell + 4 + b);
      }
  scene.initial.angular_velocity = {0.1, 0.2, 0.3};
  scene.publication.points = {0};
  scene.rate = 1000.0;
  return scene;
}

const Structure& structure_of(int num_points) {
  static std::map<int, Structure> all;
  if (!all.contains(num_points)) {
    Faults faults;
    all.emplace(num_points, *build_structure(lattice(num_points), faults));
  }
  return all.at(num_points);
}

void tick(benchmark::State& bench) {
  const auto num_points = static_cast<int>(bench.range(0)), num_modes = static_cast<int>(bench.range(1));
  const auto form = static_cast<PlanKinetics::Form>(bench.range(2));
  const Scene scene = lattice(num_points);
  const Structure& structure = structure_of(num_points);
  PlanSpec spec = full_spec(scene, structure, Fidelity::kCoupled);
  spec.modes.resize(static_cast<std::size_t>(num_modes));
  std::iota(spec.modes.begin(), spec.modes.end(), 0);
  Faults faults;
  Plan plan = *compile(scene, structure, spec, faults);
  Structure few = structure;
  few.shapes = structure.shapes.leftCols(num_modes);
  plan.coupled.kinetics = {};
  compile_kinetics(scene, few, few.shapes, form, plan);
  State state = make_state(plan);
  Workspace workspace = make_workspace(plan);
  StepReport report;
  for (auto _ : bench) step(plan, state, {}, workspace, report);
  bench.SetLabel(form == PlanKinetics::Form::kPoints ? "points" : "tables");
}
BENCHMARK(tick)
    ->ArgsProduct({{20}, {8, 16, 32, 48}, {1, 2}})
    ->ArgsProduct({{100}, {8, 48, 96, 144, 240}, {1, 2}})
    ->ArgsProduct({{300}, {8, 48, 144, 288, 480}, {1, 2}})
    ->ArgNames({"points", "modes", "form"})
    ->Unit(benchmark::kMicrosecond)
    ->MinTime(0.1);

}  // namespace
