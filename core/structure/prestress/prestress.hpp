// The geometric stiffness of the lowest modes due to internal forces.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/scene/scene.hpp"

namespace freeflex {

/// The geometric stiffness of the lowest modes due to internal forces. It is given for pairs (l, u) of modes,
/// per elastic coordinate: E_lu = sum_v rows(pair, v) q_v   (THEORY X140).
struct Prestress {
  using Pair = std::array<int, 2>;
  /// (l, l) of the lowest modes in order, then every (l, u) of the lowest num_shadowed modes, then pairs of
  /// modes with nearly equal frequencies.
  std::vector<Pair> pairs;
  int num_modes = 0;          // number of pairs (l, l)
  int num_shadowed = 0;       // number of modes whose error is integrated
  Eigen::MatrixXd rows;       // [N/m^2] (pairs x n) due to all links except matrices and rigid links
  Eigen::MatrixXd bent_rows;  // [N/m^2] (pairs x n) due to the same links except springs, bars and dashpots
  // [N s/m^2] (pairs x n) per rate of an elastic coordinate, from dashpots and viscous links; bent_rate_rows
  // omits axial links
  Eigen::MatrixXd rate_rows, bent_rate_rows;
  // This flag is true if the second order of some links is unknown (matrices, rigid links, the bow of plates)
  bool has_unquantified = false;
  // [sqrt(N/m^3)] (num_modes) sqrt(beta_l): if the other modes are in equilibrium, the displacement q of mode
  // l adds the stiffness beta_l q^2 (THEORY X146); bent_root_quartic omits springs, bars and dashpots
  Eigen::VectorXd root_quartic, bent_root_quartic;
  // [sqrt(N)/m^2] ((forms num_shadowed) x num_shadowed) quartic_forms() of the modes whose error is
  // integrated, with the other modes in equilibrium; bent_quartic omits springs, bars and dashpots
  Eigen::MatrixXd quartic, bent_quartic;
};

struct LinkFactor;
struct Structure;
/// Returns the geometric stiffness of a structure.  \pre structure.omega and shapes are filled;
/// factor.recovery is filled
Prestress find_prestress(const Scene& scene, const LinkFactor& factor, const Structure& structure);

/// Transforms the geometric stiffness for new modes b <- b rotation, which replace the modes from `first` on.
void rotate_prestress(const Eigen::MatrixXd& rotation, int first, Prestress& prestress);

}  // namespace freeflex
