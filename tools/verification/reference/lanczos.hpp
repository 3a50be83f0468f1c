// This code computes functions of a symmetric matrix times a vector by Lanczos' method
// (THEORY 13.14; Hochbruck and Lubich 1999).
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>

namespace freeflex {

/// Entire functions f of h^2 A, written in x = h sqrt(A)   (THEORY 13.13).
enum class WaveFunction {
  kCos,       // cos x
  kSinc,      // sin x / x
  kConstant,  // (1 - cos x) / x^2: response to a constant force
  kRising,    // (1 - sinc x) / x^2: response to a force that rises from zero
};

/// An orthonormal basis Y_k of the Krylov space of a start vector z, and the tridiagonal matrix T_k. T_k is A
/// in this basis (THEORY 13.14):
///   f(A) z = |z| Y_k f(T_k) e_1
class LanczosSpace {
 public:
  using Apply = std::function<void(const double* from, double* to)>;  // to = A from

  /// A term factor f(h sqrt(A)) z that will be computed in the space, with the tolerance of its error.
  struct Term {
    WaveFunction function;
    double factor, tolerance;
  };

  /// Builds the space from the start vector z = b until the last two coefficients of every term are within
  /// the tolerance of the term. Returns false if max_size vectors are not enough. If `is_reorthogonalised`,
  /// each vector is made orthogonal to all vectors before it. Reorthogonalisation is worth its cost if the
  /// Krylov space may become the whole space.
  bool build(const Apply& apply, const Eigen::VectorXd& b, double h, std::span<const Term> terms,
             int max_size, bool is_reorthogonalised);

  /// Adds factor f(h sqrt(A)) z to `sum`.  \pre h is at most the h given to `build`
  void add(WaveFunction function, double h, double factor, Eigen::VectorXd& sum) const;

  int num_applied() const { return num_applied_; }
  int size() const { return size_; }

 private:
  void diagonalise();
  Eigen::VectorXd coefficients(WaveFunction function, double h) const;

  double norm_ = 0.0;
  int size_ = 0, num_applied_ = 0;
  Eigen::MatrixXd basis_;                    // (n x max_size)
  Eigen::VectorXd diagonal_, off_diagonal_;  // of the tridiagonal matrix
  Eigen::VectorXd root_;                     // square roots of the eigenvalues of the tridiagonal matrix
  Eigen::MatrixXd vectors_;                  // eigenvectors of the tridiagonal matrix
};

}  // namespace freeflex
