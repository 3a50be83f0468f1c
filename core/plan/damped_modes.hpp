// How each elastic mode moves freely, with the dashpots and the feedback that couple the modes.
#pragma once

#include <vector>

#include "core/step/plan.hpp"

namespace freeflex {

/// Free motion of one elastic mode, exp(s t), s the eigenvalue of the damped equations that belongs to it
/// (THEORY X77). The body is at rest and no load acts.
struct DampedMode {
  bool is_known = true;    // false: the eigenvalue was not found, and all other values are zero
  double frequency = 0.0;  // [rad/s] |Im s|; 0: the mode does not oscillate
  double rate = 0.0;       // [1/s] -Re s; of two real eigenvalues the slower one
  double ratio = 0.0;  // [-] -Re s / |s|; of two real ones their mean over their geometric mean; 0 at |s| = 0
  double step_error =
      0.0;  // [-] what the step changes of the motion in a tick, over what damping does in a tick
};

/// Returns true when dashpots or feedback couple the modes of a plan, on any rung.
bool couples_modes(const Plan& plan);

/// Returns the free motion of every elastic mode, in the order of the plan. An eigenvalue belongs to the mode
/// that holds most of the energy of its eigenvector. The work grows with (num_modes * num_forces)^2,
/// num_forces the number of dashpots and feedback forces; where that is too much, modes are not known.
std::vector<DampedMode> damped_modes(const Plan& plan);

}  // namespace freeflex
