// Positions of the particles that stand for the masses of bodies. Header only.
#pragma once

#include <Eigen/Geometry>
#include <variant>

#include "core/scene/bodies.hpp"
#include "core/step/readout.hpp"

namespace freeflex::testing {

inline Eigen::Vector3d vector_of(const Vec3& v) { return {v[0], v[1], v[2]}; }

/// Returns the positions [m] of the points of `whole` in a motion of `scene`. If `whole` has more points than
/// `scene`, its rigid links hold them at bodies of `scene`.
inline Eigen::Matrix3Xd particle_positions(const Scene& whole, const Scene& scene, const Plan& plan,
                                           const MotionState& state) {
  Eigen::Matrix3Xd p_W(3, static_cast<Eigen::Index>(whole.points.size()));
  for (std::size_t i = 0; i < scene.points.size(); ++i)
    p_W.col(static_cast<Eigen::Index>(i)) = vector_of(read_point(plan, state, static_cast<int>(i)).p_W);
  for (const Link& link : whole.links) {
    const int body = link.points.front();
    if (!std::holds_alternative<Rigid>(link.kind) ||
        !has_attitude(scene.points[static_cast<std::size_t>(body)]))
      continue;
    const Quat q = read_body(plan, state, body).q_WP;
    const Eigen::Matrix3d R = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
    const auto rest = [&](int i) { return whole.points[static_cast<std::size_t>(i)].position; };
    for (const int i : link.points) p_W.col(i) = p_W.col(body) + R * (rest(i) - rest(body));
  }
  return p_W;
}

}  // namespace freeflex::testing
