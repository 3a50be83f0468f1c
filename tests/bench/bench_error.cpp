// Elastic error at 2 s against CPU time, for the separated step and for the full Cartesian system.
//   bench_error [--all]   --all adds S4, whose reference takes a minute
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>

#include "core/reference/elastic_error.hpp"
#include "core/reference/integrate.hpp"
#include "tests/support/simulation.hpp"
#include "tests/support/structures.hpp"

namespace {

using namespace freeflex;

constexpr double kEnd = 2.0;  // [s]

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

struct Case {
  const char* name;
  Scene scene;
  CartesianSystem system;
  Eigen::Matrix3Xd u_ref;
};

void print_row(const Case& item, const char* method, double error, double cpu) {
  std::printf("%-3s %-44s %10.2e %14.2e\n", item.name, method, error, cpu / kEnd);
  std::fflush(stdout);
}

Eigen::Matrix3Xd displacements(const Case& item, const Eigen::Matrix3Xd& p_W) {
  return elastic_displacements(item.system.mass, item.system.r, p_W);
}

/// The step at `rate` [Hz]; set-up is not counted. Repeated until it can be timed.
void separated(const Case& item, double rate, bool reads_every_point) {
  constexpr double kEnough = 0.2;  // [s]
  Scene scene = item.scene;
  scene.rate = rate;
  testing::Simulation simulation(scene);
  const auto ticks = std::llround(kEnd * rate);
  int repeats = 0;
  double checksum = 0.0;
  const double start = cpu_seconds();
  do {
    reset_state(simulation.plan, simulation.state);
    for (std::int64_t k = 0; k < ticks; ++k) {
      simulation.run(1);
      if (reads_every_point) checksum += simulation.positions_W()(0, 0);
    }
    ++repeats;
  } while (cpu_seconds() - start < kEnough);
  const double cpu = (cpu_seconds() - start) / repeats;
  char method[64];
  std::snprintf(method, sizeof method, "separated step, h = %g ms%s", 1e3 / rate,
                reads_every_point ? ", every point out" : "");
  const double error = elastic_error(displacements(item, simulation.positions_W()), item.u_ref);
  print_row(item, method, std::isfinite(checksum) ? error : NAN, cpu);
}

bool integrate_once(const Case& item, const ReferenceOptions& options, Eigen::Matrix3Xd& u, double& cpu) {
  const double times[] = {kEnd};
  const double start = cpu_seconds();
  const ReferenceRun run = integrate(item.system, times, options);
  cpu = cpu_seconds() - start;
  if (!run.error.empty()) {
    std::printf("%-3s %s\n", item.name, run.error.c_str());
    return false;
  }
  u = displacements(item, run.states[0].p_W);
  return true;
}

void reference(const Case& item, const ReferenceOptions& options) {
  char method[64];
  const char* name = options.method == ReferenceMethod::kAdams        ? "full system, Adams"
                     : options.method == ReferenceMethod::kFehlberg78 ? "full system, Fehlberg 8"
                                                                      : "full system, classical order 4";
  if (options.fixed_step > 0.0) {
    std::snprintf(method, sizeof method, "%s, h = %g us", name, 1e6 * options.fixed_step);
  } else {
    std::snprintf(method, sizeof method, "%s, tolerance %.0e", name, options.tolerance);
  }
  Eigen::Matrix3Xd u;
  double cpu = 0.0;
  if (integrate_once(item, options, u, cpu)) print_row(item, method, elastic_error(u, item.u_ref), cpu);
}

ReferenceOptions adaptive(ReferenceMethod method, double tolerance, const ElasticScale& scale) {
  ReferenceOptions options;
  options.method = method;
  options.tolerance = tolerance;
  options.scale = scale;
  return options;
}

ReferenceOptions fixed(ReferenceMethod method, double step) {
  ReferenceOptions options;
  options.method = method;
  options.fixed_step = step;
  return options;
}

void separated_rows(const Case& item) {
  separated(item, 100.0, false);
  separated(item, 1000.0, false);
  separated(item, 1000.0, true);
}

bool make_case(const char* name, const Scene& scene, const ReferenceOptions& truth, Case& item) {
  std::string error;
  const auto system = make_cartesian_system(scene, error);
  if (!system) {
    std::printf("%s: %s\n", name, error.c_str());
    return false;
  }
  item = {name, scene, *system, {}};
  double cpu = 0.0;
  return integrate_once(item, truth, item.u_ref, cpu);
}

bool soft_case(const char* name, const Scene& scene) {
  ReferenceOptions truth;
  truth.tolerance = 1e-11;
  Case item;
  if (!make_case(name, scene, truth, item)) return false;
  separated_rows(item);
  // the scale once, so that the pilot run that finds it is not in every row
  const double times[] = {kEnd};
  const ElasticScale scale = integrate(item.system, times, {}).scale;
  for (const double tolerance : {1e-4, 1e-6, 1e-8}) {
    reference(item, adaptive(ReferenceMethod::kFehlberg78, tolerance, scale));
  }
  for (const double tolerance : {1e-6, 1e-8, 1e-10}) {
    reference(item, adaptive(ReferenceMethod::kAdams, tolerance, scale));
  }
  for (const double step : {1e-3, 2.5e-4, 1e-4}) reference(item, fixed(ReferenceMethod::kRungeKutta4, step));
  return true;
}

bool stiff_case() {
  Case item;
  if (!make_case("S4", testing::truss_s4(), fixed(ReferenceMethod::kRungeKutta4, 1e-6), item)) return false;
  separated_rows(item);
  reference(item, fixed(ReferenceMethod::kRungeKutta4, 4e-6));
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  const bool has_all = argc > 1 && std::strcmp(argv[1], "--all") == 0;
  std::printf("    %-44s %10s %14s\n", "method", "error", "CPU s per s");
  bool ok = soft_case("S1", testing::truss_s1()) && soft_case("S2", testing::truss_s2());
  if (ok && has_all) ok = stiff_case();
  return ok ? 0 : 1;
}
