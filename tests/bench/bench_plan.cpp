// Measures the time per step that a plan saves by omitting a feature. Two plans of one scene, one that keeps
// the feature and one that omits it, are stepped in alternating blocks of steps. The figures are medians over
// the blocks. The ratio of the two times is formed within each pair of blocks. The times that `freeflex plan`
// predicts are printed next to them.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <vector>

#include "tests/support/omissions.hpp"
#include "tests/support/structures.hpp"
#include "tools/verification/report/step_cost.hpp"

namespace {

using namespace freeflex;

// steps per block: they take about 0.1 ms, in which the speed of the machine hardly drifts
constexpr int kSteps = 200;
constexpr int kBlocks = 600;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double ns_per_step(testing::Simulation& simulation) {
  const auto start = std::chrono::steady_clock::now();
  simulation.run(kSteps);
  return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count() / kSteps;
}

void compare(benchmark::State& state, Scene scene, Feature feature) {
  testing::Simulation without(testing::reduced_plan_of(scene));
  if (!testing::feature_of(without.plan, feature).is_left_out)
    return state.SkipWithError("the feature is not omitted");
  scene.leave_out.keeps[static_cast<std::size_t>(feature)] = true;
  testing::Simulation with(testing::reduced_plan_of(scene));
  std::vector<double> with_ns, without_ns, ratios;
  for (auto _ : state) {
    with_ns.push_back(ns_per_step(with));
    without_ns.push_back(ns_per_step(without));
    ratios.push_back(without_ns.back() / with_ns.back());
    state.SetIterationTime(without_ns.back() * kSteps * 1e-9);
  }
  const auto bytes = [](const Plan& plan) { return static_cast<double>(plan.rows.size() * sizeof(double)); };
  state.counters["modes"] = with.plan.num_elastic;
  state.counters["modes_left"] = without.plan.num_elastic;
  state.counters["kept_ns"] = median(with_ns);
  state.counters["left_out_ns"] = median(without_ns);
  state.counters["ratio"] = median(ratios);
  state.counters["predicted_kept_ns"] = tools::predict_step(with.plan).step();
  state.counters["predicted_ns"] = tools::predict_step(without.plan).step();
  state.counters["rows_kB"] = bytes(with.plan) / 1024.0;
  state.counters["rows_left_kB"] = bytes(without.plan) / 1024.0;
}

/// Returns truss S2, which has 306 modes, without pushable points and published links.
Scene quiet_truss() {
  Scene scene = testing::square_truss(26);
  scene.pushable.clear();
  scene.publication.links.clear();
  return scene;
}

Load steady(int point, const Eigen::Vector3d& force, Axes axes) {
  Load load;
  load.name = std::to_string(point);
  load.axes = axes;
  load.forces = {{point, force}};
  return load;
}

/// Returns beams along a line (width 0) or a zigzag in the xy plane.
Scene frame_of_beams(int num_points, double width) {
  Scene scene;
  scene.name = "beams";
  for (int i = 0; i < num_points; ++i) {
    PointMass point;
    point.name = std::to_string(i);
    point.mass = 1.0;
    point.position = {i - 0.5 * (num_points - 1), width * (i % 2), 0.0};
    scene.points.push_back(point);
    if (i == 0) continue;
    Link link;
    link.name = std::to_string(i);
    link.points = {i - 1, i};
    link.kind = Beam{.EA = 1e6, .GJ = 1e3, .EI_y = 1e3, .EI_z = 1e3, .y_axis = Eigen::Vector3d::UnitZ()};
    scene.links.push_back(link);
  }
  testing::publish_everything(scene);
  scene.publication.links.clear();
  scene.pushable.clear();
  return scene;
}

void damping(benchmark::State& state) {
  Scene scene = quiet_truss();
  scene.loads = {steady(102, {0.48, 0.6, 0.64}, Axes::kBody)};
  compare(state, scene, Feature::kDamping);
}
void gravity(benchmark::State& state) {
  Scene scene = testing::spring_pair(1.0, 2.0, 1.0, 1e4);
  scene.pushable.clear();
  scene.loads = {steady(0, {1.0, 0.0, 0.0}, Axes::kWorld)};
  compare(state, scene, Feature::kGravity);
}
void rotation(benchmark::State& state) {
  Scene scene = quiet_truss();
  scene.loads = {steady(0, {1.0, 0.0, 0.0}, Axes::kWorld)};
  scene.loads.front().forces.push_back({100, {-1.0, 0.0, 0.0}});
  compare(state, scene, Feature::kRotation);
}
void out_of_plane(benchmark::State& state) {
  Scene scene = frame_of_beams(102, 0.5);
  scene.loads = {steady(101, {1.0, 2.0, 0.0}, Axes::kWorld)};
  compare(state, scene, Feature::kOutOfPlane);
}
void unreached_modes(benchmark::State& state) {
  Scene scene = frame_of_beams(101, 0.0);
  scene.loads = {steady(50, {1.0, 0.0, 0.0}, Axes::kBody)};
  compare(state, scene, Feature::kUnreachedModes);
}
void small_modes(benchmark::State& state) {
  Scene scene = quiet_truss();
  testing::add_corner_pulse(scene);
  scene.leave_out.tolerance = 1e-2;
  scene.leave_out.horizon = 2.0;
  compare(state, scene, Feature::kSmallModes);
}
void point_rows(benchmark::State& state) {
  Scene scene = quiet_truss();
  testing::add_corner_pulse(scene);
  scene.publication.points = {102};
  compare(state, scene, Feature::kPointRows);
}

void blocks(benchmark::internal::Benchmark* benchmark) {
  benchmark->UseManualTime()->Iterations(kBlocks)->Unit(benchmark::kMicrosecond);
}
BENCHMARK(damping)->Apply(blocks);
BENCHMARK(gravity)->Apply(blocks);
BENCHMARK(rotation)->Apply(blocks);
BENCHMARK(out_of_plane)->Apply(blocks);
BENCHMARK(unreached_modes)->Apply(blocks);
BENCHMARK(small_modes)->Apply(blocks);
BENCHMARK(point_rows)->Apply(blocks);

}  // namespace
