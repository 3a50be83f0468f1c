// Unit elastic displacements by every recipe of the paper, and by two more (Alekseev 1970, sections 3, 6, 7).
// THEORY 2.15, 4.2, 4.3, 11.4, 11.11 to 11.15, 11.28, 11.29
#pragma once

#include <string>
#include <vector>

#include "core/paper/force_groups.hpp"
#include "core/structure/links/link_factor.hpp"

namespace freeflex {

/// Holds a choice of force groups that are independent of each other and of the forces in rigid links. The
/// remainder of a group is the norm of its part orthogonal to the vectors taken before it, as a fraction of
/// the norm of the group.
struct Choice {
  std::vector<int> kept;      // indices of groups, in the order in which they were taken
  std::vector<int> skipped;   // indices of groups that are combinations of kept groups
  double least_kept = 1.0;    // [-] smallest remainder of a kept group
  double most_skipped = 0.0;  // [-] largest remainder of a skipped group
};

/// Holds unit elastic displacements b. They are orthonormal in the mass metric, and contain neither rigid
/// motion nor motion that rigid links forbid (THEORY 2.15, 4.3):
///   sum m b_l.b_u = M [l = u],   sum m b_l = 0,   sum m r x b_l = 0,   C b_l = 0
struct Basis {
  Recipe recipe = Recipe::kModes;
  Eigen::MatrixXd shapes;  // b, [-] (3N x rank)
  int num_expected = 0;    // n = 3N - rigid freedoms - constraints; the basis is complete if rank == n

  // The members from `numbering` to `flat_window` are filled only if the recipe uses force groups.
  std::vector<int> numbering;  // order in which the recipe took the points
  int rank_as_numbered = 0;    // rank with the numbering of the scene
  Choice choice;               // vector l comes from group choice.kept[l]
  // gamma_ul, [N] (rank x num_groups) beta_l = sum_u b_u gamma_ul   (THEORY 11.11)
  Eigen::MatrixXd coefficients;
  // Filled only if the basis is incomplete: successive points at one position, on one line or in one plane,
  // which make the recipe incomplete
  std::vector<int> flat_window;

  double gram_error = 0.0;           // [-] max |sum m b_l.b_u / M - [l = u]|
  double force_residual = 0.0;       // [-] max |sum m b| / sum m |b|   (THEORY 11.28)
  double moment_residual = 0.0;      // [-] max |sum m r x b| / sum m |r| |b|   (THEORY 11.28)
  double constraint_residual = 0.0;  // [-] max |C b| / (sqrt(M) |C m^-1/2|)   (THEORY 11.29)

  Eigen::Index rank() const { return shapes.cols(); }
  bool is_complete() const { return rank() == num_expected; }
};

/// A group is treated as a combination of the vectors taken before it if its remainder [-] is at most this
/// limit. The limit is far above rounding errors, which are about 1e-15, and far below the remainder of any
/// group whose window of successive points is not flat (THEORY 11.10, 11.12).
inline constexpr double kDependent = 1e-11;

/// Chooses independent groups, which are tried in their order. The remainders are computed from the forces,
/// without the mass metric, because if masses differ by a factor of 1e12, the remainder of an independent
/// group in the mass metric may be below rounding errors   (THEORY 11.12).
/// \param constraints  [-] C (num x 3N) LinkFactor::constraints  \param groups  [N] (3N x num_groups)
Choice independent_groups(const Eigen::MatrixXd& constraints, const Eigen::MatrixXd& groups);

/// Chooses independent loads among the 3N unit loads of the formal recipe. The load taken next is always the
/// one with the largest remainder in the mass metric, as a fraction of the norm of the load. Therefore even
/// the load taken last has a large remainder, for any masses (THEORY 11.4, 11.12).
Choice independent_loads(const std::vector<PointMass>& points, const MassProperties& properties,
                         const Eigen::MatrixXd& constraints);

/// Makes unit elastic displacements from force groups by the Gram-Schmidt process in the mass metric, with at
/// least two passes. The rigid motions and m^-1 C^T are the first vectors of the process, where C is the
/// matrix of constraints   (THEORY 4.2, 11.12):
///   beta = (M / m) f,   y = sqrt(m) beta - sum_k v_k (v_k.sqrt(m) beta),   b = sqrt(M) m^-1/2 y / |y|
/// Fills shapes, choice and coefficients. The cost is O(N n^2).
/// \param groups  [N] (3N x num_groups)
Basis orthonormalise(const std::vector<PointMass>& points, const MassProperties& properties,
                     const Eigen::MatrixXd& constraints, const Eigen::MatrixXd& groups, const Choice& choice);

/// Makes the basis of a recipe   (THEORY 4.7 to 4.12, 11.4 to 11.12). An explicit recipe that is incomplete
/// with the numbering of the scene is tried with another numbering.
/// \param why_not  set to a message that names the shape that the recipe needs if the recipe does not apply,
/// else to empty
/// \return  an incomplete basis if the recipe is incomplete, an empty basis if it does not apply
Basis find_basis(const Scene& scene, const Structure& structure, const LinkFactor& factor, Recipe recipe,
                 std::string& why_not);

/// Makes the basis of the explicit recipe for the shape of the scene if that basis is complete, else the
/// basis of the formal recipe (THEORY 11.4 to 11.12).
Basis find_basis(const Scene& scene, const Structure& structure, const LinkFactor& factor);

/// Returns the orthogonal matrix [-] (n x n) between two complete bases b and b*   (THEORY 11.13 to 11.15):
///   b*_l = sum_u a_lu b_u,   a = b*^T m b / M,   a a^T = 1
Eigen::MatrixXd change_of_basis(const std::vector<PointMass>& points, const Basis& from, const Basis& to);

}  // namespace freeflex
