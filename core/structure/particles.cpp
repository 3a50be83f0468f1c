#include "core/structure/particles.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "core/scene/bodies.hpp"
#include "core/structure/decompositions.hpp"

namespace freeflex {
namespace {

// [-] of the largest moment: smaller ones are rounding
constexpr double kNoMoment = 1e-12;

// X160: of S_k = (tr J) / 2 - J_k the positive ones
std::vector<CarriedMass> corners(const PointMass& body, int point) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(second_moment(body));
  const Eigen::Vector3d S = eigen.eigenvalues().cwiseMax(0.0);
  const Eigen::Matrix3d arms = eigen.eigenvectors() * (S / body.mass).cwiseSqrt().asDiagonal();
  static const std::array<Eigen::Vector3d, 4> kSigns{
      Eigen::Vector3d{1.0, 1.0, 1.0}, {1.0, -1.0, -1.0}, {-1.0, 1.0, -1.0}, {-1.0, -1.0, 1.0}};
  std::vector<CarriedMass> all;
  for (const Eigen::Vector3d& sign : kSigns)
    all.push_back({point, 0.25 * body.mass, Eigen::Vector3d(body.offset + arms * sign)});
  return all;
}

}  // namespace

std::vector<CarriedMass> carried_masses(const std::vector<PointMass>& points) {
  std::vector<CarriedMass> all;
  for (int i = 0; i < static_cast<int>(points.size()); ++i) {
    const PointMass& each = points[static_cast<std::size_t>(i)];
    if (each.inertia.isZero(0.0)) {
      if (each.mass > 0.0) all.push_back({i, each.mass, each.offset});
    } else {
      const auto own = corners(each, i);
      all.insert(all.end(), own.begin(), own.end());
    }
  }
  return all;
}

DeformationRows mass_rows(const Scene& scene, const Freedoms& freedoms, double length) {
  DeformationRows rows;
  for (int i = 0; i < static_cast<int>(scene.points.size()); ++i) {
    const PointMass& each = scene.points[static_cast<std::size_t>(i)];
    for (int axis = 0; axis < 3 && each.mass > 0.0; ++axis) {
      DeformationRow row;
      row.coefficients.emplace_back(3 * i + axis, 1.0);
      if (!each.offset.isZero(0.0))
        add_vector(row, freedoms.rotation(i), 1.0, each.offset.cross(Eigen::Vector3d::Unit(axis)));
      row.root_stiffness = std::sqrt(each.mass);
      rows.push_back(std::move(row));
    }
    if (each.inertia.isZero(0.0)) continue;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(each.inertia);
    for (int k = 0; k < 3; ++k) {
      const double moment = eigen.eigenvalues()[k];
      if (moment <= kNoMoment * eigen.eigenvalues()[2]) continue;
      DeformationRow row;
      add_vector(row, freedoms.rotation(i), 1.0, eigen.eigenvectors().col(k));
      row.root_stiffness = std::sqrt(moment);
      row.unit_scale = length;
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

Particles find_particles(const Scene& scene, const Freedoms& freedoms, const Structure& structure) {
  const std::vector<CarriedMass> carried = carried_masses(scene.points);
  const auto count = static_cast<Eigen::Index>(carried.size());
  Particles particles;
  particles.mass.resize(count);
  particles.r.resize(3, count);
  particles.shapes.resize(3 * count, structure.shapes.cols());
  for (Eigen::Index p = 0; p < count; ++p) {
    const CarriedMass& each = carried[static_cast<std::size_t>(p)];
    particles.mass[p] = each.mass;
    particles.r.col(p) = structure.mass_properties.r.col(each.point) + each.arm;
    auto shape = particles.shapes.middleRows<3>(3 * p);
    shape = structure.shapes.middleRows<3>(3 * Eigen::Index{each.point});
    if (each.arm.isZero(0.0)) continue;
    const auto theta =
        structure.turns.middleRows<3>(freedoms.rotation(each.point) - freedoms.num_displacements());
    for (Eigen::Index mode = 0; mode < shape.cols(); ++mode)
      shape.col(mode) += Eigen::Vector3d(theta.col(mode)).cross(each.arm);
  }
  return particles;
}

std::vector<TurningBody> turning_bodies(const Scene& scene, const Structure& structure) {
  std::vector<TurningBody> bodies;
  const Freedoms freedoms(scene);
  const std::vector<CarriedMass> carried = carried_masses(scene.points);
  for (std::size_t p = 0, end = 0; p < carried.size(); p = end) {
    const int point = carried[p].point;
    while (end < carried.size() && carried[end].point == point) ++end;
    if (!has_attitude(scene.points[static_cast<std::size_t>(point)])) continue;
    TurningBody body;
    body.theta = structure.turns.middleRows<3>(freedoms.rotation(point) - freedoms.num_displacements());
    body.arms.setZero();
    for (std::size_t k = p; k < end; ++k)
      body.arms += carried[k].mass * structure.particles.r.col(static_cast<Eigen::Index>(k)) *
                   carried[k].arm.transpose();
    bodies.push_back(std::move(body));
  }
  return bodies;
}

// g_kl = D_kl a, D_kl = (theta_k theta_l^T + theta_l theta_k^T) / 2 - (theta_k . theta_l) 1, so that the sum
// is that of arms D_kl
Eigen::MatrixXd second_order(const TurningBody& body, int a, int b) {
  const Eigen::RowVectorXd swept = body.arms.row(a) * body.theta, turn = body.theta.row(b);
  return 0.5 * (swept.transpose() * turn + turn.transpose() * swept) -
         body.arms(a, b) * (body.theta.transpose() * body.theta);
}

Eigen::Matrix3d second_order_of_pair(const TurningBody& body, Eigen::Index k, Eigen::Index l) {
  const Eigen::Vector3d theta = body.theta.col(k), other = body.theta.col(l);
  const Eigen::Matrix3d outer = theta * other.transpose();
  return body.arms * (0.5 * (outer + outer.transpose()) - theta.dot(other) * Eigen::Matrix3d::Identity());
}

}  // namespace freeflex
