// Runs SUNDIALS on the arrays of the full system. Implicit methods use the exact sparse Jacobian
// (THEORY 13.7).
#pragma once

#include "tools/verification/reference/rivals.hpp"
#include "tools/verification/reference/spring_network.hpp"

namespace freeflex {

/// A method of ARKODE or CVODE.
class Packaged : public RivalMethod {
 public:
  /// \pre rival is kErk4, kErk8, kDirk5, kAdams or kBdf
  Packaged(Rival rival, SpringNetwork network);
  RivalRun run(std::span<const double> times, const RivalOptions& options, const RivalSink& sink) override;

 private:
  ReferenceMethod method_;
  SpringNetwork network_;
  SparsePattern pattern_;  // empty for explicit methods
};

}  // namespace freeflex
