// Unit elastic displacements by every recipe of the paper, and by two more (Alekseev 1970, sections 3, 6, 7).
// THEORY 2.15, 4.2, 4.3, 11.4, 11.11 to 11.15, 11.28, 11.29
#pragma once

#include <string>
#include <vector>

#include "core/paper/force_groups.hpp"
#include "core/structure/link_factor.hpp"

namespace freeflex {

/// A choice of force groups that are independent of each other and of the forces in rigid links. The
/// remainder of a group is its part orthogonal to the vectors before it, as a fraction of the norm of the
/// group.
struct Choice {
  std::vector<int> kept;      // indices of groups, in the order in which they were taken
  std::vector<int> skipped;   // indices of groups that are combinations of kept groups
  double least_kept = 1.0;    // [-] smallest remainder of a kept group
  double most_skipped = 0.0;  // [-] largest remainder of a skipped group
};

/// Unit elastic displacements b, orthonormal in the mass metric, without rigid motion and without motion that
/// rigid links forbid (THEORY 2.15, 4.3):
///   sum m b_l.b_u = M [l = u],   sum m b_l = 0,   sum m r x b_l = 0,   C b_l = 0
struct Basis {
  Recipe recipe = Recipe::kModes;
  Eigen::MatrixXd shapes;  // b, [-] (3N x rank)
  int num_expected = 0;    // n = 3N - rigid freedoms - constraints; the basis is complete if rank == n

  // the members from numbering to flat_window are filled only for recipes with force groups
  std::vector<int> numbering;  // order in which the points were taken
  int rank_as_numbered = 0;    // rank with the numbering of the scene
  Choice choice;               // vector l comes from group choice.kept[l]
  // gamma_ul, [N] (rank x num_groups) beta_l = sum_u b_u gamma_ul   (THEORY 11.11)
  Eigen::MatrixXd coefficients;
  // This member is filled only if the basis is incomplete. It lists successive points at one position, on one
  // line or in one plane
  std::vector<int> flat_window;

  double gram_error = 0.0;           // [-] max |sum m b_l.b_u / M - [l = u]|
  double force_residual = 0.0;       // [-] max |sum m b| / sum m |b|   (THEORY 11.28)
  double moment_residual = 0.0;      // [-] max |sum m r x b| / sum m |r| |b|   (THEORY 11.28)
  double constraint_residual = 0.0;  // [-] max |C b| / (sqrt(M) |C m^-1/2|)   (THEORY 11.29)

  Eigen::Index rank() const { return shapes.cols(); }
  bool is_complete() const { return rank() == num_expected; }
};

/// A group is a combination of the vectors before it if its remainder [-] is at most this limit. The limit is
/// far above rounding errors, about 1e-15. The limit is far below the remainder of any group whose window of
/// successive points is not flat (THEORY 11.10, 11.12).
inline constexpr double kDependent = 1e-11;

/// Takes groups in their order. The remainders are remainders of forces, without the mass metric. If masses
/// differ by a factor of 1e12, the contribution of a group in the mass metric may be below rounding errors
/// (THEORY 11.12).
/// \param constraints  [-] C (num x 3N) LinkFactor::constraints  \param groups  [N] (3N x num_groups)
Choice independent_groups(const Eigen::MatrixXd& constraints, const Eigen::MatrixXd& groups);

/// Takes the 3N unit loads of the formal recipe. The next load is always the one with the largest remainder
/// in the mass metric, as a fraction of the whole load. Therefore the last load also has a large remainder,
/// for any masses (THEORY 11.4, 11.12).
Choice independent_loads(const std::vector<PointMass>& points, const MassProperties& properties,
                         const Eigen::MatrixXd& constraints);

/// Makes unit elastic displacements from force groups by Gram-Schmidt in the mass metric, with at least two
/// passes. The rigid motions and m^-1 C^T come first, where C are the constraints   (THEORY 4.2, 11.12):
///   beta = (M / m) f,   y = sqrt(m) beta - sum_k v_k (v_k.sqrt(m) beta),   b = sqrt(M) m^-1/2 y / |y|
/// Fills shapes, choice and coefficients. The cost is O(N n^2).
/// \param groups  [N] (3N x num_groups)
Basis orthonormalise(const std::vector<PointMass>& points, const MassProperties& properties,
                     const Eigen::MatrixXd& constraints, const Eigen::MatrixXd& groups, const Choice& choice);

/// Makes the basis of a recipe   (THEORY 4.7 to 4.12, 11.4 to 11.12). An explicit recipe that is incomplete
/// with the numbering of the scene is tried with another numbering.
/// \param why_not  message with the shape that the recipe needs if it does not apply, else empty
/// \return  an incomplete basis if the recipe is incomplete, an empty basis if it does not apply
Basis find_basis(const Scene& scene, const Structure& structure, const LinkFactor& factor, Recipe recipe,
                 std::string& why_not);

/// Makes the basis of the explicit recipe of the shape if that basis is complete, else the basis of the
/// formal recipe (THEORY 11.4 to 11.12).
Basis find_basis(const Scene& scene, const Structure& structure, const LinkFactor& factor);

/// Returns the orthogonal matrix [-] (n x n) between two complete bases b and b*   (THEORY 11.13 to 11.15):
///   b*_l = sum_u a_lu b_u,   a = b*^T m b / M,   a a^T = 1
Eigen::MatrixXd change_of_basis(const std::vector<PointMass>& points, const Basis& from, const Basis& to);

}  // namespace freeflex
