// Maxwell (flexibility) coefficients by Mohr's integral, influence (stiffness) coefficients, and when each
// exists (Alekseev 1970, section 5).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "core/structure/link_factor.hpp"

namespace freeflex {

/// Unit forces p_il = (m_i / M) b_il   (THEORY 5.1) [-] (3N x count).
Eigen::MatrixXd unit_forces(const std::vector<PointMass>& points, const Eigen::MatrixXd& shapes);

/// Stressed states of all links under given loads.
struct LinkStates {
  Eigen::MatrixXd natural;      // s, [N or N m per unit load] (num_natural x count)
  Eigen::MatrixXd multipliers;  // of the rows of LinkFactor::constraints (num_constraints x count)
  int num_redundant = 0;        // self-stresses of the elastic links beside the rigid ones; 0: determinate
};

/// States by the force method: any that balances the loads, plus the self-stress with which the
/// complementary energy, half the sum of s^2 / D, is least; rigid links have 1 / D = 0   (THEORY X88).
/// \param loads [N] (3N x count) free of resultant and moment
/// \pre the structure has no mechanism, or no load does work on one
LinkStates link_states(const LinkFactor& factor, int rigid_freedoms, const Eigen::MatrixXd& loads);

/// What there is of both kinds of coefficients, and the condition that the other fails.
struct Maxwell {
  std::optional<Eigen::MatrixXd> delta;  // [m/N] (n x n) Mohr's integral   (THEORY 5.4, X89)
  std::string delta_absence;             // why not
  std::optional<Eigen::MatrixXd> c;      // [N/m] (n x n) (A b)^T (A b)   (THEORY 5.5, X90)
  std::string c_absence;                 // why not
  int num_redundant = 0;                 // degree of static indeterminacy, where delta exists
};

/// Coefficients of unit displacements b, which need not be complete. delta is absent when a mechanism takes
/// part, c when a rigid link would be stretched   (THEORY X88-X90).
/// \param shapes  [-] (3N x n) free of rigid motion
Maxwell find_maxwell(const Scene& scene, const Structure& structure, const LinkFactor& factor,
                     const Eigen::MatrixXd& shapes);

/// c = delta^-1   (THEORY 5.5) by Cholesky, scaled to a diagonal of ones first.  \pre delta positive definite
Eigen::MatrixXd influence_of(const Eigen::MatrixXd& delta);

}  // namespace freeflex
