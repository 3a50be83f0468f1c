#include "core/structure/masses/particles.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cassert>
#include <cmath>

#include "core/scene/bodies.hpp"
#include "core/structure/links/superelement.hpp"
#include "core/structure/masses/distributed_mass.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

// [-] limit as a fraction of the largest moment. Smaller moments are rounding errors   (THEORY 16.2)
constexpr double kNoMoment = 1e-12;

// returns a particle on a rigid arm from a point, with the displacement V + theta x arm
CarriedMass on_arm(const Freedoms& freedoms, int point, double mass, const Eigen::Vector3d& arm) {
  CarriedMass each{.mass = mass, .point = point, .arm = arm, .shares = {{point, 1.0}}, .displacement = {}};
  for (int axis = 0; axis < 3; ++axis) {
    auto& row = each.displacement[index(axis)];
    row.emplace_back(3 * point + axis, 1.0);
    if (arm.isZero(0.0)) continue;
    const Eigen::Vector3d lever = arm.cross(Eigen::Vector3d::Unit(axis));
    for (int k = 0; k < 3; ++k) row.emplace_back(freedoms.rotation(point) + k, lever[k]);
  }
  return each;
}

}  // namespace

std::vector<CarriedMass> carried_masses(const Scene& scene, const Freedoms& freedoms) {
  std::vector<CarriedMass> all;
  for (int i = 0; i < static_cast<int>(scene.points.size()); ++i) {
    const PointMass& each = scene.points[index(i)];
    if (each.inertia.isZero(0.0)) {
      if (each.mass > 0.0) all.push_back(on_arm(freedoms, i, each.mass, each.offset));
    } else {
      for (const Eigen::Vector3d& corner : corners_of(each))
        all.push_back(on_arm(freedoms, i, 0.25 * each.mass, corner));
    }
  }
  for (const DistributedMass& part : distributed_masses(scene))
    if (matrices_of(scene.links[index(part.link)]) == nullptr)
      all.push_back({.mass = part.mass,
                     .link = part.link,
                     .shares = part.shares,
                     .displacement = displacement_of(scene, freedoms, part)});
  return all;
}

// A_m y: sqrt(m) (V + theta x d), sqrt(J_k) theta . j_k   (THEORY 16.2), so that y'^T A_m^T A_m y' / 2 is
// m |V' + theta' x d|^2 / 2 + theta' . J theta' / 2   (THEORY 16.1)
DeformationRows mass_rows(const Scene& scene, const Freedoms& freedoms, double length) {
  DeformationRows rows;
  for (int i = 0; i < static_cast<int>(scene.points.size()); ++i) {
    const PointMass& each = scene.points[index(i)];
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
  for (int i = 0; i < static_cast<int>(scene.links.size()); ++i)
    if (const Link& link = scene.links[index(i)]; has_mass(link))
      for (DeformationRow& row : matrices_of(link) != nullptr ? superelement_mass_rows(scene, i, freedoms)
                                                              : distributed_mass_rows(scene, freedoms, i))
        rows.push_back(std::move(row));
  rotate_with_bodies(scene, freedoms, rows);
  return rows;
}

Particles find_particles(const Scene& scene, const Freedoms& freedoms, const Structure& structure) {
  assert(structure.shapes.rows() == freedoms.num_displacements() &&
         structure.rotations.rows() == freedoms.num_rotations());
  const std::vector<CarriedMass> carried = carried_masses(scene, freedoms);
  const auto count = static_cast<Eigen::Index>(carried.size());
  const Eigen::MatrixXd &shapes = structure.shapes, &rotations = structure.rotations;
  Particles particles;
  particles.mass.resize(count);
  particles.r = Eigen::Matrix3Xd::Zero(3, count);
  particles.shapes = Eigen::MatrixXd::Zero(3 * count, shapes.cols());
  for (Eigen::Index p = 0; p < count; ++p) {
    const CarriedMass& each = carried[index(p)];
    particles.mass[p] = each.mass;
    for (const auto& [point, share] : each.shares)
      particles.r.col(p) += share * structure.mass_properties.r.col(point);
    particles.r.col(p) += each.arm;
    if (shapes.cols() == 0) continue;
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      for (const auto& [freedom, coefficient] : each.displacement[index(axis)])
        particles.shapes.row(3 * p + axis) +=
            coefficient *
            (freedom < shapes.rows() ? shapes.row(freedom) : rotations.row(freedom - shapes.rows()));
  }
  return particles;
}

std::vector<RotatingBody> rotating_bodies(const Scene& scene, const Structure& structure) {
  std::vector<RotatingBody> bodies;
  const Freedoms freedoms(scene);
  const std::vector<CarriedMass> carried = carried_masses(scene, freedoms);
  // carried_masses() lists the particles of points before the parts of links
  for (std::size_t p = 0, end = 0; p < carried.size() && carried[p].point >= 0; p = end) {
    const int point = carried[p].point;
    while (end < carried.size() && carried[end].point == point) ++end;
    if (!has_attitude(scene.points[index(point)])) continue;
    RotatingBody body;
    body.theta = structure.rotations.middleRows<3>(freedoms.rotation(point) - freedoms.num_displacements());
    body.arms.setZero();
    body.arm.setZero();
    for (std::size_t k = p; k < end; ++k) body.arm += carried[k].mass * carried[k].arm;
    for (std::size_t k = p; k < end; ++k)
      body.arms += carried[k].mass * structure.particles.r.col(static_cast<Eigen::Index>(k)) *
                   carried[k].arm.transpose();
    bodies.push_back(std::move(body));
  }
  return bodies;
}

// g_kl = (theta_k x (theta_l x d_p) + theta_l x (theta_k x d_p)) / 2   (THEORY 12.46)
//      = D_kl d_p, D_kl = (theta_k theta_l^T + theta_l theta_k^T) / 2 - (theta_k . theta_l) 1,
// so sum m r g_kl^T = (sum m r d_p^T) D_kl. With x_2 = sum_kl q_k q_l g_kl / 2 the kinetic energy gains
// sum m (w x r) . (x_2' + w x x_2)   (THEORY 12.47), hence G_kl = sum m r x g_kl and
// Z_kl,ab = sum m (b_k,a b_l,b + r_a g_kl,b)   (THEORY 12.48).
Eigen::MatrixXd second_order(const RotatingBody& body, int a, int b) {
  if (body.theta.cols() == 0) return Eigen::MatrixXd(0, 0);
  const Eigen::RowVectorXd swept = body.arms.row(a) * body.theta, rotation = body.theta.row(b);
  return 0.5 * (swept.transpose() * rotation + rotation.transpose() * swept) -
         body.arms(a, b) * (body.theta.transpose() * body.theta);
}

Eigen::Matrix3d field_moments(const Structure& structure, Eigen::Index mode) {
  Eigen::Matrix3d Y = Eigen::Matrix3d::Zero();
  const Particles& particles = structure.particles;
  const Eigen::MatrixXd& shapes = particle_shapes(structure);
  for (Eigen::Index i = 0; i < particles.mass.size(); ++i)
    Y += particles.mass[i] * particles.r.col(i) * shapes.block<3, 1>(3 * i, mode).transpose();
  Y = (0.5 * (Y + Y.transpose())).eval();
  if (structure.matrix_sums.field.rows() > 0) {
    const Eigen::VectorXd own = structure.matrix_sums.field.col(mode);
    Y += (Eigen::Matrix3d() << own[0], own[3], own[4], own[3], own[1], own[5], own[4], own[5], own[2])
             .finished();
  }
  return Y;
}

}  // namespace freeflex
