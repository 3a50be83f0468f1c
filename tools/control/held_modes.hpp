// Modes of a structure of which a point or a group is held, and their effective masses.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/plan.hpp"

namespace freeflex::control {

/// Numbers along x y z and about x y z through the held point, scene axes.
using SixNumbers = Eigen::Matrix<double, 6, 1>;
struct HeldMode {
  double frequency = 0.0;  // [Hz]
  // phi^T M r / M_0, where r is the rigid motion by one unit, and the shape phi has the generalized mass M_0
  // of the whole body: [-] along and [m] about the axes
  SixNumbers participation;
  SixNumbers effective_mass;  // [kg], [kg m^2]: M_0 times the square of the participation
};
struct HeldModes {
  std::vector<HeldMode> modes;  // ascending
  SixNumbers moving;            // [kg], [kg m^2] sums of the effective masses
  Eigen::Vector3d about;        // [m] scene axes, mean of the held points, through which the axes are
  bool holds_rotation = true;   // false: the body can turn about what is held
  std::string error;            // why there are none
};
/// Holds a point, and its rotation if it has inertia or an offset, or all points of a group. With all modes
/// of the free structure the result is exact, and `moving` is the mass that is not held. With only the lowest
/// modes, frequencies are too high and masses too small. \pre the plan has rows of the held points and
/// bodies, and omits no feature
HeldModes hold(const Plan& plan, const std::string& name);

}  // namespace freeflex::control
