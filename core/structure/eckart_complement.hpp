// Orthonormal basis of the displacements that are neither rigid motion, nor forbidden by rigid links, nor
// mechanism, in the mass metric.
#pragma once

#include <vector>

#include "core/structure/root_mass.hpp"

namespace freeflex {

/// In y = L^T V (sqrt(m) V of point masses) the rigid motions, what rigid links forbid and the mechanisms
/// span few columns, orthogonal to each other; Householder reflectors turn them to the front one after the
/// other, and what is left, H, is orthonormal to rounding whatever the masses   (THEORY X51). Heavy points
/// come first, which keeps (2.6) for the light ones. n freedoms: 3N displacements of point masses.
class EckartComplement {
 public:
  /// \param mass         [kg] of the whole
  /// \param rigid        (n x 3..6) rigid motions
  /// \param constraints  [-] (num x n) LinkFactor::constraints, independent rows
  /// \param mechanisms   (n x count) motions that strain nothing
  EckartComplement(RootMass root_mass, double mass, const Eigen::MatrixXd& rigid,
                   const Eigen::MatrixXd& constraints, const Eigen::MatrixXd& mechanisms);

  /// Number of columns of H, n - rigid freedoms - constraints - mechanisms   (THEORY X51).
  Eigen::Index dimension() const { return root_mass_.size() - num_before_; }

  /// A L^-T H   (THEORY X52) [rows' unit / sqrt(kg)] (num_rows x dimension)
  Eigen::MatrixXd reduce(const Eigen::MatrixXd& rows) const;
  /// Norms of the same rows before anything is taken out of them: what their rounding goes with.
  Eigen::VectorXd sizes(const Eigen::MatrixXd& rows) const;

  /// Unit elastic displacements b of vectors of H coordinates, sum m b.b = M for unit vectors   (THEORY 3.3).
  /// \param coordinates  [-] (dimension x count)
  /// \return             [-] (n x count)
  Eigen::MatrixXd shapes(const Eigen::MatrixXd& coordinates) const;

  /// Mechanisms as unit elastic displacements, orthonormal in the mass metric   (THEORY 3.3, X50) [-] (n x
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

  RootMass root_mass_;
  double mass_;  // [kg] of the whole
  std::vector<Stage> stages_;
  Eigen::Index num_before_ = 0;  // columns of all stages
  Eigen::Index num_mechanisms_;
};

}  // namespace freeflex
