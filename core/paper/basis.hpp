// Unit elastic displacements by every recipe of the paper, and by two more (Alekseev 1970, sections 3, 6, 7).
#pragma once

#include <string>
#include <vector>

#include "core/paper/force_groups.hpp"
#include "core/structure/link_factor.hpp"

namespace freeflex {

/// Force groups that are independent of each other and of the forces in rigid links.
struct Choice {
  std::vector<int> kept;      // by index, in the order in which they were taken
  std::vector<int> skipped;   // combinations of those
  double least_kept = 1.0;    // [-] smallest share of a kept group that those before do not explain
  double most_skipped = 0.0;  // [-] largest such share of a skipped group
};

/// Unit elastic displacements b, sum m b_l.b_u = M [l = u]   (THEORY 3.3), free of rigid motion (2.6) and of
/// what rigid links forbid.
struct Basis {
  Recipe recipe = Recipe::kModes;
  Eigen::MatrixXd shapes;  // b, [-] (3N x rank)
  int num_expected = 0;    // n = 3N - rigid freedoms - constraints; the basis is complete when rank == n

  // recipes with force groups only
  std::vector<int> numbering;    // order in which the points were taken
  int rank_as_numbered = 0;      // rank with the points as the scene numbers them
  Choice choice;                 // vector l comes from group choice.kept[l]
  Eigen::MatrixXd coefficients;  // C_ul, [-] (rank x num_groups) beta_l = sum_u b_u C_ul   (THEORY 3.4)
  std::vector<int> flat_window;  // points in one place, on one line, in one plane: why it is incomplete

  double gram_error = 0.0;           // [-] max |sum m b_l.b_u / M - [l = u]|
  double force_residual = 0.0;       // [-] max |sum m b| / sum m |b|
  double moment_residual = 0.0;      // [-] max |sum m r x b| / sum m |r| |b|
  double constraint_residual = 0.0;  // [-] max |N_c b| over the most that sum m b.b = M allows

  Eigen::Index rank() const { return shapes.cols(); }
  bool is_complete() const { return rank() == num_expected; }
};

/// A group is a combination of those before when what they do not explain of it is at most this share of its
/// norm: far above rounding, some 1e-15, far below what windows that are not flat leave   (THEORY X86).
inline constexpr double kDependent = 1e-11;

/// Takes groups in turn. Judged as forces: in the metric of masses 1e12 apart, what a group adds may be less
/// than rounding   (THEORY X86). \param constraints  [-] (num x 3N) LinkFactor::constraints
Choice independent_groups(const Eigen::MatrixXd& constraints, const Eigen::MatrixXd& groups);

/// Of the 3N unit loads of the formal recipe, always that of which most is left, as a share of the whole load
/// in the mass metric; so the last still leaves much, whatever the masses   (THEORY X84, X86).
Choice independent_loads(const std::vector<PointMass>& points, const MassProperties& properties,
                         const Eigen::MatrixXd& constraints);

/// Unit elastic displacements of force groups: beta = (M / m) f (THEORY 3.2), Gram-Schmidt in the mass
/// metric, at least twice, after the rigid motions and M^-1 N_c^T, N_c the constraints   (THEORY X86). Cost
/// O(N n^2). \param groups  [N] (3N x num_groups) Fills shapes, choice and coefficients.
Basis orthonormalise(const std::vector<PointMass>& points, const MassProperties& properties,
                     const Eigen::MatrixXd& constraints, const Eigen::MatrixXd& groups, const Choice& choice);

/// The basis of a recipe   (THEORY X51, X52, X81-X86). An explicit recipe that falls short with the points as
/// they are numbered is tried with another numbering. \param why_not  when there is no such basis, the shape
/// that the recipe needs \return  not complete where the recipe falls short; empty with why_not set where it
/// does not apply
Basis find_basis(const Scene& scene, const Structure& structure, const LinkFactor& factor, Recipe recipe,
                 std::string& why_not);

/// The explicit recipe of the shape where it is complete, else the formal one   (THEORY X80-X86).
Basis find_basis(const Scene& scene, const Structure& structure, const LinkFactor& factor);

/// The orthogonal matrix between two complete bases, b*_l = sum_u a_lu b_u, a a^T = 1   (THEORY 6.1,
/// 6.2, X87) [-] (n x n).
Eigen::MatrixXd change_of_basis(const std::vector<PointMass>& points, const Basis& from, const Basis& to);

}  // namespace freeflex
