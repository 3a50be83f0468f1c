// Linearises a Cartesian system by finite differences of its accelerations. This gives the modes at rest, and
// the small motions about a steady motion under spin or thrust   (THEORY 10.25 to 10.27).
#pragma once

#include <Eigen/Core>
#include <string>

#include "tools/verification/reference/cartesian.hpp"

namespace freeflex {

/// The elastic modes of the system at rest, without loads and dissipation   (THEORY 10.25).
struct RestModes {
  Eigen::VectorXd omega;   // [rad/s] (n) ascending
  Eigen::MatrixXd shapes;  // [1/sqrt(kg)] (3N x n) psi with psi^T m psi = 1
};
RestModes rest_modes(const CartesianSystem& system);

/// Returns the stiffness [N/m] (3N x 3N) of undeformed links, K_rest of (THEORY 10.25).
/// \param system  the masses and rest positions of the points
Eigen::MatrixXd stiffness_at_rest(const TrueGeometry& links, const CartesianSystem& system);

/// Returns the strain energy of each link for displacements of a small factor [m] times `shape`, divided by
/// the square of this factor [J/m^2].
/// \param shape [-] (3N)
Eigen::VectorXd energies_of_mode(const CartesianSystem& system, const Eigen::VectorXd& shape);

/// A steady motion, in which the points are at rest in the carrier and have one common acceleration, and the
/// small motions exp(lambda t) about this steady motion, in the axes of the carrier   (THEORY 10.26, 10.27):
///   e''(e, e' = 0) = common acceleration
///   lambda^2 de = (de''/de + lambda de''/de') de
struct SteadyMotion {
  std::string error;             // empty if the motion was found
  Eigen::VectorXd e;             // [m] (3N) displacements in the carrier
  Eigen::Vector3d acceleration;  // [m/s^2] acceleration of the centre of mass, carrier axes
  double residual = 0.0;         // [m/s^2] largest difference of a point from the common acceleration
  Eigen::VectorXcd rates;        // [1/s] (num) lambda, ascending by absolute value
  Eigen::MatrixXcd shapes;       // (3N x num) displacements, a column for each rate
  // [1/s^2] (n x n) -de''/de in coordinates sqrt(m) e, orthogonal to the rigid motions
  Eigen::MatrixXd stiffness;
};

/// Finds the steady motion by Newton's method from displacements `start` [m] (3N). An empty `start` is the
/// rest shape. Loads have their values at t = 0, and the spin is the spin of the carrier.
SteadyMotion steady_motion(const CartesianSystem& system, const Eigen::VectorXd& start = {});

}  // namespace freeflex
