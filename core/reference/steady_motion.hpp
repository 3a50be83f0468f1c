// Linearisation of a Cartesian system by differences of its accelerations: modes at rest, and motion beside a
// steady one, spin or thrust   (THEORY X158).
#pragma once

#include <Eigen/Core>
#include <string>

#include "core/reference/cartesian.hpp"

namespace freeflex {

/// Modes of the system at rest without loads and dissipation, less its rigid motions.
struct RestModes {
  Eigen::VectorXd omega;   // [rad/s] (n) ascending
  Eigen::MatrixXd shapes;  // [1/sqrt(kg)] (3N x n) sum m b.b = 1
};
RestModes rest_modes(const CartesianSystem& system);

/// Stiffness [N/m] (3N x 3N) of links at rest.  \param system  masses and places
Eigen::MatrixXd stiffness_at_rest(const TrueGeometry& links, const CartesianSystem& system);

/// Strain energy of each link [J/m^2] in a small displacement of this shape, over the square of its size.
/// \param shape (3N)
Eigen::VectorXd energies_of_mode(const CartesianSystem& system, const Eigen::VectorXd& shape);

/// A motion in which nothing moves in the carrier but by one acceleration common to all, and small motions
/// beside it: rates exp(s t) in the carrier's axes.
struct SteadyMotion {
  std::string error;             // empty: found
  Eigen::VectorXd e;             // [m] (3N) displacements in the carrier
  Eigen::Vector3d acceleration;  // [m/s^2] of the centre of mass, carrier axes
  double residual = 0.0;         // [m/s^2] largest acceleration beside the common one
  Eigen::VectorXcd rates;        // [1/s] (num) by size
  Eigen::MatrixXcd shapes;       // (3N x num) displacements that go with them
  Eigen::MatrixXd stiffness;     // [1/s^2] (n x n) -J over the displacements that are no rigid motion
};

/// Finds it by Newton's method from displacements `start` [m] (3N), none: from the shape at rest. Loads as
/// they are at t = 0, spin as the carrier's.
SteadyMotion steady_motion(const CartesianSystem& system, const Eigen::VectorXd& start = {});

}  // namespace freeflex
