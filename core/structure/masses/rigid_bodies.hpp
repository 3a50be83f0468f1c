// The sets of points that turn as one body: points with an attitude, and the points of rigid links.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/faults.hpp"
#include "core/structure/links/link_factor.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

struct RigidBody {
  std::vector<int> points;                            // ascending
  double mass = 0.0;                                  // [kg]
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();   // [m] centre of mass from that of the structure
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  // [kg m^2] about the centre of mass
  // [-] unit vector along a rod: a body of point masses on one line, whose roll moves nothing; zero for other
  // bodies   (THEORY 12.118)
  Eigen::Vector3d line = Eigen::Vector3d::Zero();
};

/// Returns the bodies of a scene (THEORY 12.84), in the order of their lowest joined point. The ends of mass
/// matrices are bodies too, whose inertia is in the matrix (THEORY 12.119). Adds an error for a body that
/// cannot turn as a whole: bodies with inertia about two axes only, rods of three or more points that turn
/// beams, and bodies with mass at one point only. Bodies that share a point without attitude form a ball
/// joint; the point is in the lists of all of them, and they share its mass   (THEORY 12.123). Adds an error
/// for ball joints beside spread mass, mass matrices or feedback, or with a beam or plate that one of the
/// bodies turns.
std::vector<RigidBody> rigid_bodies(const Scene& scene, const Structure& structure, Faults& faults);

/// Returns the number of ball joints: for each point the number of its bodies less one.
int num_ball_joints(const Scene& scene, const Structure& structure);

/// Returns the unit motions of the modes at a body (6 x num modes): displacement of its centre of mass [-],
/// then its rotation [1/m]. The rotation is that of its first point with an attitude or at the end of a mass
/// matrix, otherwise that which fits its points best.
Eigen::MatrixXd motions_of(const Scene& scene, const Structure& structure, const Freedoms& freedoms,
                           const RigidBody& body);

}  // namespace freeflex
