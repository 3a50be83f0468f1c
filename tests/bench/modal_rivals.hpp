// These functions compute modes of the same assembled structure with other libraries, namely Spectra and
// ARPACK with CHOLMOD's supernodal factor.
#pragma once

#include <Eigen/Core>
#include <string>

#include "core/scene/scene.hpp"

namespace freeflex::testing {

/// Modes found by one rival. If the rival fails, `omega` is empty and `problem` gives the cause.
struct RivalModes {
  std::string name, problem;
  Eigen::VectorXd omega;  // [rad/s] ascending, without the six rigid motions
  double seconds = 0.0;   // wall-clock time from points and springs to the modes
};

/// Runs Spectra and ARPACK. The scene may contain only springs and point masses.
/// \param shift  [rad^2/s^2] the rivals factor the matrix K + shift M
std::vector<RivalModes> run_modal_rivals(const Scene& scene, int count, double shift);

}  // namespace freeflex::testing
