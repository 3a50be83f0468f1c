// Mass that is more than point masses: bodies with inertia, massless points, mass of links.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/scene.hpp"

namespace freeflex {

/// True of a body: its attitude counts among the freedoms, for it has inertia or an offset   (THEORY X160).
bool has_attitude(const PointMass& point);

/// True when point masses are all that there is: points with mass and nothing else, links without.
bool are_point_masses(const Scene& scene);

/// Second moment of the mass about its own centre, S = (tr J) / 2 - J [kg m^2]   (THEORY X160).
Eigen::Matrix3d second_moment(const PointMass& point);

/// A part of the mass of a link, which stands and moves between points as their shares say   (THEORY X164).
struct SpreadMass {
  int link = -1;
  double mass = 0.0;                              // [kg] > 0
  std::vector<std::pair<int, double>> shares;     // (point, share) [-] sum 1
  Eigen::Vector3d arm = Eigen::Vector3d::Zero();  // [m] of a superelement, from its first point
};

/// Where the mass of links counts as standing, in the order of the links: at Gauss's points of beams and
/// bars, Dunavant's of plates, for which squares of their shapes are exact, at the points where it is lumped.
/// \pre links with their points
std::vector<SpreadMass> spread_masses(const Scene& scene);
/// The same of one link.
std::vector<SpreadMass> spread_masses(const Scene& scene, int link);

/// True of a superelement whose mass is a matrix: how its inside moves is not known   (THEORY X166).
bool has_mass_matrix(const Link& link);

/// True of a link that has mass, and how that is spread.
bool has_mass(const Link& link);
MassSpread spread_of(const Link& link);

/// The mass of a link [kg]; 0 of one that has none.
double mass_of(const Scene& scene, const Link& link);

/// The body that the mass matrix of a superelement is in rigid motion   (THEORY X166): mass, and inertia and
/// offset from its first point.  \pre a matrix link with mass
PointMass rigid_body_of(const Scene& scene, const Link& link);

/// What keeps that matrix from being the mass of a body. Empty: nothing.
std::string mass_matrix_problem(const Scene& scene, const Link& link);

/// Four particles that have the mass, centre and inertia of a body, places from its point   (THEORY X160).
std::array<Eigen::Vector3d, 4> corners_of(const PointMass& body);

/// What keeps a symmetric matrix from being an inertia: a negative moment, one above the sum of the two
/// others. Empty: nothing.
std::string inertia_problem(const Eigen::Matrix3d& inertia);

}  // namespace freeflex
