// Whether the method's assumptions hold: displacements small against size, spin slow against vibration.
#pragma once

#include "core/step/readout.hpp"

namespace freeflex {

/// Largest estimates that are good, and that are still worth watching (README, "When not to trust it").
inline constexpr double kGoodElastic = 0.02, kMostElastic = 0.2;            // [-] of what matters
inline constexpr double kGoodPosition = 1e-3, kMostPosition = 1e-2;         // [-] of the size
inline constexpr double kGoodDisplacement = 1e-2, kMostDisplacement = 0.1;  // [-] of the size
inline constexpr double kGoodUnseen =
    1e-3;  // [-] the same where links have a second order that nothing tells

/// The ratios of status_t for one plan. Allocates nothing after construction.
class Validity {
 public:
  explicit Validity(const Plan& plan);

  double size() const { return size_; }  // [m] max |r|
  /// [m] largest elastic displacement of the published points, max |V|
  double max_displacement(const MotionState& state) const noexcept;
  /// [-] max |V| / max |r|. \param max_displacement  [m]
  double displacement_ratio(double max_displacement) const noexcept;
  /// [-] (|w| / omega_1)^2 max |r| / max |V|: the displacement by centrifugal forces, which the elastic
  /// equations leave out, over the one they have. 0 without spin or vibration, at most 1e9.
  /// \param spin  [rad/s] |w|  \param max_displacement  [m]
  double spin_ratio(double spin, double max_displacement) const noexcept;

 private:
  const Plan& plan_;
  double omega_1_ = 0.0;  // [rad/s] lowest nonzero elastic frequency; 0: none
  double size_ = 0.0;     // [m] max |r|
};

/// numerator / denominator, both >= 0, for ratios of which 0/0 means none; at most 1e9.
double bounded_ratio(double numerator, double denominator) noexcept;
/// Lowest elastic frequency that is not zero [rad/s]; 0: none. Of the wide plan too.
double lowest_omega(const Plan& plan) noexcept;
/// |v|
double norm(const Vec3& v) noexcept;

}  // namespace freeflex
