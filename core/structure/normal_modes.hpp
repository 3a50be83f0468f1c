// Normal modes from rows in factor form over the complement of all that does not vibrate.
#pragma once

#include "core/structure/eckart_complement.hpp"

namespace freeflex {

struct NormalModes {
  Eigen::VectorXd omega;      // [rad/s] (n) ascending, mechanisms first with exactly zero
  Eigen::MatrixXd motions;    // (freedoms x n) unit elastic motions b, b^T M b = mass
  double accuracy = 0.0;      // [-] relative, of the lowest nonzero frequency
  double conditioning = 0.0;  // [-] omega_max / omega_min over nonzero modes
};

/// Singular values of A L^-T H   (THEORY X52). \param rows  [sqrt(N/m)] A over the freedoms of the complement
NormalModes normal_modes(const Eigen::MatrixXd& rows, const EckartComplement& complement);

/// Turns the sign of each column so that of the components near the largest the first is positive; \return
/// the signs, 1 or -1 (n)   (THEORY X52)
Eigen::VectorXd fix_signs(Eigen::MatrixXd& shapes);

}  // namespace freeflex
