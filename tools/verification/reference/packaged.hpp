// Runs SUNDIALS on the full system. Implicit methods use its Jacobian
// (THEORY 13.7).
#pragma once

#include "tools/verification/reference/rivals.hpp"
#include "tools/verification/reference/second_order_system.hpp"

namespace freeflex {

/// A method of ARKODE or CVODE.
class Packaged : public RivalMethod {
 public:
  /// \pre rival is kErk4, kErk8, kDirk5, kAdams or kBdf
  Packaged(Rival rival, std::unique_ptr<SecondOrderSystem> system);
  RivalRun run(std::span<const double> times, const RivalOptions& options, const RivalSink& sink) override;

 private:
  ReferenceMethod method_;
  std::unique_ptr<SecondOrderSystem> system_;
  SparsePattern pattern_;  // empty for explicit methods
};

}  // namespace freeflex
