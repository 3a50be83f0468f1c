// Displacements and rotations of single links in the motions of a structure.
#pragma once

#include "core/scene/link_kinds.hpp"
#include "core/structure/links/link_factor.hpp"

namespace freeflex {

/// Displacements of points and rotations of joints of single links, in every motion.
class LocalShapes {
 public:
  /// \param shapes     (3N x n) displacements of the points in each motion
  /// \param rotations  (num_rotations x n) rotations of the joints; empty in scenes of point masses
  LocalShapes(const Scene& scene, const Freedoms& freedoms, const LinkFactor& factor,
              const Eigen::MatrixXd& shapes, const Eigen::MatrixXd& rotations)
      : scene_(scene), freedoms_(freedoms), shapes_(shapes) {
    if (rotations.rows() > 0) rotations_ = rotations;
    if (factor.recovery.rows() == 0) return;
    rotations_ = factor.recovery * shapes_;
    rotate_with_bodies(scene, freedoms, shapes_, rotations_);
  }

  /// Returns the natural deformation of a row in every motion.
  Eigen::RowVectorXd deformation(const DeformationRow& row) const {
    Eigen::RowVectorXd e = Eigen::RowVectorXd::Zero(shapes_.cols());
    if (e.size() == 0) return e;  // a row of a matrix without columns begins at an offset from a null pointer
    for (const auto& [freedom, coefficient] : row.coefficients)
      e += coefficient * (freedom < freedoms_.num_displacements()
                              ? shapes_.row(freedom)
                              : rotations_.row(freedom - freedoms_.num_displacements()));
    return e;
  }

  /// Returns the displacements of the points of a link relative to its first point (3 x points).
  Eigen::Matrix3Xd displacements(const Link& link, int mode) const {
    Eigen::Matrix3Xd V(3, static_cast<Eigen::Index>(link.points.size()));
    for (Eigen::Index k = 0; k < V.cols(); ++k)
      V.col(k) = shapes_.block<3, 1>(3 * Eigen::Index{link.points[static_cast<std::size_t>(k)]}, mode);
    V.colwise() -= Eigen::Vector3d(V.col(0));
    return V;
  }

  /// Returns the rotations of the joints at the points of a link (3 x points).
  Eigen::Matrix3Xd rotations(int index, int mode) const {
    const Link& link = scene_.links[static_cast<std::size_t>(index)];
    Eigen::Matrix3Xd theta = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(link.points.size()));
    if (!traits_of(link).has_joint_rotations) return theta;
    const int before = freedoms_.num_displacements();
    for (Eigen::Index k = 0; k < theta.cols(); ++k)
      theta.col(k) =
          rotations_.block<3, 1>(freedoms_.rotation(link.points[static_cast<std::size_t>(k)]) - before, mode);
    return theta;
  }

  /// Returns the rotations of the ends of a beam relative to their joints, about released axes (3 x 2).
  Eigen::Matrix3Xd own_rotations(int index, int mode) const {
    const Link& link = scene_.links[static_cast<std::size_t>(index)];
    if (releases_of(link) == Releases{}) return {};
    const Eigen::Matrix3Xd theta = rotations(index, mode);
    Eigen::Matrix3Xd own = Eigen::Matrix3Xd::Zero(3, 2);
    const Eigen::Matrix3d axes = axes_of(scene_, link);
    for (int end = 0; end < 2; ++end)
      for (int axis = 0; axis < 3; ++axis)
        if (const int freedom = freedoms_.released(index, end, axis); freedom >= 0)
          own.col(end) += axes.col(axis) * (rotations_(freedom - freedoms_.num_displacements(), mode) -
                                            axes.col(axis).dot(theta.col(end)));
    return own;
  }

 private:
  const Scene& scene_;
  const Freedoms& freedoms_;
  const Eigen::MatrixXd& shapes_;
  Eigen::MatrixXd rotations_;  // [1/m] (num_rotations x n)
};

}  // namespace freeflex
