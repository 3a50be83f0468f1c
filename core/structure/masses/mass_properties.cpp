#include "core/structure/masses/mass_properties.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>

#include "core/faults.hpp"
#include "core/rounding.hpp"
#include "core/scene/bodies.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

// [-] limit of the ratio of the width to the length of the shape. Below this limit the spin about the line
// loses half of its digits or more
constexpr double kNearlyCollinear = 1e-6;

// M = sum m_i   (THEORY 2.1); p_SB = sum m_i p_i / M   (THEORY 2.3), corrected once for the rounding error;
// r_i = p_i - p_SB   (THEORY 2.2)
void find_centre(const std::vector<PointMass>& points, const std::vector<DistributedMass>& distributed,
                 MassProperties& properties) {
  const auto num_points = static_cast<Eigen::Index>(points.size());
  const Eigen::Index num_all = num_points + static_cast<Eigen::Index>(distributed.size());
  properties.r.resize(3, num_all);
  Eigen::VectorXd mass(num_all);
  for (Eigen::Index i = 0; i < num_points; ++i) {
    mass[i] = points[index(i)].mass;
    properties.r.col(i) = points[index(i)].position + points[index(i)].offset;
  }
  for (Eigen::Index i = num_points; i < num_all; ++i) {
    const DistributedMass& each = distributed[index(i - num_points)];
    mass[i] = each.mass;
    properties.r.col(i) = each.arm;
    for (const auto& [point, share] : each.shares)
      properties.r.col(i) += share * points[index(point)].position;
  }
  properties.mass = mass.sum();
  // sum m r = 0 (THEORY 2.4). Positions are first taken relative to the first point, so a scene far from its
  // origin keeps its digits
  const Eigen::Vector3d first = properties.r.col(0);
  properties.r.colwise() -= first;
  const Eigen::Vector3d offset = properties.r * mass / properties.mass;
  properties.r.colwise() -= offset;
  const Eigen::Vector3d correction = properties.r * mass / properties.mass;
  properties.r.colwise() -= correction;
  properties.p_SB = first + offset + correction;
  properties.centres = properties.r;
  properties.r.conservativeResize(3, num_points);
  for (Eigen::Index i = 0; i < num_points; ++i) properties.r.col(i) -= points[index(i)].offset;
}

// Returns sqrt(m) times the half-axes a_k of the particles of a body, as columns. The sum of their outer
// products is the second moment Pi of the body (THEORY 16.4)
Eigen::Matrix3d root_second_moment(const PointMass& point) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(second_moment(point));
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

// Returns the positions that determine the extent of the shape. For point masses these are the points.
// If there are bodies, the positions are the centres of mass of bodies and of parts of links and, for each
// body with inertia, three more positions. Each of the three is one half-axis a_k away from the centre of
// mass of the body, on one side only.
Eigen::Matrix3Xd extents_of_mass(const Scene& scene, const MassProperties& properties) {
  if (are_point_masses(scene)) return properties.r;
  const std::vector<PointMass>& points = scene.points;
  const Eigen::Index num_distributed = properties.centres.cols() - properties.r.cols();
  Eigen::Matrix3Xd extents(3, 4 * properties.r.cols() + num_distributed);
  extents.leftCols(num_distributed) = properties.centres.rightCols(num_distributed);
  Eigen::Index count = num_distributed;
  for (Eigen::Index i = 0; i < properties.r.cols(); ++i) {
    const PointMass& point = points[index(i)];
    if (point.mass == 0.0) continue;
    extents.col(count++) = properties.centres.col(i);
    if (point.inertia.isZero(0.0)) continue;
    extents.middleCols<3>(count) = root_second_moment(point) / std::sqrt(point.mass);
    extents.middleCols<3>(count).colwise() += Eigen::Vector3d(properties.centres.col(i));
    count += 3;
  }
  return extents.leftCols(count);
}

// I = sum m ((r . r) 1 - r r^T)   (THEORY 2.5). The principal axes u_k and the singular values chi_k come
// from (sqrt(m_1) r_1, ...) = (u_1 u_2 u_3) diag(chi) Y_r^T   (THEORY 2.6); I_1 = chi_2^2 + chi_3^2 and so on
// (THEORY 2.7). Squares of singular values keep digits that an eigensolver on I loses for thin shapes.
void find_inertia(const std::vector<PointMass>& points, const std::vector<DistributedMass>& distributed,
                  MassProperties& properties) {
  const auto num_points = static_cast<Eigen::Index>(points.size());
  const auto num_distributed = static_cast<Eigen::Index>(distributed.size());
  const auto has_inertia = [](const PointMass& point) { return !point.inertia.isZero(0.0); };
  const Eigen::Index num_with_inertia = std::count_if(points.begin(), points.end(), has_inertia);
  Eigen::Matrix3Xd weighted = Eigen::Matrix3Xd::Zero(
      3, std::max<Eigen::Index>(3, num_points + num_distributed + 3 * num_with_inertia));
  for (Eigen::Index i = num_points; i < num_points + num_distributed; ++i)
    weighted.col(i) = std::sqrt(distributed[index(i - num_points)].mass) * properties.centres.col(i);
  Eigen::Index next = num_points + num_distributed;
  for (Eigen::Index i = 0; i < num_points; ++i) {
    const PointMass& point = points[index(i)];
    weighted.col(i) = std::sqrt(point.mass) * properties.centres.col(i);
    if (!has_inertia(point)) continue;
    weighted.middleCols<3>(next) = root_second_moment(point);
    next += 3;
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(weighted, Eigen::ComputeThinU);
  const Eigen::Array3d square = svd.singularValues().array().square();
  properties.principal << square[1] + square[2], square[0] + square[2], square[0] + square[1];
  properties.principal_axes = svd.matrixU();
  if (properties.principal_axes.determinant() < 0.0) properties.principal_axes.col(2) *= -1.0;
  const Eigen::Matrix3d second_moment = weighted * weighted.transpose();
  properties.inertia = second_moment.trace() * Eigen::Matrix3d::Identity() - second_moment;
}

}  // namespace

MassProperties find_mass_properties(const Scene& scene, Faults& faults) {
  assert(!scene.points.empty());
  const std::vector<PointMass>& points = scene.points;
  const std::vector<DistributedMass> distributed = distributed_masses(scene);
  MassProperties properties;
  find_centre(points, distributed, properties);
  find_inertia(points, distributed, properties);
  properties.line.setZero();
  const Eigen::Matrix3Xd extents = extents_of_mass(scene, properties);
  if (extents.cols() == 1) {
    properties.rigid_freedoms = 3;
    properties.principal_axes.setIdentity();
    return properties;
  }
  const double length = std::sqrt(extents.colwise().squaredNorm().maxCoeff());
  double largest_coordinate = 0.0;
  for (const PointMass& point : points)
    largest_coordinate = std::max(largest_coordinate, point.position.cwiseAbs().maxCoeff());
  if (length <= 4.0 * kEpsilon * largest_coordinate) {
    add_error(faults, points.front().origin,
              join_text("all ", points.size(),
                        " points are in one place, but a structure of more than one point needs "
                        "at least two places; move a point or keep only one"));
    return properties;
  }
  // The shape is collinear if max |r - e (e . r)| <= 64 eps max |coordinate|   (THEORY 2.9). Positions are
  // not weighted by mass, so light points have the same influence as heavy points. The number of rigid
  // freedoms is 3, 5 or 6 (THEORY 2.10)
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(extents, Eigen::ComputeThinU);
  const Eigen::Vector3d line = svd.matrixU().col(0);
  const Eigen::Matrix3Xd across = extents - line * (line.transpose() * extents);
  const double width = std::sqrt(across.colwise().squaredNorm().maxCoeff());
  if (extents.cols() == 2 || width <= kCollinearRoundings * kEpsilon * std::max(length, largest_coordinate)) {
    properties.rigid_freedoms = 5;
    properties.line = line;
    properties.principal[0] = 0.0;
    properties.principal_axes.col(0) = line;
    properties.principal_axes.col(1) = line.unitOrthogonal();
    properties.principal_axes.col(2) = line.cross(properties.principal_axes.col(1));
  } else if (width < kNearlyCollinear * length) {
    add_warning(
        faults, points.front().origin,
        join_text(
            "the points lie within ", width, " m of a line ", length,
            " m long, so the spin about the line is poorly determined; put the points exactly on the line "
            "if that is what is meant"));
  }
  return properties;
}

Eigen::MatrixXd rigid_motions(const MassProperties& properties) {
  const Eigen::Index num_points = properties.r.cols();
  Eigen::MatrixXd motions = Eigen::MatrixXd::Zero(3 * num_points, properties.rigid_freedoms);
  for (int axis = 0; axis < 3; ++axis)
    for (Eigen::Index i = 0; i < num_points; ++i) motions(3 * i + axis, axis) = 1.0;
  // V_i = e_a, then V_i = u_k x r_i   (THEORY 2.11), with the axes of the largest moments first. The omitted
  // rotation of a collinear shape, about its first principal axis, would be the last column
  for (int column = 3; column < properties.rigid_freedoms; ++column) {
    const Eigen::Vector3d axis = properties.principal_axes.col(5 - column);
    for (Eigen::Index i = 0; i < num_points; ++i)
      motions.block<3, 1>(3 * i, column) = axis.cross(properties.r.col(i));
  }
  motions.colwise().normalize();
  return motions;
}

}  // namespace freeflex
