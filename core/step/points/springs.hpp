// The accelerations of points that springs and bars join.
#pragma once

#include "core/step/plan/points.hpp"

namespace freeflex {

/// Sets the accelerations of all points, and of the centre of mass, to `load` plus those by the springs
/// (THEORY 12.127, 12.137):
///   F_i += pull d,   F_j -= pull d,   pull = D - D L / l + c d.d' / l^2,   d = x_j - x_i,   l = |d|
/// \param x  [m] (3 (num_points + 1) and padding) positions
/// \param v  [m/s] of the same size; not read if nothing is damped
/// \param load  [m/s^2] of the same size
/// \param force  [N] scratch, 4 (num_points + 1)
void accelerate(const PlanPoints& plan, const double* x, const double* v, const double* load, double* force,
                double* acceleration) noexcept;

}  // namespace freeflex
