// The methods that freeflex is compared with, each as good as we can make it   (THEORY section 13).
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>

#include "core/reference/cartesian.hpp"
#include "core/reference/integrate.hpp"

namespace freeflex {

enum class Rival {
  kVerlet,       // velocity Verlet by hand, full system; fixed step
  kRungeKutta4,  // classical Runge-Kutta method by hand, full system; fixed step
  kStoermer8,    // Stoermer's method by hand, extrapolated to order 8, full system; fixed step
  kStoermer12,   // the same to order 12
  kStoermer16,   // the same to order 16
  kKahanLi8,     // Verlet composed to order 8 (Kahan and Li 1997) by hand, full system; fixed step
  kErk4,         // ARKODE, Zonneveld 4(3), full system
  kErk8,         // ARKODE, Fehlberg 7(8), full system
  kDirk5,        // ARKODE, diagonally implicit of order 5, sparse Jacobian, full system
  kAdams,        // CVODE, Adams-Moulton with fixed-point iteration, full system
  kBdf,          // CVODE, BDF with sparse Jacobian, full system
  kLeapfrog,     // linearised system, sparse; fixed step
  kKrylov,       // linearised system, sparse: exponential by Lanczos; fixed step and tolerance
};

struct RivalOptions {
  double step = 0.0;                 // [s] > 0 of fixed-step methods, rounded to divide each smooth piece
  double tolerance = 0.0;            // [-] > 0 of the others: error of a step over the elastic scale
  ElasticScale scale;                // for methods with a tolerance
  std::function<bool()> is_stopped;  // asked now and then; true ends the run with an error
};

/// What a run gives at each requested time; p_W [m], v_W [m/s] of every point.
using RivalSink = std::function<void(std::size_t index, const CartesianState& state)>;

struct RivalRun {
  std::string error;         // empty: reached the last time
  long num_steps = 0;        // taken
  long num_evaluations = 0;  // of the forces of all links
  std::size_t memory = 0;    // [bytes] of the method's own arrays and of the system's
};

/// Prepared once, run many times. Loads, gravity and initial state are the system's, which must outlive it.
class RivalMethod {
 public:
  virtual ~RivalMethod() = default;
  /// From t = 0 through `times` [s], ascending, the last one the end; between steps the packaged and
  /// hand-written methods interpolate, the linearised ones step there.
  virtual RivalRun run(std::span<const double> times, const RivalOptions& options, const RivalSink& sink) = 0;
};

/// nullptr and `error` for a system that the method cannot state.
std::unique_ptr<RivalMethod> make_rival(Rival rival, const CartesianSystem& system, std::string& error);

/// Written by hand on the full system, at a fixed step.
inline bool is_by_hand(Rival rival) { return rival >= Rival::kVerlet && rival <= Rival::kKahanLi8; }

/// Runs on the linearised system, whose error against the full one is not the method's.
inline bool is_linearised(Rival rival) { return rival == Rival::kLeapfrog || rival == Rival::kKrylov; }

}  // namespace freeflex
