// This file checks two assumptions of the method. Displacements must be small compared with the size, and the
// spin must be slow compared with the vibration.
#pragma once

#include "core/error/verdict.hpp"
#include "core/step/readout.hpp"

namespace freeflex {

/// Computes the displacement ratio and the spin ratio that status_t publishes, for one plan. Allocates
/// nothing after construction.
class Validity {
 public:
  explicit Validity(const Plan& plan);

  double size() const { return size_; }  // [m] max |r|
  /// Returns the largest elastic displacement of the published points, max |V| [m].
  double max_displacement(const MotionState& state) const noexcept;
  /// Returns the displacement ratio max |V| / max |r|   (THEORY 9.10).  \param max_displacement  [m]
  double displacement_ratio(double max_displacement) const noexcept;
  /// Returns the spin ratio (|w| / omega_1)^2 max |r| / max |V|   (THEORY 9.11): the displacement that
  /// centrifugal forces would cause, over the present displacement. The elastic equations neglect these
  /// forces. The ratio is 0 without spin or elastic modes, and at most 1e9.
  /// \param spin  [rad/s] |w|  \param max_displacement  [m]
  double spin_ratio(double spin, double max_displacement) const noexcept;

 private:
  const Plan& plan_;
  double omega_1_ = 0.0;  // [rad/s] lowest nonzero elastic frequency; 0: no such mode
  double size_ = 0.0;     // [m] max |r|
};

/// Returns numerator / denominator, but at most 1e9, and 0 for 0/0. Numerator and denominator must be >= 0.
double bounded_ratio(double numerator, double denominator) noexcept;
/// Returns the lowest nonzero elastic frequency [rad/s] of the plan and its fallback plan. Returns 0 if there
/// is no such mode.
double lowest_omega(const Plan& plan) noexcept;
/// Returns |v|.
double norm(const Vec3& v) noexcept;

}  // namespace freeflex
