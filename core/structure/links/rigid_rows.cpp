// Constraints of rigid links and rigid bodies.

#include <Eigen/Geometry>
#include <utility>

#include "core/structure/links/link_factor.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {

namespace {

// Returns the constraints of a rigid link with a hub. The constraints are V_k = V_hub + theta_hub x l_k, and
// theta_k = theta_hub for joints (THEORY 16.5).
DeformationRows hub_rows(const Scene& scene, const Link& link, int hub, const Freedoms& freedoms) {
  const auto position = [&](int point) { return scene.points[index(point)].position; };
  DeformationRows rows;
  for (const int point : link.points) {
    if (point == hub) continue;
    const Eigen::Vector3d d = position(point) - position(hub);
    for (int axis = 0; axis < 3; ++axis) {
      DeformationRow row;
      row.coefficients = {{3 * point + axis, 1.0}, {3 * hub + axis, -1.0}};
      // -(theta x d) . e = -theta . (d x e)
      add_vector(row, freedoms.rotation(hub), -1.0, d.cross(Eigen::Vector3d::Unit(axis)));
      rows.push_back(std::move(row));
    }
    if (!freedoms.has_joint(point)) continue;
    for (int axis = 0; axis < 3; ++axis) {
      DeformationRow row;
      row.coefficients = {{freedoms.rotation(point) + axis, 1.0}, {freedoms.rotation(hub) + axis, -1.0}};
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

}  // namespace

DeformationRows rigid_rows(const Scene& scene, const Link& link, const Freedoms& freedoms) {
  if (const int hub = hub_of(scene, link); hub >= 0) return hub_rows(scene, link, hub, freedoms);
  if (link.points.size() == 2) {  // u . (V_2 - V_1) = 0   (THEORY 3.40)
    DeformationRow row;
    const Eigen::Vector3d direction = span_of(scene, link).stableNormalized();
    add_vector(row, 3 * link.points[0], -1.0, direction);
    add_vector(row, 3 * link.points[1], 1.0, direction);
    return {row};
  }
  // rigid body: T_perp^T V = 0   (THEORY 3.41)
  const Eigen::MatrixXd rigid = rigid_basis(scene, link.points);
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(rigid);
  const Eigen::MatrixXd all = qr.householderQ() * Eigen::MatrixXd::Identity(rigid.rows(), rigid.rows());
  DeformationRows rows;
  for (Eigen::Index column = rigid.cols(); column < all.cols(); ++column) {
    DeformationRow row;
    for (std::size_t k = 0; k < link.points.size(); ++k)
      add_vector(row, 3 * link.points[k], 1.0, all.block<3, 1>(3 * static_cast<Eigen::Index>(k), column));
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace freeflex
