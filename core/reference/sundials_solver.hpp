// One smooth piece of motion by an ARKODE or CVODE integrator. Internal to core/reference.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/reference/integrate.hpp"

namespace freeflex {

/// Owns every SUNDIALS object of the piece; what fails becomes text, never an exception or a print.
class SundialsSolver {
 public:
  /// Starts at time t [s] from y (6N). `piece_time` lies strictly inside the smooth piece.
  SundialsSolver(const CartesianSystem& system, const ReferenceOptions& options, const ElasticScale& scale,
                 double t, double piece_time, const std::vector<double>& y);
  ~SundialsSolver();
  SundialsSolver(const SundialsSolver&) = delete;
  SundialsSolver& operator=(const SundialsSolver&) = delete;

  /// Advances to `stop` exactly and writes y there. Empty, or what went wrong (also in the constructor).
  std::string advance(double stop, std::vector<double>& y);

  long num_evaluations() const;

  struct Members;  // defined beside the SUNDIALS calls

 private:
  std::unique_ptr<Members> members_;
};

}  // namespace freeflex
