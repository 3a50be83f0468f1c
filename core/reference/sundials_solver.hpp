// One smooth piece of motion by an ARKODE or CVODE integrator. Internal to core/reference.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/reference/integrate.hpp"

namespace freeflex {

/// y' = slope(t, y) over one smooth piece; y is positions, then velocities.
struct SmoothProblem {
  std::function<void(double t, std::span<const double> y, std::span<double> y_dot)> slope;
  // Jacobian by columns, for implicit methods only: rows ascend and hold every diagonal entry
  std::span<const std::int64_t> column_starts, rows;
  std::function<void(std::span<const double> y, std::span<double> values)> jacobian;
  std::function<bool()> is_stopped;  // asked now and then, may be empty; true makes the run fail
};

/// Owns every SUNDIALS object of the piece; what fails becomes text, never an exception or a print.
class SundialsSolver {
 public:
  /// Starts at time t [s] from y. The problem must outlive the solver.
  SundialsSolver(const SmoothProblem& problem, const ReferenceOptions& options, const ElasticScale& scale,
                 double t, const std::vector<double>& y);
  ~SundialsSolver();
  SundialsSolver(const SundialsSolver&) = delete;
  SundialsSolver& operator=(const SundialsSolver&) = delete;

  /// Advances to `stop` exactly and writes y there. Empty, or what went wrong (also in the constructor).
  std::string advance(double stop, std::vector<double>& y);

  /// Writes y at `time`, interpolated within a step; no step passes `end`, where the piece ends. Adaptive
  /// methods.
  std::string interpolate(double time, double end, std::vector<double>& y);

  long num_evaluations() const;
  long num_steps() const;
  std::size_t memory() const;  // [bytes] that SUNDIALS says its integrator and linear solver keep

  struct Members;  // defined beside the SUNDIALS calls

 private:
  std::unique_ptr<Members> members_;
};

}  // namespace freeflex
