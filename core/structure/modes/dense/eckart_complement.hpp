// This code computes a basis of the elastic displacements that is orthonormal in the mass metric. Elastic
// displacements contain no rigid motion, no forbidden motion and no mechanism.
#pragma once

#include <vector>

#include "core/structure/masses/root_mass.hpp"

namespace freeflex {

/// In the coordinates y = L^T V (sqrt(m) V for point masses) rigid motions, constraints and mechanisms are
/// mutually orthogonal. Householder reflectors map these three groups of columns, one after the other, to the
/// leading coordinates. The remaining columns H of the orthogonal factor are orthonormal, except for rounding
/// errors, for any masses   (THEORY 4.7). Heavy points come first in y, so that light points also meet the
/// conditions (THEORY 2.15). n is the number of freedoms, 3N for point masses.
class EckartComplement {
 public:
  /// \param mass         [kg] total mass
  /// \param rigid        (n x 3..6) rigid motions
  /// \param constraints  [-] (num x n) LinkFactor::constraints, independent rows
  /// \param mechanisms   (n x count) motions that strain no link
  EckartComplement(RootMass root_mass, double mass, const Eigen::MatrixXd& rigid,
                   const Eigen::MatrixXd& constraints, const Eigen::MatrixXd& mechanisms);

  /// Returns the number of columns of H: n minus the numbers of rigid freedoms, constraints and mechanisms.
  Eigen::Index dimension() const { return root_mass_.size() - num_before_; }

  /// Returns A L^-T H   (THEORY 4.8) [unit of rows / sqrt(kg)] (num_rows x dimension).
  Eigen::MatrixXd reduce(const Eigen::MatrixXd& rows) const;
  /// Returns the norms of the rows A L^-T before projection. The rounding error of a row is proportional to
  /// its norm.
  Eigen::VectorXd sizes(const Eigen::MatrixXd& rows) const;

  /// Returns the unit elastic displacements b = sqrt(M) L^-T H Y of vectors Y; sum m b.b = M for unit vectors
  /// (THEORY 4.3, 4.9).
  /// \param coordinates  [-] (dimension x count)
  /// \return             [-] (n x count)
  Eigen::MatrixXd shapes(const Eigen::MatrixXd& coordinates) const;

  /// Returns the mechanisms as unit elastic displacements, normalised as in (THEORY 4.3) [-] (n x count).
  Eigen::MatrixXd mechanism_shapes() const;

 private:
  // reflectors of one group of columns, over the coordinates that earlier stages did not use
  struct Stage {
    Eigen::Index first = 0;  // number of columns of earlier stages
    Eigen::Index count = 0;
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr;
  };
  void add_stage(Eigen::MatrixXd columns);
  Eigen::MatrixXd to_displacements(Eigen::MatrixXd y) const;

  RootMass root_mass_;
  double mass_;  // [kg] total mass
  std::vector<Stage> stages_;
  Eigen::Index num_before_ = 0;  // number of columns of all stages
  Eigen::Index num_mechanisms_;
};

}  // namespace freeflex
