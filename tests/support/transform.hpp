// Makes other descriptions of the same motion: in translated and rotated axes, in a rotated world, and with
// other numbers of points and links.
#pragma once

#include <Eigen/Geometry>
#include <span>

#include "core/scene/scene.hpp"

namespace freeflex::testing {

/// Returns the scene in other scene axes, x' = Q x + t, with the initial pose that gives the same motion in
/// the world.
Scene in_other_axes(const Scene& scene, const Eigen::Quaterniond& Q, const Eigen::Vector3d& t);

/// Returns the scene in a world rotated by Q. Every world vector v becomes Q v, but scene axes do not change.
Scene in_rotated_world(const Scene& scene, const Eigen::Quaterniond& Q);

/// Returns the scene with points and links in another order. Point i of the result is point `points[i]` of
/// the scene, and link i is link `links[i]`.
Scene renumbered(const Scene& scene, std::span<const int> points, std::span<const int> links);

}  // namespace freeflex::testing
