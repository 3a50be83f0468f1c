// Measures the time of the complete step of truss S2 with one pushed point, divided by the time of the plain
// modal update with force. The two times are measured in alternating blocks of one run, because the speed of
// a machine drifts by more than their difference.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

#include "tests/bench/bare_update.hpp"
#include "tests/support/simulation.hpp"
#include "tests/support/structures.hpp"

namespace {

using namespace freeflex;

constexpr int kBlocks = 801;
// steps per block: they take about 0.5 ms, in which the speed of the machine hardly drifts
constexpr int kSteps = 500;

template <typename Work>
double ns_per_call(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  for (int k = 0; k < kSteps; ++k) work();
  const std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - start;
  return taken.count() / kSteps;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

BareModes bare_modes(const Plan& plan) {
  const auto n = static_cast<std::size_t>(plan.num_padded);
  const auto all = [&](auto coefficient) {
    Array values;
    for (const Propagator::Lanes& lanes : plan.propagator.lanes)
      values.insert(values.end(), (lanes.*coefficient).begin(), (lanes.*coefficient).end());
    return values;
  };
  using L = Propagator::Lanes;
  // the values need not describe a motion, because only the arithmetic is timed
  return {Array(n, 1e-3), Array(n, 1e-3), all(&L::c_qq), all(&L::c_qv), all(&L::c_vq),  all(&L::c_vv),
          all(&L::w_q0),  all(&L::w_q1),  all(&L::w_v0), all(&L::w_v1), Array(n, 1e-2), Array(n, 1e-2)};
}

}  // namespace

int main() {
  Scene scene = testing::square_truss(26);
  scene.publication.points.clear();
  scene.publication.links.clear();
  scene.pushable = {102};
  testing::Simulation simulation(scene);
  ForceCommand command = testing::make_command(0, 1);
  testing::add_force(command, 102, {0.48, 0.6, 0.64});
  simulation.run(1, {&command, 1});
  BareModes bare = bare_modes(simulation.plan);
  const auto n = static_cast<std::size_t>(simulation.plan.num_padded);
  std::vector<double> step_ns, bare_ns, wide_ns, ratios, wide_ratios;
  for (int k = 0; k < kBlocks; ++k) {
    const Inputs no_inputs{};
    step_ns.push_back(ns_per_call([&] {
      step(simulation.plan, simulation.state, no_inputs, simulation.workspace, simulation.report);
    }));
    bare_ns.push_back(ns_per_call([&] { bare_update(bare, n); }));
    wide_ns.push_back(ns_per_call([&] { bare_update_wide(bare, n); }));
    ratios.push_back(step_ns.back() / bare_ns.back());
    wide_ratios.push_back(step_ns.back() / wide_ns.back());
  }
  const double modes = simulation.plan.num_elastic;
  std::printf("truss S2, %d modes, one pushed point, nothing published; medians of %d interleaved blocks\n",
              simulation.plan.num_elastic, kBlocks);
  const auto print_time = [modes](const char* what, const std::vector<double>& ns) {
    std::printf("  %-46s %8.1f ns  %6.3f ns/mode\n", what, median(ns), median(ns) / modes);
  };
  print_time("bare modal update with force, baseline build", bare_ns);
  print_time("the same at the width the step chooses", wide_ns);
  print_time("state step", step_ns);
  std::printf("  %-46s %8.2f\n", "ratio to the baseline build", median(ratios));
  std::printf("  %-46s %8.2f\n", "ratio at equal width", median(wide_ratios));
  // the results are used, so that the compiler keeps their computation
  return simulation.state.tick > 0 && bare.q[0] == bare.q[0] ? 0 : 1;
}
