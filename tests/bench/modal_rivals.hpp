// What other libraries make of the same structure, assembled: Spectra and ARPACK over CHOLMOD's supernodal
// factor.
#pragma once

#include <Eigen/Core>
#include <string>

#include "core/scene/scene.hpp"

namespace freeflex::testing {

/// One rival's answer; no frequencies: it failed, and says why.
struct RivalModes {
  std::string name, problem;
  Eigen::VectorXd omega;  // [rad/s] rising, the six rigid motions left out
  double seconds = 0.0;   // from points and springs on, of the wall clock
};

/// Rivals that this program was built with, on springs and point masses alone.
/// \param shift  [rad^2/s^2] they factor K + shift M
std::vector<RivalModes> run_modal_rivals(const Scene& scene, int count, double shift);

}  // namespace freeflex::testing
