// Orthonormal basis of the displacements that are neither rigid motion, nor forbidden by rigid links, nor
// mechanism, in the mass metric.
#pragma once

#include <vector>

#include "core/structure/decompositions.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// In y = sqrt(m) V the rigid motions, what rigid links forbid and the mechanisms span few columns,
/// orthogonal to each other; Householder reflectors turn them to the front one after the other, and what is
/// left, H, is orthonormal to rounding whatever the masses   (THEORY X51). Heavy points come first, which
/// keeps (2.6) for the light ones.
class EckartComplement {
 public:
  /// \param constraints  [-] (num x 3N) LinkFactor::constraints, independent rows
  /// \param mechanisms   [-] (3N x count) Mechanisms::motions
  EckartComplement(const std::vector<PointMass>& points, const MassProperties& properties,
                   const Eigen::MatrixXd& constraints, const Eigen::MatrixXd& mechanisms);

  /// Number of columns of H, 3N - rigid freedoms - constraints - mechanisms   (THEORY X51).
  Eigen::Index dimension() const { return root_mass_.size() - num_before_; }

  /// A M^-1/2 H   (THEORY X52) [rows' unit / sqrt(kg)] (num_rows x dimension)
  Eigen::MatrixXd reduce(const Eigen::MatrixXd& rows) const;
  /// Norms of the same rows before anything is taken out of them: what their rounding goes with.
  Eigen::VectorXd sizes(const Eigen::MatrixXd& rows) const;

  /// Unit elastic displacements b of vectors of H coordinates, sum m b.b = M for unit vectors   (THEORY 3.3).
  /// \param coordinates  [-] (dimension x count)
  /// \return             [-] (3N x count)
  Eigen::MatrixXd shapes(const Eigen::MatrixXd& coordinates) const;

  /// Mechanisms as unit elastic displacements, orthonormal in the mass metric   (THEORY 3.3, X50) [-] (3N x
  /// count).
  Eigen::MatrixXd mechanism_shapes() const;

 private:
  // columns that are turned to the front of what the stages before left
  struct Stage {
    Eigen::Index first = 0;  // columns of the stages before
    Eigen::Index count = 0;
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr;
  };
  void add_stage(Eigen::MatrixXd columns);
  Eigen::MatrixXd to_displacements(Eigen::MatrixXd y) const;

  double mass_;                // [kg] of all points
  std::vector<int> order_;     // freedoms by descending mass
  Eigen::VectorXd root_mass_;  // [sqrt(kg)] (3N) in that order
  std::vector<Stage> stages_;
  Eigen::Index num_before_ = 0;  // columns of all stages
  Eigen::Index num_mechanisms_;
};

}  // namespace freeflex
