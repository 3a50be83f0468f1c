// This code computes elastic rotations at points. They are rotations of joints, rotations of rigid bodies, or
// mean rotations of neighbouring points   (THEORY 8.24).
#include <Eigen/Geometry>
#include <algorithm>
#include <set>

#include "core/scene/bodies.hpp"
#include "core/structure/links/link_factor.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

// [-] limit of the ratio of the width to the length of a group of neighbouring points. Below this limit the
// points do not determine the rotation about their line
constexpr double kNearlyLine = 1e-6;

// [-] limit of the ratio of the smallest to the largest principal moment. Above this limit an eigensolver
// keeps the digits of the moments
constexpr double kThin = 1e-4;

bool names(const Link& link, int point) {
  return std::find(link.points.begin(), link.points.end(), point) != link.points.end();
}

// expands columns for some points to columns for all points, with zeros for the other points
Eigen::MatrixXd over_all(const Scene& scene, const std::vector<int>& points, const Eigen::MatrixXd& weights) {
  Eigen::MatrixXd rotation = Eigen::MatrixXd::Zero(3, 3 * static_cast<Eigen::Index>(scene.points.size()));
  for (std::size_t k = 0; k < points.size(); ++k)
    rotation.middleCols<3>(3 * Eigen::Index{points[k]}) =
        weights.middleCols<3>(3 * static_cast<Eigen::Index>(k));
  return rotation;
}

}  // namespace

Eigen::MatrixXd rotation_of_neighbours(const Scene& scene, int point) {
  std::set<int> star{point};
  for (const Link& link : scene.links)
    if (names(link, point)) star.insert(link.points.begin(), link.points.end());
  const std::vector<int> points(star.begin(), star.end());
  return over_all(scene, points, mean_rotation(scene, points, kNearlyLine));
}

namespace {

// returns the rotation of the surroundings of a point per displacement (3 x 3N)   (THEORY 8.24)
Eigen::MatrixXd rotation_at(const Scene& scene, const LinkFactor& factor, const Freedoms& freedoms,
                            int point) {
  const Eigen::Index num_displacements = freedoms.num_displacements();
  const int body = freedoms.body_of(point);
  if (body < 0 && freedoms.has_joint(point))
    return factor.recovery.middleRows<3>(freedoms.rotation(point) - num_displacements);
  if (body < 0) return rotation_of_neighbours(scene, point);
  std::vector<int> points = scene.links[index(body)].points;
  std::sort(points.begin(), points.end());
  Eigen::MatrixXd rotation = over_all(scene, points, body_rotation(scene, points));
  const Eigen::Vector3d line = line_of(scene, points);
  if (line.isZero(0.0)) return rotation;
  const int about_line = freedoms.about_line(body);
  if (about_line >= 0) return rotation + line * factor.recovery.row(about_line - num_displacements);
  return rotation + line * (line.transpose() * rotation_of_neighbours(scene, point));
}

// returns the rotation of the surroundings of a point per elastic coordinate in scenes with bodies (3 x n)
Eigen::MatrixXd rotation_of(const Scene& scene, const Freedoms& freedoms, const Structure& structure,
                            int point) {
  const Eigen::Index num_displacements = freedoms.num_displacements();
  const auto of_joint = [&](int joint) -> Eigen::MatrixXd {
    return structure.rotations.middleRows<3>(freedoms.rotation(joint) - num_displacements);
  };
  if (freedoms.has_joint(point)) return of_joint(point);
  for (const Link& link : scene.links)
    if (is_rigid(link) && names(link, point))
      if (const int hub = hub_of(scene, link); hub >= 0) return of_joint(hub);
  const int body = freedoms.body_of(point);
  if (body < 0) return rotation_of_neighbours(scene, point) * structure.shapes;
  std::vector<int> points = scene.links[index(body)].points;
  std::sort(points.begin(), points.end());
  Eigen::MatrixXd rotation = over_all(scene, points, body_rotation(scene, points)) * structure.shapes;
  const Eigen::Vector3d line = line_of(scene, points);
  if (line.isZero(0.0)) return rotation;
  const int about_line = freedoms.about_line(body);
  if (about_line >= 0) return rotation + line * structure.rotations.row(about_line - num_displacements);
  return rotation + line * (line.transpose() * rotation_of_neighbours(scene, point) * structure.shapes);
}

}  // namespace

Eigen::Vector3d line_of(const Scene& scene, const std::vector<int>& points) {
  if (rigid_basis(scene, points).cols() == 6) return Eigen::Vector3d::Zero();
  const auto from_first = [&](int point) -> Eigen::Vector3d {
    return scene.points[index(point)].position - scene.points[index(points.front())].position;
  };
  Eigen::Vector3d farthest = Eigen::Vector3d::Zero();
  for (const int point : points)
    if (from_first(point).stableNorm() > farthest.stableNorm()) farthest = from_first(point);
  return farthest.stableNormalized();
}

// theta = J^-1 sum d_k x V_k, J = sum ((d_k . d_k) 1 - d_k d_k^T)   (THEORY 3.43, 9.6 with equal weights)
Eigen::MatrixXd mean_rotation(const Scene& scene, const std::vector<int>& points, double least_width) {
  const auto num_points = static_cast<Eigen::Index>(points.size());
  Eigen::Matrix3Xd d(3, num_points);
  for (Eigen::Index k = 0; k < num_points; ++k)
    d.col(k) = scene.points[static_cast<std::size_t>(points[index(k)])].position;
  d.colwise() -= Eigen::Vector3d(d.col(0));
  d.colwise() -= Eigen::Vector3d(d.rowwise().mean());
  const Eigen::Matrix3d second_moment = d * d.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(
      second_moment.trace() * Eigen::Matrix3d::Identity() - second_moment);
  Eigen::Vector3d moments = eigen.eigenvalues();
  const bool is_thin = moments[0] <= kThin * moments[2];
  // the moment about the line of a thin shape is computed from distances to the line, which keep their digits
  if (is_thin) moments[0] = d.colwise().cross(Eigen::Vector3d(eigen.eigenvectors().col(0))).squaredNorm();
  const Eigen::Vector3d inverse = moments.unaryExpr(
      [&](double moment) { return moment > least_width * least_width * moments[2] ? 1.0 / moment : 0.0; });
  const Eigen::Matrix3d J_inverse =
      eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
  Eigen::MatrixXd rotation(3, 3 * num_points);
  for (Eigen::Index k = 0; k < num_points; ++k) {
    Eigen::Matrix3d cross;
    cross << 0.0, -d(2, k), d(1, k), d(2, k), 0.0, -d(0, k), -d(1, k), d(0, k), 0.0;
    // A thin shape is treated axis by axis, because in one matrix the large inverse moment would destroy the
    // digits of the small inverse moments
    if (is_thin)
      rotation.middleCols<3>(3 * k) =
          eigen.eigenvectors() * (inverse.asDiagonal() * (eigen.eigenvectors().transpose() * cross)).eval();
    else
      rotation.middleCols<3>(3 * k) = J_inverse * cross;
  }
  return rotation;
}

Eigen::MatrixXd body_rotation(const Scene& scene, const std::vector<int>& points) {
  // If the points are on a line, the smallest moment is a rounding error. The least width of 0.5 excludes
  // this moment
  return mean_rotation(scene, points, line_of(scene, points).isZero(0.0) ? 0.0 : 0.5);
}

// theta = J^-1 sum d_k x V_k + theta_par e_par   (THEORY 3.43, 3.44)
void rotate_with_bodies(const Scene& scene, const Freedoms& freedoms, const Eigen::MatrixXd& shapes,
                        Eigen::MatrixXd& rotations) {
  for (int point = 0; point < static_cast<int>(scene.points.size()); ++point) {
    const int body = freedoms.body_of(point);
    if (body < 0 || !freedoms.has_joint(point)) continue;
    const std::vector<int>& points = scene.links[index(body)].points;
    const Eigen::MatrixXd weights = body_rotation(scene, points);
    Eigen::MatrixXd rotation = Eigen::MatrixXd::Zero(3, shapes.cols());
    for (std::size_t k = 0; k < points.size(); ++k)
      rotation += weights.middleCols<3>(3 * static_cast<Eigen::Index>(k)) *
                  shapes.middleRows<3>(3 * Eigen::Index{points[k]});
    if (const int about = freedoms.about_line(body); about >= 0)
      rotation += line_of(scene, points) * rotations.row(about - freedoms.num_displacements());
    rotations.middleRows<3>(freedoms.rotation(point) - freedoms.num_displacements()) = rotation;
  }
}

std::map<int, Eigen::Matrix3Xd> local_rotations(const Scene& scene, const LinkFactor& factor,
                                                const Structure& structure) {
  const Freedoms freedoms(scene);
  std::set<int> wanted;
  for (const Load& load : scene.loads)
    if (load.axes == Axes::kLocal)
      for (const PointLoad& each : load.forces) wanted.insert(each.point);
  std::map<int, Eigen::Matrix3Xd> rotations;
  for (const int point : wanted)
    rotations[point] = are_point_masses(scene) && !factor.is_sparse
                           ? Eigen::MatrixXd(rotation_at(scene, factor, freedoms, point) * structure.shapes)
                           : rotation_of(scene, freedoms, structure, point);
  return rotations;
}

}  // namespace freeflex
