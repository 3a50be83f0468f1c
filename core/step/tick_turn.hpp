// How far body and orbit turn in a tick, and what that asks of the step (THEORY X202).
#pragma once

#include "core/step/frame.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

/// [rad] From what free motion conserves, so that it is the same at every tick of one.
struct TickTurn {
  double whole = 0.0;  // of the body
  // what is left of it once the body turns with its momentum, or all where loads act: what substeps divide
  double uneven = 0.0;
  double orbit = 0.0;    // of the centre of mass about an attractor
  double nearest = 0.0;  // [m] to it in the tick; 0: no attractor
};
TickTurn turn_in_tick(const Plan& plan, const Frame& from, const Mat3& R_WB, const StepLoads& loads) noexcept;

/// [rad] Turns of a tick up to which one step of order 6 (X8) errs by less than rounding, 1e-13, and the fall
/// of order 2 (X72) by phi^3 / 12 = 1e-13 of an orbit.
inline constexpr double kShortTurn = 0.03, kShortOrbit = 1e-4;
/// True when a tick may turn the body, or its orbit, further: bounds that cost little, the first almost
/// nothing.  \param w  [rad/s]  \param H  [N m s] angular momentum, any axes
inline bool is_surely_short(const Plan& plan, const Vec3& H, const WheelMomentum& wheels) noexcept {
  constexpr double kMost = kShortTurn / 3.0;
  double momentum = dot(H, H);
  if (!plan.wheels.all.empty())
    for (const Vec3& each : wheels.h) momentum += dot(each, each);
  const double most = plan.principal.inverse_moment[0] * plan.period;
  return 10.0 * most * most * momentum <= kMost * kMost;
}
bool may_turn_long(const Plan& plan, const Vec3& w, const Vec3& H, const WheelMomentum& wheels) noexcept;
bool may_fall_long(const Plan& plan, const Frame& from) noexcept;

/// [rad] Uneven turn of a substep, in which order 8 errs by 1e-11 rad and 1e-9 of the energy at most.
inline constexpr double kUnevenTurn = 0.3;
/// Most substeps of a tick, some 5 ms.
inline constexpr int kMostSubsteps = 4096;
int substeps_for(double uneven) noexcept;

}  // namespace freeflex
