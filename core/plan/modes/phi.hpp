// The phi-functions of a matrix advance a linear system by one step under a load that is linear in time.
#pragma once

#include <Eigen/Core>
#include <cassert>
#include <cmath>
#include <limits>

namespace freeflex {

using WideMatrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

/// Holds phi_0 = exp(z), phi_1 = (phi_0 - 1) / z, phi_2 = (phi_1 - 1) / z
/// (THEORY 8.33; Hochbruck and Ostermann 2010).
template <typename Matrix>
struct PhiOf {
  Matrix phi0, phi1, phi2;
};
using Phi = PhiOf<WideMatrix>;

/// Returns the phi-functions by the series of z / 2^s and s doublings   (THEORY 8.33). The relative error is
/// some 2^s rounding errors. For 64-bit mantissas this is 2^s 1e-19. Returns NaN if z is so large that no
/// digit would be correct.
/// \pre z is square
template <typename Matrix>
PhiOf<Matrix> phi_functions(const Matrix& z) {
  assert(z.rows() == z.cols());
  using Scalar = typename Matrix::Scalar;
  constexpr Scalar kSmall{0.5};
  constexpr int kTerms = 17;  // 0.5^17 / 19! is far below the rounding error
  const Matrix one = Matrix::Identity(z.rows(), z.rows());
  const Scalar norm = z.size() > 0 ? z.cwiseAbs().colwise().sum().maxCoeff() : Scalar{0};
  PhiOf<Matrix> phi;
  if (!(norm < std::ldexp(Scalar{1}, std::numeric_limits<Scalar>::digits))) {
    phi.phi0 = phi.phi1 = phi.phi2 =
        Matrix::Constant(z.rows(), z.cols(), std::numeric_limits<Scalar>::quiet_NaN());
    return phi;
  }
  const int doublings = norm > kSmall ? static_cast<int>(std::ceil(std::log2(norm / kSmall))) : 0;
  const Matrix x = z * std::ldexp(Scalar{1}, -doublings);
  // phi_2 = sum x^k / (k + 2)!, smallest terms first
  phi.phi2 = one;
  for (int k = kTerms; k > 0; --k) phi.phi2 = one + x * phi.phi2 / static_cast<Scalar>(k + 2);
  phi.phi2 *= Scalar{0.5};
  phi.phi1 = one + x * phi.phi2;
  phi.phi0 = one + x * phi.phi1;
  for (int k = 0; k < doublings; ++k) {
    phi.phi2 = Scalar{0.25} * (phi.phi0 * phi.phi2 + phi.phi1 + phi.phi2).eval();
    phi.phi1 = Scalar{0.5} * (phi.phi0 * phi.phi1 + phi.phi1).eval();
    phi.phi0 = (phi.phi0 * phi.phi0).eval();
  }
  return phi;
}

}  // namespace freeflex
