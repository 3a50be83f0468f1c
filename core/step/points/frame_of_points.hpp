// The frame of a motion of points.
#pragma once

#include "core/step/plan.hpp"

namespace freeflex {

/// Returns the attitude of the frame, in which the points have no mean rotation   (THEORY 12.133):
///   sum m r x R^T x = 0
/// It is the one that maximizes sum m r . R^T x.
/// \param x  [m] (3 num_points) positions relative to the centre of mass, axes that do not rotate
/// \param near  an attitude that the frame had before; it saves steps, and of the two quaternions of the
///   attitude the nearer one is returned
Quat attitude_of_points(const StepPlan& plan, const double* x, const Quat& near) noexcept;

}  // namespace freeflex
