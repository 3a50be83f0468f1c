// Orthonormal basis of the displacements that are neither rigid motion nor mechanism, in the mass metric.
#pragma once

#include <Eigen/QR>
#include <vector>

#include "core/model/structure.hpp"

namespace freeflex {

/// In y = sqrt(m) V the rigid motions and mechanisms span few columns; Householder reflectors turn them to
/// the front, and what is left, H, is orthonormal to rounding whatever the masses   (THEORY X51). Heavy
/// points come first, which keeps (2.2) for the light ones.
class EckartComplement {
 public:
  /// \param mechanisms  [-] (3N x count) Mechanisms::motions
  EckartComplement(const std::vector<PointMass>& points, const MassProperties& properties,
                   const Eigen::MatrixXd& mechanisms);

  /// Number of columns of H, 3N - rigid freedoms - mechanisms.
  Eigen::Index dimension() const { return root_mass_.size() - num_rigid_ - num_mechanisms_; }

  /// A M^-1/2 H   [rows' unit / sqrt(kg)] (num_rows x dimension)
  Eigen::MatrixXd reduce(const Eigen::MatrixXd& rows) const;

  /// Unit elastic displacements b of vectors of H coordinates, sum m b.b = M for unit vectors   (THEORY 3.3).
  /// \param coordinates  [-] (dimension x count)
  /// \return             [-] (3N x count)
  Eigen::MatrixXd shapes(const Eigen::MatrixXd& coordinates) const;

  /// Mechanisms as unit elastic displacements, orthonormal in the mass metric   [-] (3N x count).
  Eigen::MatrixXd mechanism_shapes() const;

 private:
  Eigen::MatrixXd to_displacements(Eigen::MatrixXd y) const;

  double mass_;                // [kg] of all points
  std::vector<int> order_;     // freedoms by descending mass
  Eigen::VectorXd root_mass_;  // [sqrt(kg)] (3N) in that order
  Eigen::Index num_rigid_;
  Eigen::Index num_mechanisms_;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> rigid_qr_;
  Eigen::HouseholderQR<Eigen::MatrixXd> mechanism_qr_;  // of what rigid_qr_ leaves of the mechanisms
};

}  // namespace freeflex
