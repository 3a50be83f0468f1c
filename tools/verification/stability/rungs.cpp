// Tests every rung of the fidelity ladder at steps around omega h = k pi of its stiffest mode. At these
// steps, schemes that apply impulses resonate.
#include "core/plan/rungs/rungs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tools/verification/reference/elastic_error.hpp"
#include "tools/verification/stability/ride.hpp"
#include "tools/verification/stability/scenes.hpp"

namespace freeflex::tools {
namespace {

constexpr Solver kProbe{Fidelity::kSeparated, IntegrateBy::kModes, "separated"};
constexpr Solver kFullOnModes{Fidelity::kFull, IntegrateBy::kModes, "full"};
constexpr Solver kFullOnPoints{Fidelity::kFull, IntegrateBy::kPoints, "full, points"};

/// Returns a truss that rotates under a steady force. Some of its links are 1e8 times as stiff as the others.
Scene rotating_truss(const Solver& solver) {
  Scene scene = stiff_truss(1e8, 1.0);
  for (Link& link : scene.links) std::get<Spring>(link.kind).stiffness *= 10.0;
  scene.initial.angular_velocity = {0.02, -0.03, 0.05};
  use(solver, scene);
  add_force(scene, 9, {0.0, 0.1, 0.2});
  return scene;
}

/// Returns the positions after `ticks` steps of `step` [s]. If there is no result, sets `why` to the reason
/// and returns nullopt.
std::optional<Eigen::Matrix3Xd> run_at(const Solver& solver, double step, std::int64_t ticks,
                                       std::string& why) {
  Scene scene = rotating_truss(solver);
  scene.rate = 1.0 / step;
  Ride ride(scene);
  if (!ride.has_plan() || !ride.run(ticks)) {
    why = format_text("h = %.6g ms: ", 1e3 * step) +
          (ride.has_plan() ? "a state is not finite" : ride.faults_text());
    return std::nullopt;
  }
  return ride.positions_W();
}

struct Shape {
  Eigen::VectorXd mass;
  Eigen::Matrix3Xd rest;
  explicit Shape(const Scene& scene)
      : mass(static_cast<Eigen::Index>(scene.points.size())),
        rest(3, static_cast<Eigen::Index>(scene.points.size())) {
    for (Eigen::Index i = 0; i < mass.size(); ++i) {
      mass[i] = scene.points[index(i)].mass;
      rest.col(i) = scene.points[index(i)].position;
    }
  }
  double difference(const Eigen::Matrix3Xd& p, const Eigen::Matrix3Xd& q) const {
    return elastic_error(elastic_displacements(mass, rest, p), elastic_displacements(mass, rest, q));
  }
};

Outcome across_pi(const Solver& solver, const StabilityOptions& options) {
  const Ride probe(rotating_truss(kProbe));
  if (!probe.has_plan()) return no_answer(probe.faults_text());
  const double top = probe.plan.omega[index(probe.plan.num_elastic) - 1];
  // the rung `corotational` refuses omega h above 1000, so all rungs take k pi at steps near 0.4 ms
  const double k0 = std::floor(0.4e-3 * top / std::numbers::pi);
  const std::int64_t ticks = options.is_quick ? 100 : 500;
  const Shape shape(rotating_truss(solver));
  Outcome outcome;
  outcome.measured = 0.0;
  double at = 0.0;
  for (const double k : {1.0, 2.0, 3.0, 10.0, k0 - 1.0, k0 - 0.5, k0, k0 + 0.5, k0 + 1.0})
    for (const double off : {0.0, 1e-9, -1e-3, 1e-3}) {
      if (options.is_stopped()) return no_answer("interrupted");
      const double step = k * std::numbers::pi / top * (1.0 + off);
      const auto once = run_at(solver, step, ticks, outcome.message),
                 half = run_at(solver, 0.5 * step, 2 * ticks, outcome.message);
      if (!once || !half) return no_answer(outcome.message);
      const double error = solver.rung == Fidelity::kRigid ? (*once - *half).norm() / half->norm()
                                                           : shape.difference(*once, *half);
      if (!(error <= outcome.measured)) {
        outcome.measured = error;
        at = k * (1.0 + off);
      }
    }
  outcome.message = format_text("36 steps, omega h of %.3g to %.4g; worst at %.6g pi", std::numbers::pi,
                                (k0 + 1.0) * std::numbers::pi, at);
  // compares other methods, at one of these steps, with our rung `corotational` at an eighth of that step
  if (solver.name != kOnModes.name || !options.has_peers) return outcome;
  const double step = k0 * std::numbers::pi / top;
  std::string why;
  const auto best = run_at(solver, 0.125 * step, 8 * ticks, why);
  if (!best) return outcome;
  outcome.peers = run_peers(rotating_truss(solver), step, step * static_cast<double>(ticks), options,
                            [&](const CartesianState& state) { return shape.difference(state.p_W, *best); });
  return outcome;
}

/// Compares the rung `full` with the rung `corotational` on modes whose step is half a substep of `full`. The
/// rung `full` halves its substeps until they are short enough, so at different steps their lengths differ by
/// less than a factor of two.
Outcome full_across_pi(const Solver& solver, const StabilityOptions& options) {
  const Ride probe(rotating_truss(kProbe));
  if (!probe.has_plan()) return no_answer(probe.faults_text());
  const double top = probe.plan.omega[index(probe.plan.num_elastic) - 1];
  const Shape shape(rotating_truss(solver));
  constexpr std::int64_t kTicks = 50;
  const double most = options.is_quick ? 100.0 : 200.0;
  Outcome outcome;
  outcome.measured = 0.0;
  for (const double k : {10.0, 30.0, most})
    for (const double off : {0.0, 1e-9, 1e-3}) {
      if (options.is_stopped()) return no_answer("interrupted");
      const double phase = k * std::numbers::pi * (1.0 + off);
      std::int64_t substeps = 1;
      while (phase > kFullPhase * static_cast<double>(substeps)) substeps *= 2;
      const double step = phase / top;
      const auto divided = run_at(solver, step, kTicks, outcome.message),
                 fine = run_at(kOnModes, 0.5 * step / static_cast<double>(substeps), 2 * substeps * kTicks,
                               outcome.message);
      if (!divided || !fine) return no_answer(outcome.message);
      outcome.measured = std::max(outcome.measured, shape.difference(*divided, *fine));
    }
  outcome.message = format_text(
      "9 steps, omega h of 31.4 to %.3g; 0 means smaller than the rounding error of "
      "positions",
      most * std::numbers::pi);
  return outcome;
}

}  // namespace

void add_rung_cases(std::vector<StabilityCase>& cases) {
  struct Row {
    Solver solver;
    const char* quantity;
    double limit;
  };
  constexpr const char* kGroup = "steps across omega h = k pi";
  constexpr const char* kElastic = "largest elastic difference from half the step";
  for (const Row& row : {Row{{Fidelity::kRigid, IntegrateBy::kModes, "rigid"},
                             "largest position difference from half the step",
                             1e-12},
                         Row{kProbe, kElastic, 1e-5},
                         Row{{Fidelity::kSpinLoaded, IntegrateBy::kModes, "spin-loaded"}, kElastic, 1e-5},
                         Row{{Fidelity::kCoupled, IntegrateBy::kModes, "coupled"}, kElastic, 1e-5},
                         Row{kOnModes, kElastic, 1e-2}, Row{kOnPoints, kElastic, 1e-2}})
    cases.push_back(
        {kGroup, row.solver.name, row.quantity, row.limit, false,
         [solver = row.solver](const StabilityOptions& options) { return across_pi(solver, options); }});
  // On points the fastest vibration is off by 1e-8 after 1000 rad, so by 3.2e-7 of its amplitude after the
  // 31,400 rad of the longest motion. The displacement at the end may be a third of the amplitude
  for (const auto& [solver, limit] : {std::pair{kFullOnModes, 1e-8}, {kFullOnPoints, 1e-6}})
    cases.push_back(
        {kGroup, solver.name, "largest elastic difference from half the substep on modes", limit, false,
         [solver = solver](const StabilityOptions& options) { return full_across_pi(solver, options); }});
}

}  // namespace freeflex::tools
