// How each elastic mode moves freely, with the forces that couple the modes.
#pragma once

#include <string>
#include <vector>

#include "core/step/plan.hpp"

namespace freeflex {

/// Free motion of one elastic mode, exp(s t), s the eigenvalue of the damped equations that belongs to it
/// (THEORY X77). The body is at rest, wheels turn as at the start, and constant followers are the only loads.
struct DampedMode {
  bool is_known = true;    // false: the eigenvalue was not found, and all other values are zero
  double frequency = 0.0;  // [rad/s] |Im s|; 0: the mode does not oscillate
  double rate = 0.0;       // [1/s] -Re s; of two real eigenvalues the slower one; negative: it grows
  // [-] -Re s / |s|; of two real ones their mean over their geometric mean, -1 where one grows; 0 at |s| = 0
  double ratio = 0.0;
  double step_error =
      0.0;  // [-] what the step changes of the motion in a tick, over what damping does in a tick
};

/// Free motion of every elastic mode, in the order of the plan.
struct FreeMotion {
  std::vector<DampedMode> modes;
  double nutation = 0.0;  // [rad/s] of the body, where wheels couple it with the modes; 0: none
  std::string unknown;    // why modes are not known, in words; empty: all are
};

/// Returns true when dashpots, feedback, constant followers or wheels couple the modes of a plan, on its
/// rung.
bool couples_modes(const Plan& plan);

/// Returns the free motion. An eigenvalue belongs to the mode that holds most of the energy of its
/// eigenvector. The work grows with (num_modes * num_forces)^2, num_forces the number of forces that couple
/// modes; where that is too much, modes are not known.
FreeMotion free_motion(const Plan& plan);

/// Returns how fast an amplitude of the 128 lowest modes grows by constant followers [1/s]: 0 where none
/// does, where it grows without them as fast, or where the coupling is not known.
double growth_by_followers(const Plan& plan);

}  // namespace freeflex
