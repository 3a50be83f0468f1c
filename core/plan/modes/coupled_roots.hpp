// Eigenvalues of damped modes that are coupled by a few forces.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <functional>

namespace freeflex {

/// Holds modes and the forces that couple them: q'' + 2 decay q' + omega^2 q = out^T (by_q q + by_q_dot q')
/// (THEORY 8.42; out^T is U, by_q is W_q, by_q_dot is W_v).
struct CoupledModes {
  Eigen::VectorXd omega, decay;         // [rad/s], [1/s] (n)
  Eigen::MatrixXd out, by_q, by_q_dot;  // (forces x n) U^T, W_q, W_v
  // True if there are wheels. The rotation of the body about its momentum then has zero eigenvalues, and only
  // the dense problem finds zero eigenvalues.
  bool is_gyroscopic = false;
};

/// Holds an eigenvalue with its right and left eigenvectors, which may have any scale.
struct CoupledRoot {
  std::complex<double> s;               // [1/s] eigenvalue
  double error = 0.0;                   // [1/s] rounding error of s
  Eigen::VectorXcd q, q_dot;            // (n) right eigenvector
  Eigen::VectorXcd left_q, left_q_dot;  // (n) left eigenvector
};

/// Returns true if mode l has no stiffness, neither of its own nor from the coupling forces. The displacement
/// of such a mode is then free, and one of its eigenvalues is zero.
bool is_zero_frequency(const CoupledModes& modes, Eigen::Index l);

/// Calls `take` once for each eigenvalue whose imaginary part is not negative. Omits the zero eigenvalue of
/// each zero-frequency mode. Returns false, without any call, if there are too many eigenvalues to compute or
/// if they do not converge.
///
/// The determinant of the coupled equations, divided by the determinant of the uncoupled equations, is the
/// determinant of a small matrix (forces x forces) (Sylvester):
///   det(1 - (by_q + s by_q_dot) D(s) out^T) = 0, D(s)_ll = 1 / (s^2 + 2 decay_l s + omega_l^2)
///     (THEORY 8.43).
/// The iteration of Ehrlich (1967) and Aberth (1973) finds all roots of this equation together, each as its
/// distance from the nearest uncoupled eigenvalue, so that light damping keeps its digits. If the dense
/// eigenvalue problem costs less, the dense problem is solved instead, for up to kMostDenseModes modes.
bool find_coupled_roots(const CoupledModes& modes, const std::function<void(const CoupledRoot&)>& take);

inline constexpr Eigen::Index kMostDenseModes = 300;

/// Returns true if the imaginary part of an eigenvalue is a rounding error.
inline bool is_real_root(std::complex<double> s) { return std::abs(s.imag()) <= 1e-10 * std::abs(s); }

}  // namespace freeflex
