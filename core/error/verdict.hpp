// The verdict on a motion. This header and core/error/tables.hpp are all that other rooms see of the estimate
// of the error; class Motion in core/motion.hpp computes it.
#pragma once

#include <cstdint>
#include <string>

#include "core/plan.hpp"
#include "core/step/step.hpp"

namespace freeflex {

/// These are the limits of the verdict, that is, the largest estimate for `good` and the largest estimate for
/// `watch` (THEORY 15.8; README, "When not to trust it").
inline constexpr double kGoodElastic = 0.02, kMostElastic = 0.2;     // [-] error over scale
inline constexpr double kGoodPosition = 1e-3, kMostPosition = 1e-2;  // [-] error of position over size
inline constexpr double kGoodAttitude = 1e-3, kMostAttitude = 1e-2;  // [rad]

/// Holds the distance between two motions   (THEORY 15.5).
struct MotionError {
  double position = 0.0;     // [m] of the centre of mass
  double attitude = 0.0;     // [rad]
  double deformation = 0.0;  // [m] of the elastic displacements, rms over the mass
};

/// States how far a motion can be trusted, with the values that decide it   (THEORY 15.8).
///   The verdict is `good` up to the first limit and `watch` up to the second: 0.02 and 0.2 for error of
///   deformation / scale, 1e-3 and 1e-2 for error of position / size, 1e-3 and 1e-2 rad for the attitude.
struct Verdict {
  enum class Level : std::int32_t { kGood = 0, kWatch = 1, kOutside = 2 };
  /// Specifies the main reason why the verdict is not better.
  enum class Cause : std::int32_t {
    kNone,
    kDeformation,  // distance of the elastic displacements from those of the shadow
    kPosition,     // distance of the centre of mass
    kAttitude,     // distance of the attitude
    kLost,         // the shadow stopped
    kCoarse,       // the shadow may itself be wrong by more than the limit
    kRigid,        // the rung is rigid, and the body deforms
    kFastLoad,     // a load changes faster than the ticks resolve
    kAttractor,    // the attractor is so near that its field is not linear over the body
    kRinging,      // modes ring that the steps of the shadow do not resolve
    kMissedLoad,   // a load acts in a horizon that is not judged
    kGrowth,       // the error grows fast, and horizons that are not judged follow
    kShared,       // an error that the shadow shares   (PlanVerdict::shared)
  };
  Level level = Level::kGood;
  Cause cause = Cause::kNone;
  std::int64_t tick = -1;         // the last tick that was judged; -1: none
  MotionError error;              // estimate: distance of the state from the true motion
  double own_error = 0.0;         // [m] estimated error of the shadow, rms over the mass
  double displacement_now = 0.0;  // [m] displacement of the state, rms over the mass
  // [m] Displacement by which the error of deformation is divided   (THEORY 15.7). It is the tolerance or,
  // without a tolerance, the decaying peak; at least 1e-9 of the size.
  double scale = 0.0;
  StepStatus stopped = StepStatus::kOk;  // kLost: why the shadow stopped
};

/// Returns `good` up to the first limit, `watch` up to the second and `outside` above, also for NaN.
Verdict::Level grade(double value, double good, double most) noexcept;
/// Returns "good", "watch" or "outside".
const char* name_of(Verdict::Level level);
/// Returns the text of the cause, with the remedy. If the verdict is `good`, the text is empty.
std::string text_of(const Plan& plan, const Verdict& verdict);
/// Returns "good", or the level of the verdict and the text of the cause. If nothing is judged, returns "not
/// judged" and why.
std::string describe(const Plan& plan, const Verdict& verdict);
/// Returns why nothing is judged yet, or nothing at all.
std::string not_judged_text(const Plan& plan);
/// Returns the estimated error of the displacements as text, for example "0.12 % of 1e-05 m
/// (tolerance)".
std::string error_text(const Plan& plan, const Verdict& verdict);
/// Returns the ratio of an error to `scale`, both [m], as text, for example "0.12 % of" or "more than 10
/// times".
std::string share_text(double error, double scale);

}  // namespace freeflex
