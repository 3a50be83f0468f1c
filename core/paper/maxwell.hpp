// Maxwell (flexibility) coefficients by Mohr's integral, influence (stiffness) coefficients, and the
// conditions under which they exist (Alekseev 1970, section 5). THEORY 4.19, 11.19 to 11.27
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "core/structure/links/link_factor.hpp"

namespace freeflex {

/// Returns the unit forces p_il = (m_i / M) b_il [-] (3N x count)   (THEORY 11.19).
Eigen::MatrixXd unit_forces(const std::vector<PointMass>& points, const Eigen::MatrixXd& shapes);

/// Holds the forces in all links under given loads   (THEORY 11.21).
struct LinkStates {
  Eigen::MatrixXd natural;      // s, natural forces [N or N m per unit load] (num_natural x count)
  Eigen::MatrixXd multipliers;  // lambda, one for each row of LinkFactor::constraints (num_constraints x
                                // count)
  int num_redundant = 0;        // number of self-stresses of the elastic links; 0: statically determinate
};

/// Computes the forces in the links by the force method. They are the sum of forces that balance the loads f,
/// and of the self-stress that minimises the complementary energy sum s^2 / (2 D). Rigid links have 1 / D = 0
/// (THEORY 11.21 to 11.24):
///   B^T s + C^T lambda = f
/// \param loads [N] (3N x count) without resultant and moment
/// \pre the structure has no mechanism, or no load does work on a mechanism
LinkStates link_states(const LinkFactor& factor, int rigid_freedoms, const Eigen::MatrixXd& loads);

/// Maxwell and influence coefficients, if they exist.
struct Maxwell {
  std::optional<Eigen::MatrixXd> delta;  // [m/N] (n x n) q_l = sum_u delta_lu sigma_u   (THEORY 11.20)
  std::string delta_absence;             // reason why delta does not exist
  std::optional<Eigen::MatrixXd> c;      // [N/m] (n x n) (A b)^T (A b)   (THEORY 11.26)
  std::string c_absence;                 // reason why c does not exist
  int num_redundant = 0;                 // degree of static indeterminacy, if delta exists
};

/// Computes the Maxwell and influence coefficients of unit displacements b, which need not form a complete
/// basis   (THEORY 11.20, 11.25, 11.26):
///   delta_lu = sum_rows s_l s_u / D,   c = (A b)^T (A b)
/// with s_l the natural forces under the unit force p_l. For normal modes c is diagonal, c_ll = M omega_l^2
/// (THEORY 4.19). delta does not exist if the structure has a mechanism, and c does not exist if b stretches
/// a rigid link.
/// \param shapes  [-] (3N x n) free of rigid motion
Maxwell find_maxwell(const Scene& scene, const Structure& structure, const LinkFactor& factor,
                     const Eigen::MatrixXd& shapes);

/// Returns c = delta^-1 (THEORY 11.27), by a Cholesky factorization of delta scaled to a diagonal of ones.
/// \pre delta is positive definite
Eigen::MatrixXd influence_of(const Eigen::MatrixXd& delta);

}  // namespace freeflex
