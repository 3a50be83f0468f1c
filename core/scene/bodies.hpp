// Bodies with inertia, massless points and links with mass.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/scene.hpp"

namespace freeflex {

/// Returns whether the point has inertia or an offset, so that its attitude is among the freedoms
/// (THEORY 16.1).
bool has_attitude(const PointMass& point);

/// Returns whether the scene has only point masses. In such a scene all points have mass, none has inertia or
/// an offset, and no link has mass.
bool are_point_masses(const Scene& scene);

/// Returns the second moment of the mass of a body about its centre, Pi = (tr J) / 2 1 - J [kg m^2]
/// (THEORY 16.3).
Eigen::Matrix3d second_moment(const PointMass& point);

/// Holds one part of the mass of a link. The position of the part is the weighted mean of the positions of
/// some points of the link, plus an arm (THEORY 16.10).
struct DistributedMass {
  int link = -1;
  double mass = 0.0;                              // [kg] > 0
  std::vector<std::pair<int, double>> shares;     // (point, weight [-]); the weights add up to 1
  Eigen::Vector3d arm = Eigen::Vector3d::Zero();  // [m] of a superelement: from its first point to the part;
                                                  // else zero
};

/// Returns the parts of the mass of all links, in the order of the links. The parts of consistent mass are at
/// the Gauss points of beams and bars and at Dunavant's points of plates, because these points integrate the
/// squares of the deformation shapes exactly. A superelement has four parts at the corners of its rigid body
/// (THEORY 16.4). \pre all points of links exist, and place_lumped_masses() was called
std::vector<DistributedMass> distributed_masses(const Scene& scene);
/// Returns the parts of the mass of one link.
std::vector<DistributedMass> distributed_masses(const Scene& scene, int link);

/// Returns whether a link is a superelement with a mass matrix. The motion inside such a link is unknown
/// (THEORY 16.17).
bool has_mass_matrix(const Link& link);

/// Returns whether a link is a superelement with a mass matrix and rotations on one point, so that its rigid
/// body turns with this point.
bool moves_with_its_point(const Link& link);

/// Returns, for each point, whether a mass matrix gives its rotation mass   (THEORY 12.119).
std::vector<bool> points_with_rotary_mass(const Scene& scene);

/// Returns whether a link has mass.
bool has_mass(const Link& link);
/// Returns how the mass of a link is distributed. Returns kConsistent for links without mass.
MassDistribution mass_distribution_of(const Link& link);

/// Moves the lumped mass of links to their points, in equal parts. Such links have no mass afterwards. A part
/// on a body with an offset moves the centre of mass of the body towards the point and adds to its inertia.
/// \pre all points of links exist
void place_lumped_masses(Scene& scene);

/// Returns for each point whether its motion moves mass: its own, that of a link, or that of a body to which
/// a rigid link joins it.
std::vector<bool> points_that_move_mass(const Scene& scene);

/// Returns the mass of a link [kg]. Returns 0 if the link has no mass.
double mass_of(const Scene& scene, const Link& link);

/// Returns the rigid body that has the same mass matrix as a superelement in rigid motion   (THEORY 16.18):
/// mass, inertia, and offset from its first point.  \pre a matrix link with mass
PointMass rigid_body_of(const Scene& scene, const Link& link);

/// Returns the reason why the mass matrix of a superelement is invalid, or is not that of a single body in
/// rigid motion. Returns an empty string if rigid_body_of gives such a body.
std::string mass_matrix_problem(const Scene& scene, const Link& link);

/// Returns four positions [m] relative to the point of a body. Four particles at these positions, each with a
/// quarter of the mass of the body, have the centre of mass and the inertia of the body   (THEORY 16.4).
std::array<Eigen::Vector3d, 4> corners_of(const PointMass& body);

/// Returns an empty string if a symmetric matrix is an inertia, otherwise the reason why it is not. A matrix
/// is not an inertia if a principal moment is negative or above the sum of the two others   (THEORY 16.3).
std::string inertia_problem(const Eigen::Matrix3d& inertia);

}  // namespace freeflex
