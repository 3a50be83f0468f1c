// Small transverse motions of a straight free beam under tension, computed with Hermite elements and textbook
// matrices (Przemieniecki 1968, Theory of Matrix Structural Analysis, chapters 5, 11 and 15). This code
// shares nothing with the true-geometry reference, so it can check the reference.
#pragma once

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <complex>
#include <vector>

namespace freeflex::testing {

struct HermiteBeam {
  double EI = 1.0;       // [N m^2]
  double length = 1.0;   // [m] of each element
  Eigen::VectorXd mass;  // [kg] (elements + 1) on the nodes
  // true: consistent mass, so each element distributes the mass of one inner node over itself by its shape
  // functions; false: masses on the nodes
  bool is_consistent = false;
  // [N] at the nodes (elements + 1) for consistent mass, otherwise in the elements (elements)
  Eigen::VectorXd tension;
  double thrust = 0.0;  // [N] thrust at the first node, which follows the rotation of the node

  Eigen::Index num_elements() const { return mass.size() - 1; }
};

/// Returns K_G of an element under a tension that varies linearly along the element. K_G equals the integral
/// of N w' w'.
inline Eigen::Matrix4d geometric_stiffness(double first, double last, double L) {
  // three Gauss points integrate degree 5 exactly, which suffices because N has degree 1 and the squared
  // slopes have degree 4
  constexpr double points[] = {0.1127016653792583, 0.5, 0.8872983346207417};
  constexpr double weights[] = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
  Eigen::Matrix4d G = Eigen::Matrix4d::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    const double x = points[k];
    const Eigen::Vector4d slope((6.0 * x * x - 6.0 * x) / L, 1.0 - 4.0 * x + 3.0 * x * x,
                                (6.0 * x - 6.0 * x * x) / L, 3.0 * x * x - 2.0 * x);
    G += weights[k] * L * (first + x * (last - first)) * slope * slope.transpose();
  }
  return G;
}

/// Returns the squared frequencies [rad^2/s^2] in ascending order of magnitude, the two rigid motions first.
/// In flutter the squared frequencies are complex.
inline std::vector<std::complex<double>> squared_frequencies(const HermiteBeam& beam) {
  const Eigen::Index nodes = beam.mass.size(), size = 2 * nodes;
  const double L = beam.length;
  Eigen::Matrix4d bending, mass;
  bending << 12.0, 6.0 * L, -12.0, 6.0 * L, 6.0 * L, 4.0 * L * L, -6.0 * L, 2.0 * L * L,  //
      -12.0, -6.0 * L, 12.0, -6.0 * L, 6.0 * L, 2.0 * L * L, -6.0 * L, 4.0 * L * L;
  bending *= beam.EI / (L * L * L);
  mass << 156.0, 22.0 * L, 54.0, -13.0 * L, 22.0 * L, 4.0 * L * L, 13.0 * L, -3.0 * L * L,  //
      54.0, 13.0 * L, 156.0, -22.0 * L, -13.0 * L, -3.0 * L * L, -22.0 * L, 4.0 * L * L;
  mass *= beam.mass[1] / 420.0;
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(size, size), M = K;
  for (Eigen::Index k = 0; k < beam.num_elements(); ++k) {
    const double first = beam.tension[k], last = beam.is_consistent ? beam.tension[k + 1] : first;
    K.block<4, 4>(2 * k, 2 * k) += bending + geometric_stiffness(first, last, L);
    if (beam.is_consistent) M.block<4, 4>(2 * k, 2 * k) += mass;
  }
  // the transverse force of the thrust is the thrust times the rotation of its node
  K(0, 1) -= beam.thrust;
  Eigen::MatrixXd A;
  if (beam.is_consistent) {
    A = M.partialPivLu().solve(K);
  } else {
    // the rotations have no mass, so they are condensed
    const auto even = Eigen::seqN(0, nodes, 2), odd = Eigen::seqN(1, nodes, 2);
    const Eigen::MatrixXd Kww = K(even, even), Kwt = K(even, odd), Ktw = K(odd, even), Ktt = K(odd, odd);
    A = beam.mass.cwiseInverse().asDiagonal() * (Kww - Kwt * Ktt.partialPivLu().solve(Ktw));
  }
  const Eigen::VectorXcd values = Eigen::EigenSolver<Eigen::MatrixXd>(A).eigenvalues();
  std::vector<std::complex<double>> squares(values.begin(), values.end());
  std::sort(squares.begin(), squares.end(), [](auto a, auto b) { return std::abs(a) < std::abs(b); });
  return squares;
}

/// Returns a beam that a thrust at its first node accelerates along itself.
inline HermiteBeam hermite_rocket(double EI, double length, const Eigen::VectorXd& mass, double thrust,
                                  bool is_consistent) {
  HermiteBeam beam{EI, length, mass, is_consistent, {}, thrust};
  beam.tension.resize(beam.num_elements() + (is_consistent ? 1 : 0));
  double force = -thrust;
  for (Eigen::Index k = 0; k < beam.tension.size(); ++k) {
    // the tension jumps at each node by the inertial force of the mass of the node or, with consistent mass,
    // changes linearly over each element
    const double fraction = is_consistent ? (k == 0 ? 0.0 : 1.0 / static_cast<double>(beam.num_elements()))
                                          : mass[k] / mass.sum();
    force += thrust * fraction;
    beam.tension[k] = force;
  }
  return beam;
}

/// Returns a beam with masses on its nodes that spins about a transverse axis, for motions out of the plane
/// of spin.
inline HermiteBeam hermite_spinner(double EI, double length, const Eigen::VectorXd& mass, double spin) {
  HermiteBeam beam{EI, length, mass, false, Eigen::VectorXd::Zero(mass.size() - 1), 0.0};
  const Eigen::VectorXd at =
      Eigen::VectorXd::LinSpaced(mass.size(), 0.0, length * static_cast<double>(mass.size() - 1));
  const double centre = at.dot(mass) / mass.sum();
  for (Eigen::Index k = 0; k < beam.num_elements(); ++k)
    for (Eigen::Index i = k + 1; i < mass.size(); ++i)
      beam.tension[k] += mass[i] * spin * spin * (at[i] - centre);
  return beam;
}

}  // namespace freeflex::testing
