// This code computes one smooth piece of motion by an ARKODE or CVODE integrator   (THEORY 13.7). Internal to
// tools/verification/reference.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tools/verification/reference/integrate.hpp"

namespace freeflex {

/// The equation y' = slope(t, y) over one smooth piece. The vector y contains positions, then velocities.
struct SmoothProblem {
  std::function<void(double t, std::span<const double> y, std::span<double> y_dot)> slope;
  // Jacobian in compressed columns, for implicit methods only. Within a column the row indices increase, and
  // the diagonal is always included
  std::span<const std::int64_t> column_starts, rows;
  std::function<void(std::span<const double> y, std::span<double> values)> jacobian;
  std::function<bool()> is_stopped;  // called from time to time, may be empty; true makes the run fail
};

/// This class owns every SUNDIALS object of the piece. Failures are returned as text, so nothing is thrown or
/// printed.
class SundialsSolver {
 public:
  /// Starts at time t [s] from y. The problem must outlive the solver.
  SundialsSolver(const SmoothProblem& problem, const ReferenceOptions& options, const ElasticScale& scale,
                 double t, const std::vector<double>& y);
  ~SundialsSolver();
  SundialsSolver(const SundialsSolver&) = delete;
  SundialsSolver& operator=(const SundialsSolver&) = delete;

  /// Advances to `stop` exactly and writes y there. Returns the text of a failure, including a failure in the
  /// constructor. The text is empty if there is no failure.
  std::string advance(double stop, std::vector<double>& y);

  /// Writes y at `time`, interpolated within a step. No step passes `end`, because the piece ends there.
  /// Returns a failure in the same form as `advance`. \pre the method is adaptive
  std::string interpolate(double time, double end, std::vector<double>& y);

  long num_evaluations() const;
  long num_steps() const;
  std::size_t memory() const;  // [bytes] memory of integrator and linear solver, as SUNDIALS reports it

  struct Members;  // defined in the .cpp, with the SUNDIALS calls

 private:
  std::unique_ptr<Members> members_;
};

}  // namespace freeflex
