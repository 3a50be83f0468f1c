#include "tools/verification/reference/integrate.hpp"

#include <algorithm>
#include <cmath>

#include "tools/verification/reference/elastic_error.hpp"
#include "tools/verification/reference/sundials_solver.hpp"

namespace freeflex {
namespace {

/// Returns a low estimate of the elastic scale without computing a motion: the loads or centrifugal forces
/// divided by the stiffness of the stiffest link, and the initial displacements. If the estimate is too
/// small, the pilot run only takes more steps.
ElasticScale guess_scale(const CartesianSystem& system) {
  constexpr double kSmallestStrain = 1e-12;  // [-] smallest displacement as a fraction of the size
  double force = 0.0;
  for (const CartesianLoad& load : system.loads) {
    for (const PointLoad& item : load.forces) force += item.force.norm();
  }
  double size = 0.0;
  for (Eigen::Index i = 0; i < system.mass.size(); ++i) {
    const double arm = system.r.col(i).norm();
    size = std::max(size, arm);
    force = std::max(force, system.mass[i] * system.spin.squaredNorm() * arm);
  }
  double softest = 0.0, stiffest = 0.0;  // [N/m]
  for (const CartesianLink& link : system.links) {
    stiffest = std::max(stiffest, link.stiffness);
    softest = softest == 0.0 ? link.stiffness : std::min(softest, link.stiffness);
  }
  if (system.true_geometry)
    for (const double stiffness : system.true_geometry->stiffnesses()) {
      stiffest = std::max(stiffest, stiffness);
      softest = softest == 0.0 ? stiffness : std::min(softest, stiffness);
    }
  const Eigen::Index n = 3 * system.mass.size();
  ElasticScale scale;
  scale.displacement =
      kSmallestStrain * std::max(size, 1e-3) + system.initial.head(n).lpNorm<Eigen::Infinity>();
  if (stiffest > 0.0) scale.displacement += force / stiffest;
  scale.velocity = scale.displacement * std::max(std::sqrt(softest / system.mass.maxCoeff()), 1e-3) +
                   system.initial.tail(n).lpNorm<Eigen::Infinity>();
  return scale;
}

ReferenceRun integrate_at_scale(const CartesianSystem& system, std::span<const double> times,
                                const ReferenceOptions& options, const ElasticScale& scale) {
  ReferenceRun run;
  run.scale = scale;
  if (times.empty()) return run;
  std::vector<double> y(system.initial.data(), system.initial.data() + system.initial.size());
  double t = 0.0;
  std::size_t next = 0;
  for (const double end : piece_ends(system, times.back())) {
    const double piece_time = 0.5 * (t + end);
    SmoothProblem problem;
    problem.slope = [&](double time, std::span<const double> from, std::span<double> slope) {
      const std::size_t half = from.size() / 2;
      std::copy(from.begin() + static_cast<std::ptrdiff_t>(half), from.end(), slope.begin());
      accelerations(system, time, piece_time, from.first(half), from.subspan(half), slope.subspan(half));
    };
    SundialsSolver solver(problem, options, scale, t, y);
    while (t < end && run.error.empty()) {
      const double stop = std::min(end, times[next]);
      run.error = solver.advance(stop, y);
      if (!run.error.empty()) break;
      t = stop;
      if (t != times[next]) continue;
      if (options.is_stopped && options.is_stopped()) {
        run.error = "stopped";
        break;
      }
      run.states.push_back(to_world(system, t, y));
      run.strain_energy.push_back(strain_energy(system, std::span(y).first(y.size() / 2)));
      ++next;
    }
    run.num_evaluations += solver.num_evaluations();
    if (!run.error.empty()) break;
  }
  return run;
}

/// Returns a pilot run with loose tolerances. The scale of the pilot run is computed from its largest
/// displacement and strain energy:
///   displacement = max_t sqrt(sum |V|^2 / N),   velocity = sqrt(2 max_t E_el / M)   (THEORY 10.10)
ReferenceRun find_scale(const CartesianSystem& system, double end, ReferenceOptions options) {
  constexpr int kSamples = 64;
  constexpr double kPilotTolerance = 1e-3;  // [-] fraction of the estimated scale, which is itself too small
  std::vector<double> times;
  for (int k = 1; k <= kSamples; ++k) times.push_back(end * k / kSamples);
  options.tolerance = kPilotTolerance;
  ReferenceRun run = integrate_at_scale(system, times, options, guess_scale(system));
  ElasticScale found;
  for (std::size_t k = 0; k < run.states.size(); ++k) {
    const double V = elastic_displacements(system.mass, system.r, run.states[k].p_W).norm();
    found.displacement = std::max(found.displacement, V / std::sqrt(static_cast<double>(system.mass.size())));
    found.velocity = std::max(found.velocity, std::sqrt(2.0 * run.strain_energy[k] / system.mass.sum()));
  }
  run.scale.displacement = std::max(found.displacement, run.scale.displacement);
  run.scale.velocity = std::max(found.velocity, run.scale.velocity);
  return run;
}

}  // namespace

std::vector<double> piece_ends(const CartesianSystem& system, double end) {
  std::vector<double> ends = discontinuities(system, end);
  ends.push_back(end);
  return ends;
}

ReferenceRun integrate(const CartesianSystem& system, std::span<const double> times,
                       const ReferenceOptions& options) {
  if (options.fixed_step > 0.0 || times.empty()) return integrate_at_scale(system, times, options, {});
  if (options.scale) return integrate_at_scale(system, times, options, *options.scale);
  const ReferenceRun pilot = find_scale(system, times.back(), options);
  if (!pilot.error.empty()) {
    ReferenceRun failed;
    failed.error = "the pilot run failed, because " + pilot.error;
    return failed;
  }
  return integrate_at_scale(system, times, options, pilot.scale);
}

ReferenceRun integrate_with_estimate(const CartesianSystem& system, std::span<const double> times,
                                     const ReferenceOptions& options) {
  constexpr double kCoarser = 30.0;
  ReferenceRun run = integrate(system, times, options);
  if (!run.error.empty()) return run;
  ReferenceOptions coarse = options;
  coarse.tolerance *= kCoarser;
  coarse.fixed_step *= 2.0;
  coarse.scale = run.scale;
  const ReferenceRun check = integrate(system, times, coarse);
  if (!check.error.empty()) {
    run.error = "the run for the error estimate failed, because " + check.error;
    return run;
  }
  for (std::size_t k = 0; k < run.states.size(); ++k) {
    const auto V = elastic_displacements(system.mass, system.r, run.states[k].p_W);
    const auto V_check = elastic_displacements(system.mass, system.r, check.states[k].p_W);
    run.accuracy = std::max(run.accuracy, elastic_error(V_check, V));
  }
  return run;
}

}  // namespace freeflex
