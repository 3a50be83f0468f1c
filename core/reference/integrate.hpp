// Motion of a Cartesian system by SUNDIALS, with tolerances in units of the deformation (THEORY X35).
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/reference/cartesian.hpp"

namespace freeflex {

enum class ReferenceMethod {
  kFehlberg78,   // ARKODE, explicit Runge-Kutta of order 8, 13 stages
  kRungeKutta4,  // ARKODE, the classical explicit method of order 4; fixed step only
  kAdams,        // CVODE, Adams-Moulton to order 12 with fixed-point iteration; adaptive only
  kZonneveld43,  // ARKODE, explicit Runge-Kutta of order 4, 5 stages; adaptive only
  kDirk5,        // ARKODE, diagonally implicit of order 5, 8 stages; adaptive, needs a Jacobian
  kBdf,          // CVODE, backward differentiation to order 5; adaptive, needs a Jacobian
};

/// Sizes that tolerances are fractions of. Never the size of the structure: a deformation is often 1e-7 of
/// it.
struct ElasticScale {
  double displacement = 0.0;  // [m] largest root mean square elastic displacement
  double velocity = 0.0;      // [m/s] sqrt(2 (largest strain energy) / mass)
};

struct ReferenceOptions {
  ReferenceMethod method = ReferenceMethod::kFehlberg78;
  double tolerance = 1e-9;            // [-] local error of a step over the elastic scale, > 0
  double fixed_step = 0.0;            // [s] > 0: this step, rounded to divide each smooth piece; 0: adaptive
  std::optional<ElasticScale> scale;  // found by a pilot run when absent; not used with a fixed step
  std::function<bool()> is_stopped;   // asked at each requested time; true ends the run with an error
  long max_steps = -1;                // steps allowed to each requested time; more are an error; -1: no limit
};

struct ReferenceRun {
  std::string error;  // empty: every SUNDIALS call succeeded; else what failed, and states end before it
  std::vector<CartesianState> states;  // at the requested times
  std::vector<double> strain_energy;   // [J] at the requested times
  ElasticScale scale;
  long num_evaluations = 0;  // of the accelerations, pilot run not counted
  double accuracy = 0.0;     // [-] see integrate_with_estimate
};

/// Ends of the smooth pieces of (0, end]: times at which loads jump, then the end.
std::vector<double> piece_ends(const CartesianSystem& system, double end);

/// Integrates from t = 0 through `times` [s] (ascending, > 0), restarting at every discontinuity of the
/// loads. Every requested time is the end of a step: nothing is interpolated.
ReferenceRun integrate(const CartesianSystem& system, std::span<const double> times,
                       const ReferenceOptions& options = {});

/// The same, and `accuracy`: the largest elastic error (X37) over `times` of a coarser run (tolerance times
/// 30, or twice the fixed step) against this one. It is the coarser run's error, so it overstates this run's;
/// but two fixed steps that both damp the fastest modes agree on what they lost.
ReferenceRun integrate_with_estimate(const CartesianSystem& system, std::span<const double> times,
                                     const ReferenceOptions& options = {});

}  // namespace freeflex
