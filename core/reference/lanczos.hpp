// Functions of a symmetric matrix times a vector by Lanczos' method   (THEORY X116; Hochbruck and Lubich
// 1999).
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>

namespace freeflex {

/// Entire functions of h^2 A, written in x = h sqrt(A).
enum class WaveFunction {
  kCos,       // cos x
  kSinc,      // sin x / x
  kConstant,  // (1 - cos x) / x^2: response to a constant force
  kRising,    // (1 - sinc x) / x^2: response to a force that rises from zero
};

/// An orthonormal basis of the Krylov space of a start vector z, and A within it   (X116).
class LanczosSpace {
 public:
  using Apply = std::function<void(const double* from, double* to)>;  // to = A from

  /// A term that will be taken from the space, factor f(h sqrt A) z, and the error that it may have.
  struct Term {
    WaveFunction function;
    double factor, tolerance;
  };

  /// Builds the space until every term is within its tolerance, judged by its last two coefficients. Vectors
  /// are kept orthogonal to all before them when `is_reorthogonalised`, which pays when the space may fill
  /// the whole room. False when max_size vectors did not do.
  bool build(const Apply& apply, const Eigen::VectorXd& b, double h, std::span<const Term> terms,
             int max_size, bool is_reorthogonalised);

  /// sum += factor f(h sqrt A) z, from the space; h no larger than that of build.
  void add(WaveFunction function, double h, double factor, Eigen::VectorXd& sum) const;

  int num_applied() const { return num_applied_; }
  int size() const { return size_; }

 private:
  void diagonalise();
  Eigen::VectorXd coefficients(WaveFunction function, double h) const;

  double norm_ = 0.0;
  int size_ = 0, num_applied_ = 0;
  Eigen::MatrixXd basis_;              // (n x max_size)
  Eigen::VectorXd diagonal_, beside_;  // of the tridiagonal matrix
  Eigen::VectorXd root_;               // sqrt of its eigenvalues
  Eigen::MatrixXd vectors_;            // its eigenvectors
};

}  // namespace freeflex
