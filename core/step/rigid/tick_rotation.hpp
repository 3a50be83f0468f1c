// Bounds on the rotation of the body and on the angle of its orbit in a tick, and the number of substeps that
// these angles need   (THEORY 7.20 to 7.25).
#pragma once

#include "core/step/rigid/frame.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

/// Holds bounds on the angles by which the body rotates and moves along its orbit in a tick [rad]. The bounds
/// of the rotation are computed from conserved quantities, so they are the same at every tick of a free
/// motion.
struct TickRotation {
  double total = 0.0;  // rotation of the body   (THEORY 7.24)
  // angle that is divided into substeps: the rotation relative to the rotation about the angular momentum, or
  // the total rotation if moments of loads act, plus a part for the orbit   (THEORY 7.21)
  double substep_angle = 0.0;
  double orbit = 0.0;    // angle of the centre of mass about an attractor   (THEORY 7.25)
  double nearest = 0.0;  // [m] smallest distance from the attractor in the tick; 0: no attractor
};
/// Returns the bounds on the angles in a tick:
///   total = h (|H| / I_2 + w_rel)   (THEORY 7.24)
///   substep_angle = 2 orbit + (total with moments of loads, 0 for free spin about one principal axis,
///   h w_rel for other free motion)   (THEORY 7.21)
/// The term 2 orbit is added only if the attractor exerts a torque on the body or if forces act. w_rel is a
/// bound on the rate of the body relative to its rotation about the angular momentum   (THEORY 7.22).
TickRotation rotation_in_tick(const StepPlan& plan, const Frame& from, const Mat3& R_WB,
                              const RigidLoads& loads) noexcept;

/// Largest angles in a tick [rad] for which the tick is short. For a rotation of at most kShortRotation, the
/// error of one step of order 6   (THEORY 7.10) is below the rounding error, 1e-13. For an angle of at most
/// kShortOrbit, the error of Simpson's rule for the fall (THEORY 8.18) is at most phi^3 / 12 = 1e-13 of an
/// orbit.
inline constexpr double kShortRotation = 0.03, kShortOrbit = 1e-4;
/// Returns true only if a tick is certain to rotate the body by less than kShortRotation. This test costs
/// less than may_rotate_far.
/// \param H  [N m s] angular momentum about the centre of mass, in any axes
inline bool is_surely_short(const StepPlan& plan, const Vec3& H, const WheelMomentum& wheels) noexcept {
  constexpr double kMost = kShortRotation / 3.0;
  double momentum = dot(H, H);
  if (!plan.wheels.empty())
    for (const Vec3& each : wheels.h) momentum += dot(each, each);
  const double most = plan.principal.inverse_moment[0] * plan.period;
  return 10.0 * most * most * momentum <= kMost * kMost;
}
/// Returns true if the body may rotate by more than kShortRotation in a tick, by a bound on the rotation.
/// \param w  [rad/s] angular velocity of the body, body axes
/// \param H  [N m s] angular momentum about the centre of mass, in any axes
bool may_rotate_far(const StepPlan& plan, const Vec3& w, const Vec3& H, const WheelMomentum& wheels) noexcept;
/// Returns true if the fall in a tick must be computed by the exact orbit. This is so if h (mu /
/// |rho|^3)^(1/2) is above kShortOrbit, or the body moves by more than 0.1 of its distance from the
/// attractor   (THEORY 7.26).
bool may_orbit_far(const StepPlan& plan, const Frame& from) noexcept;

/// Largest angle in a substep [rad]. With this angle, the error of the method of order 8 is at most
/// 1e-11 rad, and 1e-9 of the energy.
inline constexpr double kSubstepRotation = 0.3;
/// Largest number of substeps in a tick. A tick of this many substeps takes about 5 ms to compute.
inline constexpr int kMaxRotationSubsteps = 4096;
/// Returns min(4096, max(1, ceil(angle / 0.3)))   (THEORY 7.20).
int substeps_for(double angle) noexcept;

}  // namespace freeflex
