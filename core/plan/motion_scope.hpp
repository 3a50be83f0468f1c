// How a scene can move at all: whether its body turns, and whether it stays in a plane.
#pragma once

#include <Eigen/Core>
#include <string>

#include "core/structure/structure.hpp"

namespace freeflex {

/// What the initial state, built-in loads, fields and commands of a scene can do   (THEORY X121, X122).
struct MotionScope {
  bool turns = true;           // false: nothing turns the body, its attitude is the initial one
  bool is_planar = false;      // true: points, loads, spin and so the motion stay in one plane
  std::string why_turns;       // what may turn it, or why nothing does
  std::string why_not_planar;  // the same of the plane
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();    // [-] of the plane, body axes
  Eigen::Matrix3d R_WB = Eigen::Matrix3d::Identity();  // initial attitude
  bool takes_spin_load = false;                        // the rung loads the modes by the spin   (X70)
  // only what commands do not do makes it so: they must be held to it
  bool binds_rotation = false, binds_plane = false;
};

/// \param rung           that the plan will be on
/// \param with_commands  true: commands may do whatever the scene lets them; false: they will be held to what
/// the rest leaves open
MotionScope find_motion_scope(const Scene& scene, const Structure& structure, Fidelity rung,
                              bool with_commands);

/// Force on every point [N] (3N) that a built-in load makes at amplitude 1, each force and torque of it first
/// turned by `turn`: those of groups spread over their points   (THEORY X12).
Eigen::VectorXd load_forces(const Scene& scene, const Structure& structure, const Load& load,
                            const Eigen::Matrix3d& turn);
/// The same of one wrench.
void add_wrench_forces(const Scene& scene, const Structure& structure, const Group& group,
                       const Eigen::Vector3d& force, const Eigen::Vector3d& torque, Eigen::VectorXd& forces);

}  // namespace freeflex
