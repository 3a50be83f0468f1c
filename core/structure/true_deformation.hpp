// Natural deformations of a displaced link at true geometry: what X44 to X62 are the first order of.
#pragma once

#include <array>

#include "core/structure/link_factor.hpp"

namespace freeflex {

/// A link in space, its points and the joints at its ends displaced by any amount   (THEORY X140).
class TrueLink {
 public:
  /// \pre the link strains and is no matrix
  TrueLink(const Scene& scene, int link, const Freedoms& freedoms);

  int num_deformations() const { return num_deformations_; }
  /// Natural deformations in the order of the link's rows, zero at rest [m], [rad], [-].
  /// \param V      [m] (3 x points) displacements
  /// \param theta  [rad] (3 x points) rotation vectors of the joints; read for beams and plates alone
  /// \param own    [rad] (3 x points) how a beam's ends turn against their joints, about axes those let go
  Eigen::VectorXd deformations(const Eigen::Matrix3Xd& V, const Eigen::Matrix3Xd& theta,
                               const Eigen::Matrix3Xd& own = {}) const;

 private:
  double elongation(const Eigen::Vector3d& d) const;
  Eigen::VectorXd of_beam(const Eigen::Matrix3Xd& V, const Eigen::Matrix3Xd& theta,
                          const Eigen::Matrix3Xd& own) const;
  Eigen::VectorXd of_bend(const Eigen::Matrix3Xd& V) const;
  Eigen::VectorXd of_torsion(const Eigen::Matrix3Xd& V) const;
  Eigen::VectorXd of_plate(const Eigen::Matrix3Xd& V, const Eigen::Matrix3Xd& theta) const;

  enum class Form { kAxial, kBeam, kBend, kTorsion, kPlate } form_ = Form::kAxial;
  int num_deformations_ = 1;
  Eigen::Matrix3Xd rest_;       // [m] (3 x points) from the first
  Eigen::Matrix3d axes_;        // beam: local axes; plate: local axes, z the normal
  Eigen::Vector3d first_;       // straight bending spring: a direction across it
  double side_ = 0.0;           // bending spring: 1 straight, -1 folded, 0 neither
  double rest_angle_ = 0.0;     // [rad] bending and torsion
  Eigen::MatrixXd plate_rows_;  // (15 x 18) natural deformations per (V, theta) of the three corners
  Eigen::Matrix2d rest_edges_;  // [m] plate: edges from the first corner in local x, y, inverted [1/m]
};

}  // namespace freeflex
