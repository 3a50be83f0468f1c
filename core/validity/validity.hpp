// Whether the method's assumptions hold: displacements small against size, spin slow against vibration.
#pragma once

#include <string>

#include "core/step/budget.hpp"
#include "core/step/readout.hpp"

namespace freeflex {

/// Beyond these a motion is outside what the method can answer (README, "When not to trust it").
inline constexpr double kMaxDisplacementRatio = 1e-3;  // [-] elastic error some 10 %
inline constexpr double kMaxSpinRatio = 0.1;           // [-] elastic error some 3 %

/// Largest estimates that are good, and that are still worth watching.
inline constexpr double kGoodElastic = 0.05, kMostElastic = 0.2;     // [-]
inline constexpr double kGoodPosition = 1e-3, kMostPosition = 1e-2;  // [-] of the size

/// One word on a motion, and its cause.
struct Verdict {
  enum class Word { kGood = 0, kWatch = 1, kOutside = 2 };
  Word word = Word::kGood;
  std::string cause;  // empty when good
};

/// What the ratios of a motion say where no budget is kept: an order of magnitude.
Verdict judge_ratios(const Plan& plan, double displacement_ratio, double spin_ratio);
/// What a budget says; the ratios name the cause, and judge where the plan has links whose second order no
/// rung knows. \param size  [m] max |r|
Verdict judge_budget(const Plan& plan, const BudgetReading& reading, double size, double displacement_ratio,
                     double spin_ratio);

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
/// |v|
double norm(const Vec3& v) noexcept;

}  // namespace freeflex
