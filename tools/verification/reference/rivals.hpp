// The methods with which freeflex is compared, each as efficient as this project can make it   (THEORY
// section 13).
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>

#include "tools/verification/reference/cartesian.hpp"
#include "tools/verification/reference/integrate.hpp"

namespace freeflex {

enum class Rival {
  kVerlet,       // velocity Verlet by hand, full system; fixed step
  kRungeKutta4,  // classical Runge-Kutta method by hand, full system; fixed step
  kStoermer8,    // Stoermer's method by hand, extrapolated to order 8, full system; fixed step
  kStoermer12,   // Stoermer's method to order 12
  kStoermer16,   // Stoermer's method to order 16
  kKahanLi8,     // Verlet composed to order 8 (Kahan and Li 1997) by hand, full system; fixed step
  kMidpoint8,    // midpoint rule by hand, extrapolated to order 8, system at true geometry; fixed step
  kMidpoint12,   // midpoint rule to order 12
  kMidpoint16,   // midpoint rule to order 16
  kErk4,         // ARKODE, Zonneveld 4(3), full system
  kErk8,         // ARKODE, Fehlberg 7(8), full system
  kDirk5,        // ARKODE, diagonally implicit of order 5, with Jacobian, full system
  kAdams,        // CVODE, Adams-Moulton with fixed-point iteration, full system
  kBdf,          // CVODE, BDF with Jacobian, full system
  kLeapfrog,     // linearised system, sparse; fixed step
  kKrylov,  // linearised system, sparse; exponential functions by Lanczos' method; fixed step and tolerance
};

struct RivalOptions {
  double step = 0.0;       // [s] > 0, for methods with a fixed step; reduced to divide each smooth piece
  double tolerance = 0.0;  // [-] > 0, for methods with a tolerance: error of a step as a fraction of
                           // the elastic scale
  ElasticScale scale;      // scale for methods with a tolerance
  std::function<bool()> is_stopped;  // called from time to time; true ends the run with an error
};

/// A function that receives the state at each requested time. The state is p_W [m] and v_W [m/s] of every
/// point.
using RivalSink = std::function<void(std::size_t index, const CartesianState& state)>;

struct RivalRun {
  std::string error;         // empty if the run reached the last time
  long num_steps = 0;        // number of steps taken
  long num_evaluations = 0;  // number of evaluations of the forces of all links
  std::size_t memory = 0;    // [bytes] memory of the arrays of the method and of the system
};

/// A method that is prepared once and runs many times. The method reads loads, gravity and initial state from
/// the system, so the system must outlive the method.
class RivalMethod {
 public:
  virtual ~RivalMethod() = default;
  /// Runs from t = 0 to the last of `times` [s], which are ascending. At a requested time within a step,
  /// packaged and hand-written methods interpolate the state, Krylov's method computes it, and leapfrog
  /// extrapolates it by at most half a step.
  virtual RivalRun run(std::span<const double> times, const RivalOptions& options, const RivalSink& sink) = 0;
};

/// Makes the method for a system. A system of springs and bars that conserves energy runs on SpringNetwork,
/// any other system on TrueSystem. Returns nullptr and sets `error` if the method cannot represent the
/// system.
std::unique_ptr<RivalMethod> make_rival(Rival rival, const CartesianSystem& system, std::string& error);

/// Returns whether a method is written by hand. Such methods run on the full system with a fixed step.
inline bool is_by_hand(Rival rival) { return rival >= Rival::kVerlet && rival <= Rival::kMidpoint16; }

/// Returns whether a method is the extrapolated midpoint rule, which is for forces that depend on velocities.
inline bool is_midpoint(Rival rival) { return rival >= Rival::kMidpoint8 && rival <= Rival::kMidpoint16; }

/// Returns whether a method runs on the linearised system. The difference between this system and the full
/// system is not an error of the method.
inline bool is_linearised(Rival rival) { return rival == Rival::kLeapfrog || rival == Rival::kKrylov; }

}  // namespace freeflex
