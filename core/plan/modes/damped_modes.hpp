// Free motion of each elastic mode, including the forces that couple the modes.
#pragma once

#include <string>
#include <vector>

#include "core/plan.hpp"

namespace freeflex {

/// Holds the free motion exp(s t) of one elastic mode. Here s is the eigenvalue of the damped equations that
/// belongs to the mode (THEORY 8.42, 8.44). The body does not rotate, wheels spin as at the start, and
/// constant followers are the only loads.
struct DampedMode {
  bool is_known = true;    // false: the eigenvalue was not found, and all other values are zero
  double frequency = 0.0;  // [rad/s] |Im s|; 0: the mode does not oscillate
  double rate = 0.0;       // [1/s] -Re s; of two real eigenvalues, the slower one; negative: the mode grows
  // [-] The damping ratio -Re s / |s|. If the mode has two real eigenvalues, the ratio is minus their
  // arithmetic mean over their geometric mean, or -1 if one of them is positive. If s is zero, the ratio is
  // zero.
  double ratio = 0.0;
  // [-] error of the split step in a tick, over the change that damping makes in a tick   (THEORY 8.45)
  double step_error = 0.0;
};

/// Holds the free motion of all elastic modes, in the order of the plan.
struct FreeMotion {
  std::vector<DampedMode> modes;
  double nutation = 0.0;  // [rad/s] nutation of the body, if wheels couple it with the modes; 0: no nutation
  std::string unknown;    // why some modes are not known; empty: all are known
};

/// Returns true if dashpots, feedback, constant followers or wheels couple the modes of a plan on its rung.
bool couples_modes(const StepPlan& plan);

/// Returns the free motion. An eigenvalue belongs to the mode that holds most of the energy of the
/// eigenvector. The mode then has frequency |Im s|, damping ratio -Re(s) / |s|   (THEORY 8.44). The work
/// grows with (num_modes * num_forces)^2, where num_forces is the number of forces that couple modes. If the
/// work is too much, the coupled modes are reported as unknown.
FreeMotion free_motion(const StepPlan& plan);

/// Returns the largest growth rate that constant followers cause among the 128 lowest modes [1/s]. Returns 0
/// if no mode grows, if the fastest growth is the same without followers, or if the coupling is not known.
double growth_by_followers(const StepPlan& plan);

}  // namespace freeflex
