// Motion of a Cartesian system by SUNDIALS, with tolerances that are fractions of the deformation
// (THEORY 10.10).
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tools/verification/reference/cartesian.hpp"

namespace freeflex {

enum class ReferenceMethod {
  kFehlberg78,   // ARKODE, explicit Runge-Kutta of order 8, 13 stages
  kRungeKutta4,  // ARKODE, the classical explicit method of order 4; fixed step only
  kAdams,        // CVODE, Adams-Moulton to order 12 with fixed-point iteration; adaptive only
  kZonneveld43,  // ARKODE, explicit Runge-Kutta of order 4, 5 stages; adaptive only
  kDirk5,        // ARKODE, diagonally implicit of order 5, 8 stages; adaptive, needs a Jacobian
  kBdf,          // CVODE, backward differentiation to order 5; adaptive, needs a Jacobian
};

/// Tolerances are fractions of these sizes   (THEORY 10.10). The size of the structure is never used, because
/// a deformation is often 1e-7 of that size.
struct ElasticScale {
  double displacement = 0.0;  // [m] largest root mean square elastic displacement, max_t sqrt(sum |V|^2 / N)
  double velocity = 0.0;      // [m/s] sqrt(2 E_el / M) with E_el the largest strain energy
};

struct ReferenceOptions {
  ReferenceMethod method = ReferenceMethod::kFehlberg78;
  double tolerance = 1e-9;            // [-] local error of a step as a fraction of the elastic scale, > 0
  double fixed_step = 0.0;            // [s] > 0: reduced so that it divides each smooth piece; 0: adaptive
  std::optional<ElasticScale> scale;  // found by a pilot run if absent; not used with a fixed step
  std::function<bool()> is_stopped;   // called at each requested time; true ends the run with an error
  long max_steps = -1;                // largest number of steps to each requested time; more steps are an
                                      // error; -1: no limit
};

struct ReferenceRun {
  std::string error;  // empty if every SUNDIALS call succeeded; otherwise the first failure, before which
                      // `states` ends
  std::vector<CartesianState> states;  // at the requested times
  std::vector<double> strain_energy;   // [J] strain energy at the requested times
  ElasticScale scale;
  long num_evaluations = 0;  // number of evaluations of the accelerations, without the pilot run
  double accuracy = 0.0;     // [-] see integrate_with_estimate
};

/// Returns the ends of the smooth pieces of (0, end]: the times at which a load or its slope jumps, then the
/// end.
std::vector<double> piece_ends(const CartesianSystem& system, double end);

/// Integrates from t = 0 through `times` [s] (ascending, > 0) and restarts at every discontinuity of the
/// loads. Every requested time is the end of a step, so nothing is interpolated. If neither a scale nor a
/// fixed step is given, a pilot run with loose tolerances finds the scale   (THEORY 10.10).
ReferenceRun integrate(const CartesianSystem& system, std::span<const double> times,
                       const ReferenceOptions& options = {});

/// Integrates as `integrate` does and estimates `accuracy`. This is the largest elastic error (THEORY 10.11)
/// over `times` of a coarser run (30 times the tolerance, or twice the fixed step), measured against the
/// returned run. So it is the error of the coarser run, which overstates the error of the returned run.
/// However, if both fixed steps damp the fastest modes, the estimate does not contain that loss.
ReferenceRun integrate_with_estimate(const CartesianSystem& system, std::span<const double> times,
                                     const ReferenceOptions& options = {});

}  // namespace freeflex
