// phi-functions of a matrix: what carries a linear system with a load linear in time over one step.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace freeflex {

using WideMatrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

/// phi_0 = e^z, phi_1 = (phi_0 - 1) / z, phi_2 = (phi_1 - 1) / z   (THEORY X75; Hochbruck and Ostermann
/// 2010).
struct Phi {
  WideMatrix phi0, phi1, phi2;
};

/// By the series of z / 2^s and s doublings, in 64-bit mantissas: relative error some 2^s 1e-19.  \pre z is
/// square
inline Phi phi_functions(const WideMatrix& z) {
  constexpr long double kSmall = 0.5L;
  constexpr int kTerms = 17;  // 0.5^17 / 19! is far below a rounding
  const WideMatrix one = WideMatrix::Identity(z.rows(), z.rows());
  const long double norm = z.size() > 0 ? z.cwiseAbs().colwise().sum().maxCoeff() : 0.0L;
  const int doublings = norm > kSmall ? static_cast<int>(std::ceil(std::log2(norm / kSmall))) : 0;
  const WideMatrix x = z * std::ldexp(1.0L, -doublings);
  // phi_2 = sum x^k / (k + 2)!, from the small end
  Phi phi;
  phi.phi2 = one;
  for (int k = kTerms; k > 0; --k) phi.phi2 = one + x * phi.phi2 / static_cast<long double>(k + 2);
  phi.phi2 *= 0.5L;
  phi.phi1 = one + x * phi.phi2;
  phi.phi0 = one + x * phi.phi1;
  for (int k = 0; k < doublings; ++k) {
    phi.phi2 = 0.25L * (phi.phi0 * phi.phi2 + phi.phi1 + phi.phi2).eval();
    phi.phi1 = 0.5L * (phi.phi0 * phi.phi1 + phi.phi1).eval();
    phi.phi0 = (phi.phi0 * phi.phi0).eval();
  }
  return phi;
}

}  // namespace freeflex
