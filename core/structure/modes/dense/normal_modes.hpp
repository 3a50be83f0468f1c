// Normal modes from rows in factor form over the Eckart complement.
#pragma once

#include "core/structure/modes/dense/eckart_complement.hpp"

namespace freeflex {

struct NormalModes {
  Eigen::VectorXd omega;      // [rad/s] (n) ascending, mechanisms first with exactly zero
  Eigen::MatrixXd motions;    // (freedoms x n) unit elastic motions b, b^T m b = M
  double accuracy = 0.0;      // [-] relative accuracy of the lowest nonzero frequency
  double conditioning = 0.0;  // [-] omega_max / omega_min over nonzero modes
};

/// Returns the normal modes from the singular values of A L^-T H   (THEORY 4.8, 4.9).
/// \param rows  [sqrt(N/m)] A over the freedoms of the complement
NormalModes normal_modes(const Eigen::MatrixXd& rows, const EckartComplement& complement);

/// Chooses the sign of each column. The first of those components that have the largest magnitude, within
/// 1e-6, becomes positive (THEORY 4.9).
/// \return the signs applied, 1 or -1 (n)
Eigen::VectorXd fix_signs(Eigen::MatrixXd& shapes);

}  // namespace freeflex
