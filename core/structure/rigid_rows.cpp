// Rigid links and rigid bodies: what they forbid, and which of it is forbidden twice   (X64).

#include "core/structure/decompositions.hpp"
#include "core/structure/link_factor.hpp"

namespace freeflex {

DeformationRows rigid_rows(const Scene& scene, const Link& link) {
  if (link.points.size() == 2) {
    DeformationRow row;
    const Eigen::Vector3d direction = span_of(scene, link).stableNormalized();
    add_vector(row, 3 * link.points[0], -1.0, direction);
    add_vector(row, 3 * link.points[1], 1.0, direction);
    return {row};
  }
  // all that is orthogonal to the rigid motions of the body's points
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
