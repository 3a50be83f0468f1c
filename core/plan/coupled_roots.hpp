// Eigenvalues of damped modes that a few forces couple.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <functional>

namespace freeflex {

/// Modes with what couples them: q'' + 2 decay q' + omega^2 q = out^T (by_q q + by_q_dot q')   (THEORY X77).
struct CoupledModes {
  Eigen::VectorXd omega, decay;         // [rad/s], [1/s] (n)
  Eigen::MatrixXd out, by_q, by_q_dot;  // (forces x n)
  // wheels: eigenvalues that are zero, of the body about its momentum, which need the dense problem
  bool is_gyroscopic = false;
};

/// An eigenvalue with its right and left eigenvectors, of any scale.
struct CoupledRoot {
  std::complex<double> s;               // [1/s]
  double error = 0.0;                   // [1/s] how far rounding may have moved it
  Eigen::VectorXcd q, q_dot;            // (n)
  Eigen::VectorXcd left_q, left_q_dot;  // (n)
};

/// Returns true when mode l has no stiffness at all: its displacement stays, with the eigenvalue zero.
bool is_loose(const CoupledModes& modes, Eigen::Index l);

/// Calls `take` once for each eigenvalue whose imaginary part is not negative. Leaves out the zero of each
/// loose mode. Returns false, with some or none of the calls made, where the eigenvalues are too many to be
/// computed or do not converge.
///
/// The determinant of the equations, divided by that of the uncoupled ones, is the determinant of a matrix of
/// the size of the forces (Sylvester). Its roots are found all at once by the iteration of Ehrlich (1967) and
/// Aberth (1973), each as a distance from the nearest uncoupled eigenvalue, so that light damping keeps its
/// digits. Where that costs more, a dense eigenvalue problem of up to kMostDenseModes modes is solved.
bool find_coupled_roots(const CoupledModes& modes, const std::function<void(const CoupledRoot&)>& take);

inline constexpr Eigen::Index kMostDenseModes = 300;

/// Returns true where the imaginary part of an eigenvalue is rounding.
inline bool is_real_root(std::complex<double> s) { return std::abs(s.imag()) <= 1e-10 * std::abs(s); }

}  // namespace freeflex
