// Points that are more, or less, than point masses: bodies with inertia, massless points.
#pragma once

#include <string>

#include "core/scene/scene.hpp"

namespace freeflex {

/// True of a body: its attitude counts among the freedoms, for it has inertia or an offset   (THEORY X160).
bool has_attitude(const PointMass& point);

/// True when all points are point masses: mass, and nothing else.
bool are_point_masses(const std::vector<PointMass>& points);

/// Second moment of the mass about its own centre, S = (tr J) / 2 - J [kg m^2]   (THEORY X160).
Eigen::Matrix3d second_moment(const PointMass& point);

/// What keeps a symmetric matrix from being an inertia: a negative moment, one above the sum of the two
/// others. Empty: nothing.
std::string inertia_problem(const Eigen::Matrix3d& inertia);

}  // namespace freeflex
