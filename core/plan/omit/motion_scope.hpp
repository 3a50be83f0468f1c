// The scope of the motion of a scene tells whether the body can rotate, and whether the motion can leave a
// plane.
#pragma once

#include <Eigen/Core>
#include <string>

#include "core/structure/structure.hpp"

namespace freeflex {

/// Holds the motions that the initial state, the built-in loads, the fields and the commands of a scene can
/// cause (THEORY 14.4, 14.5).
struct MotionScope {
  bool has_rotation = true;    // false: nothing rotates the body, so its attitude stays the initial one
  bool is_planar = false;      // true: points and loads are in one plane, and the spin is normal to it
  std::string why_rotates;     // what may rotate the body, or the reason why nothing rotates it
  std::string why_not_planar;  // what may leave the plane; empty if the motion is planar
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();    // [-] normal of the plane, body axes
  Eigen::Matrix3d R_WB = Eigen::Matrix3d::Identity();  // initial attitude
  bool takes_spin_load = false;  // true: the spin loads the modes on this rung   (THEORY 8.14)
  // binds_rotation is true if commands could rotate the body and are rejected if they would. binds_plane is
  // true if commands could move the body out of the plane and are rejected if they would.
  bool binds_rotation = false, binds_plane = false;
};

/// Finds the scope of the motion.
/// \param rung           rung of the plan
/// \param with_commands  If true, commands may do whatever the scene allows. If false, commands will be
/// checked against the scope of the other loads.
MotionScope find_motion_scope(const Scene& scene, const Structure& structure, Fidelity rung,
                              bool with_commands);

/// Returns the forces on all points [N] (3N) of a built-in load at amplitude 1. Each force and torque is
/// first rotated by `rotation`. Wrenches on groups are distributed over the points of the group
/// (THEORY 8.8).
Eigen::VectorXd load_forces(const Scene& scene, const Structure& structure, const Load& load,
                            const Eigen::Matrix3d& rotation);
/// Adds the forces of a group's wrench: F_i = (m_i / m_g) F_g + m_i (J_g^-1 T_g) x d_i
/// (THEORY 8.8, 8.9).
void add_wrench_forces(const Scene& scene, const Structure& structure, const Group& group,
                       const Eigen::Vector3d& force, const Eigen::Vector3d& torque, Eigen::VectorXd& forces);

}  // namespace freeflex
