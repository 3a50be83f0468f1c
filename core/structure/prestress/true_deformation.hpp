// The natural deformations of a displaced link at true geometry. To first order the deformations are given by
// (THEORY 3.3) to (THEORY 3.37).
#pragma once

#include <array>

#include "core/structure/links/link_factor.hpp"

namespace freeflex {

/// A link whose points and joints have displacements of any size   (THEORY 8.54).
class TrueLink {
 public:
  /// \pre the link is neither a rigid link nor a matrix link
  TrueLink(const Scene& scene, int link, const Freedoms& freedoms);

  int num_deformations() const { return num_deformations_; }
  /// Returns the local axes of a beam or plate as columns; for other links those of the scene.
  const Eigen::Matrix3d& axes() const { return axes_; }
  /// Returns the natural deformations in the order of the rows of the link, zero if the link is undeformed
  /// [m], [rad], [-].
  /// \param V      [m] (3 x points) displacements
  /// \param theta  [rad] (3 x points) rotation vectors of the joints, for beams and plates
  /// \param own    [rad] (3 x points) rotation vectors of the ends of a beam relative to their joints, about
  /// released axes
  Eigen::VectorXd deformations(const Eigen::Matrix3Xd& V, const Eigen::Matrix3Xd& theta,
                               const Eigen::Matrix3Xd& own = {}) const;

 private:
  void set_bend(const Scene& scene, const Link& link);
  void set_plate(const Scene& scene, const Link& link, const Freedoms& freedoms);
  double elongation(const Eigen::Vector3d& d) const;
  Eigen::VectorXd of_beam(const Eigen::Matrix3Xd& V, const Eigen::Matrix3Xd& theta,
                          const Eigen::Matrix3Xd& own) const;
  Eigen::VectorXd of_bend(const Eigen::Matrix3Xd& V) const;
  Eigen::VectorXd of_torsion(const Eigen::Matrix3Xd& V) const;
  Eigen::VectorXd of_plate(const Eigen::Matrix3Xd& V, const Eigen::Matrix3Xd& theta) const;

  enum class Form { kAxial, kBeam, kBend, kTorsion, kPlate } form_ = Form::kAxial;
  int num_deformations_ = 1;
  Eigen::Matrix3Xd rest_;       // [m] (3 x points) rest positions from the first point
  Eigen::Matrix3d axes_;        // local axes of a beam or plate; plate: z the normal
  Eigen::Vector3d first_;       // straight bending spring: direction normal to it
  double side_ = 0.0;           // bending spring: 1 straight, -1 folded, 0 neither
  double rest_angle_ = 0.0;     // [rad] angle of undeformed bending and torsion springs
  Eigen::MatrixXd plate_rows_;  // (15 x 18) natural deformations per (V, theta) of the three corners
  Eigen::Matrix2d rest_edges_;  // [1/m] plate: inverse of the edges [m] from the first corner, local x, y
};

}  // namespace freeflex
