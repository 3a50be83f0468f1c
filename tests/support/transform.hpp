// The same physics written down differently: moved and turned axes, a turned world, other numbers.
#pragma once

#include <Eigen/Geometry>
#include <span>

#include "core/scene/scene.hpp"

namespace freeflex::testing {

/// The scene described in other scene axes, x' = Q x + t, standing so that the motion in the world is the
/// same.
Scene in_other_axes(const Scene& scene, const Eigen::Quaterniond& Q, const Eigen::Vector3d& t);

/// The scene in a world turned by Q: every world vector v becomes Q v, nothing in scene axes changes.
Scene in_turned_world(const Scene& scene, const Eigen::Quaterniond& Q);

/// Point i of the result is point `points[i]` of the scene, link i link `links[i]`.
Scene renumbered(const Scene& scene, std::span<const int> points, std::span<const int> links);

}  // namespace freeflex::testing
