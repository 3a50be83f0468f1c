// Member forces of links from the displacements of points.
#include <algorithm>

#include "core/model/link_factor.hpp"

namespace freeflex {
namespace {

// X48: tension = stiffness * (V2 - V1) . direction
LinkForceRows axial_force(const DeformationRow& row, const Link& link) {
  LinkForceRows force;
  force.columns_points = {link.points[0], link.points[1]};
  force.rows.resize(1, 6);
  for (Eigen::Index column = 0; column < 6; ++column)
    force.rows(0, column) =
        row.root_stiffness * row.root_stiffness * row.coefficients[static_cast<std::size_t>(column)].second;
  return force;
}

// X49: end forces of unit natural forces (axial, torsion, bending about z symmetric and antisymmetric, about
// y the same)
Eigen::Matrix<double, 12, 6> end_forces(double length) {
  Eigen::Matrix<double, 12, 6> forces = Eigen::Matrix<double, 12, 6>::Zero();
  enum { kFx1, kFy1, kFz1, kMx1, kMy1, kMz1, kFx2, kFy2, kFz2, kMx2, kMy2, kMz2 };
  enum { kAxial, kTorsion, kSymmetricZ, kAntisymmetricZ, kSymmetricY, kAntisymmetricY };
  const double shear = 2.0 / length;
  forces(kFx1, kAxial) = forces(kMx1, kTorsion) = -1.0;
  forces(kFx2, kAxial) = forces(kMx2, kTorsion) = 1.0;
  forces(kMz1, kSymmetricZ) = forces(kMy1, kSymmetricY) = -1.0;
  forces(kMz2, kSymmetricZ) = forces(kMy2, kSymmetricY) = 1.0;
  forces(kMz1, kAntisymmetricZ) = forces(kMz2, kAntisymmetricZ) = 1.0;
  forces(kMy1, kAntisymmetricY) = forces(kMy2, kAntisymmetricY) = 1.0;
  forces(kFy1, kAntisymmetricZ) = forces(kFz2, kAntisymmetricY) = shear;
  forces(kFy2, kAntisymmetricZ) = forces(kFz1, kAntisymmetricY) = -shear;
  return forces;
}

// X49: natural deformations from displacements and recovered rotations, times stiffness, to end forces
LinkForceRows beam_forces(const Scene& scene, const Link& link, const LinkFactor& factor) {
  const int num_displacements = 3 * static_cast<int>(scene.points.size());
  std::array<int, 2> first_rotation{};
  for (std::size_t end = 0; end < 2; ++end) {
    const auto place =
        std::lower_bound(factor.joint_points.begin(), factor.joint_points.end(), link.points[end]);
    first_rotation[end] = num_displacements + 3 * static_cast<int>(place - factor.joint_points.begin());
  }
  const std::vector<DeformationRow> rows = beam_rows(scene, link, first_rotation);
  Eigen::MatrixXd natural_force = Eigen::MatrixXd::Zero(6, num_displacements);
  for (std::size_t e = 0; e < rows.size(); ++e) {
    const auto row = static_cast<Eigen::Index>(e);
    for (const auto& [freedom, coefficient] : rows[e].coefficients) {
      if (freedom < num_displacements)
        natural_force(row, freedom) += coefficient;
      else
        natural_force.row(row) += coefficient * factor.recovery.row(freedom - num_displacements);
    }
    natural_force.row(row) *= rows[e].root_stiffness * rows[e].root_stiffness;
  }
  const double length = (scene.points[static_cast<std::size_t>(link.points[1])].position -
                         scene.points[static_cast<std::size_t>(link.points[0])].position)
                            .stableNorm();
  // only points that beams meet at enter
  LinkForceRows force;
  force.columns_points = factor.joint_points;
  std::vector<int> columns;
  for (const int point : factor.joint_points)
    for (int axis = 0; axis < 3; ++axis) columns.push_back(3 * point + axis);
  force.rows = end_forces(length) * natural_force(Eigen::all, columns);
  return force;
}

}  // namespace

std::vector<LinkForceRows> link_force_rows(const Scene& scene, const LinkFactor& factor) {
  std::vector<LinkForceRows> forces;
  for (const int index : scene.publication.links) {
    const Link& link = scene.links[static_cast<std::size_t>(index)];
    LinkForceRows force;
    if (std::holds_alternative<Beam>(link.kind)) {
      force = beam_forces(scene, link, factor);
    } else {
      force = axial_force(axial_row(scene, link, axial_stiffness(scene, link)), link);
    }
    force.link = index;
    forces.push_back(std::move(force));
  }
  return forces;
}

}  // namespace freeflex
