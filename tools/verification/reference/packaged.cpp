#include "tools/verification/reference/packaged.hpp"

#include <algorithm>
#include <utility>

#include "tools/verification/reference/sundials_solver.hpp"

namespace freeflex {
namespace {

ReferenceMethod method_of(Rival rival) {
  switch (rival) {
    case Rival::kErk4:
      return ReferenceMethod::kZonneveld43;
    case Rival::kDirk5:
      return ReferenceMethod::kDirk5;
    case Rival::kAdams:
      return ReferenceMethod::kAdams;
    case Rival::kBdf:
      return ReferenceMethod::kBdf;
    default:
      return ReferenceMethod::kFehlberg78;
  }
}

SmoothProblem make_problem(SecondOrderSystem& system, const SparsePattern& pattern) {
  SmoothProblem problem;
  problem.slope = [&system](double t, std::span<const double> y, std::span<double> y_dot) {
    const std::size_t n = system.size();
    std::copy_n(y.data() + n, n, y_dot.data());
    double* a = y_dot.data() + n;
    system.forces(t, y.data(), y.data() + n, a);
    for (std::size_t i = 0; i < n; ++i) a[i] *= system.inverse_mass()[i];
  };
  if (pattern.rows.empty()) return problem;
  problem.column_starts = pattern.column_starts;
  problem.rows = pattern.rows;
  problem.jacobian = [&system](std::span<const double> y, std::span<double> values) {
    system.jacobian(y.data(), y.data() + system.size(), values);
  };
  return problem;
}

}  // namespace

Packaged::Packaged(Rival rival, std::unique_ptr<SecondOrderSystem> system)
    : method_(method_of(rival)), system_(std::move(system)) {
  if (rival == Rival::kDirk5 || rival == Rival::kBdf) pattern_ = system_->make_pattern();
}

RivalRun Packaged::run(std::span<const double> times, const RivalOptions& options, const RivalSink& sink) {
  RivalRun run;
  // [-] of the error of a step. A larger error of the forces makes the solver shorten its steps
  constexpr double kFraction = 1e-6;
  system_->set_accuracy(kFraction * options.tolerance * options.scale.displacement);
  const std::size_t n = system_->size();
  std::vector<double> y(2 * n);
  system_->initial(std::span(y).first(n), std::span(y).subspan(n));
  SmoothProblem problem = make_problem(*system_, pattern_);
  problem.is_stopped = options.is_stopped;
  ReferenceOptions solver_options;
  solver_options.method = method_;
  solver_options.tolerance = options.tolerance;
  CartesianState state;
  std::vector<double> y_read(2 * n);
  std::size_t next = 0;
  double start = 0.0;
  for (const double end : piece_ends(system_->system(), times.back())) {
    system_->begin_piece(start, end);
    SundialsSolver solver(problem, solver_options, options.scale, start, y);
    const auto read = [&](const std::vector<double>& from) {
      system_->to_world(times[next], std::span(from).first(n), std::span(from).subspan(n), state);
      sink(next++, state);
    };
    while (run.error.empty() && times[next] < end) {
      run.error = solver.interpolate(times[next], end, y_read);
      if (run.error.empty()) read(y_read);
    }
    if (run.error.empty()) run.error = solver.interpolate(end, end, y);
    run.num_steps += solver.num_steps();
    run.num_evaluations += solver.num_evaluations();
    run.memory = std::max(run.memory, solver.memory() + system_->memory());
    if (!run.error.empty()) break;
    if (times[next] == end) read(y);
    start = end;
  }
  return run;
}

}  // namespace freeflex
