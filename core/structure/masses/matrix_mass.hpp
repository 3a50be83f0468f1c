// Mass matrices as masses on points and bodies, for sums over the mass   (THEORY 12.120, 12.121).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/structure/links/link_factor.hpp"
#include "core/structure/masses/particles.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// Particles whose displacements are linear in the coordinates. The mass of some may be negative, because
/// sums over pairs of modes are differences (THEORY 12.121).
struct LinearParticles {
  Eigen::VectorXd mass;  // [kg] (P)
  Eigen::Matrix3Xd r;    // [m] (3 x P) rest positions from the centre of mass of the structure
  Eigen::MatrixXd b;     // [-] (3P x num modes)
};

/// Holds the mass of a superelement: masses on its points, and the rest, which moves like a body and deforms.
struct MatrixMass {
  int link = -1;
  bool is_on_point = false;  // true: the rest is part of the body at its only point
  double mass = 0.0;         // [kg] of the rest; 0: there is none
  Eigen::Vector3d centre;    // [m] of mass of the rest, from that of the structure
  Eigen::Matrix3d inertia;   // [kg m^2] of the rest about its centre of mass, scene axes
  Eigen::MatrixXd motion;    // (6 x num modes) mean displacement of the rest, and its rotation [1/m]
  LinearParticles beyond;    // masses on points, and what of the rest is not in a body
  // [kg m] (6 x num modes) Y_l of the deformation of the rest, as xx, yy, zz, xy, xz, yz
  Eigen::MatrixXd moments;
};

/// Returns the mass of each superelement that has a mass matrix.
/// \param turns  true: the rest is a body that turns by any angle; false: all mass is in particles
/// \pre shapes and rotations of the structure are filled
std::vector<MatrixMass> matrix_masses(const Scene& scene, const Structure& structure, bool turns);

/// Returns Structure::matrix_sums   (THEORY 16.19, 16.20).  \pre structure.shapes and rotations are filled
MatrixSums matrix_sums(const Scene& scene, const Freedoms& freedoms, const Structure& structure);

/// Returns the data for terms of second order in the rotation of the rest (THEORY 12.46), about its centre or
/// about the point that it turns with.
RotatingBody rotating_body(const Scene& scene, const Structure& structure, const MatrixMass& matrix);

}  // namespace freeflex
