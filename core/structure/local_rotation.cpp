// Elastic rotations at points that have none of their own: of joints, of rigid bodies, of neighbours   (X73).
#include <algorithm>
#include <set>

#include "core/structure/decompositions.hpp"
#include "core/structure/link_factor.hpp"

namespace freeflex {
namespace {

// [-] second moments below this share of the largest are those of a line
constexpr double kLine = 1e-12;

bool names(const Link& link, int point) {
  return std::find(link.points.begin(), link.points.end(), point) != link.points.end();
}

// the rotation of a point's surroundings per displacement (3 x 3N)
Eigen::MatrixXd rotation_at(const Scene& scene, const LinkFactor& factor, const Freedoms& freedoms,
                            int point) {
  const Eigen::Index num_displacements = freedoms.num_displacements();
  std::set<int> star{point};
  for (const Link& link : scene.links) {
    if (!names(link, point)) continue;
    // a rigid body that the point belongs to has the rotation that is meant
    if (is_rigid_body(scene, link)) {
      star = {link.points.begin(), link.points.end()};
      break;
    }
    star.insert(link.points.begin(), link.points.end());
  }
  const bool in_body = std::any_of(scene.links.begin(), scene.links.end(), [&](const Link& link) {
    return names(link, point) && is_rigid_body(scene, link);
  });
  if (!in_body && freedoms.has_joint(point))
    return factor.recovery.middleRows<3>(freedoms.rotation(point) - num_displacements);
  const std::vector<int> points(star.begin(), star.end());
  const Eigen::MatrixXd share = mean_rotation(scene, points);
  Eigen::MatrixXd rotation = Eigen::MatrixXd::Zero(3, num_displacements);
  for (std::size_t k = 0; k < points.size(); ++k)
    rotation.middleCols<3>(3 * Eigen::Index{points[k]}) =
        share.middleCols<3>(3 * static_cast<Eigen::Index>(k));
  return rotation;
}

}  // namespace

bool is_rigid_body(const Scene& scene, const Link& link) {
  return is_body(link) && rigid_basis(scene, link.points).cols() == 6;
}

Eigen::MatrixXd mean_rotation(const Scene& scene, const std::vector<int>& points) {
  const auto num_points = static_cast<Eigen::Index>(points.size());
  Eigen::Matrix3Xd d(3, num_points);
  for (Eigen::Index k = 0; k < num_points; ++k)
    d.col(k) = scene.points[static_cast<std::size_t>(points[static_cast<std::size_t>(k)])].position;
  d.colwise() -= Eigen::Vector3d(d.col(0));
  d.colwise() -= Eigen::Vector3d(d.rowwise().mean());
  const Eigen::Matrix3d second_moment = d * d.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(
      second_moment.trace() * Eigen::Matrix3d::Identity() - second_moment);
  const Eigen::Vector3d inverse = eigen.eigenvalues().unaryExpr(
      [&](double moment) { return moment > kLine * eigen.eigenvalues()[2] ? 1.0 / moment : 0.0; });
  const Eigen::Matrix3d J_inverse =
      eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
  Eigen::MatrixXd rotation(3, 3 * num_points);
  for (Eigen::Index k = 0; k < num_points; ++k) {
    Eigen::Matrix3d cross;
    cross << 0.0, -d(2, k), d(1, k), d(2, k), 0.0, -d(0, k), -d(1, k), d(0, k), 0.0;
    rotation.middleCols<3>(3 * k) = J_inverse * cross;
  }
  return rotation;
}

Eigen::MatrixXd local_rotations(const Scene& scene, const LinkFactor& factor, const Structure& structure) {
  const Freedoms freedoms(scene);
  std::set<int> wanted;
  for (const Load& load : scene.loads)
    if (load.axes == Axes::kLocal)
      for (const PointLoad& each : load.forces) wanted.insert(each.point);
  if (wanted.empty()) return {};
  Eigen::MatrixXd rotations = Eigen::MatrixXd::Zero(structure.shapes.rows(), structure.shapes.cols());
  for (const int point : wanted)
    rotations.middleRows<3>(3 * Eigen::Index{point}) =
        rotation_at(scene, factor, freedoms, point) * structure.shapes;
  return rotations;
}

}  // namespace freeflex
