#include "core/structure/mass_properties.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "core/rounding.hpp"
#include "core/scene/bodies.hpp"
#include "core/scene/faults.hpp"
#include "core/structure/decompositions.hpp"

namespace freeflex {
namespace {

// [-] width over length below which half or more of the digits of the spin about the line are lost
constexpr double kNearlyCollinear = 1e-6;

// (1.1), (1.3), (1.4): centre of mass, and rest positions from it, corrected once for the rounding of the sum
void find_centre(const std::vector<PointMass>& points, const std::vector<SpreadMass>& spread,
                 MassProperties& properties) {
  const auto num_points = static_cast<Eigen::Index>(points.size());
  const Eigen::Index num_all = num_points + static_cast<Eigen::Index>(spread.size());
  properties.r.resize(3, num_all);
  Eigen::VectorXd mass(num_all);
  for (Eigen::Index i = 0; i < num_points; ++i) {
    mass[i] = points[static_cast<std::size_t>(i)].mass;
    properties.r.col(i) =
        points[static_cast<std::size_t>(i)].position + points[static_cast<std::size_t>(i)].offset;
  }
  for (Eigen::Index i = num_points; i < num_all; ++i) {
    const SpreadMass& each = spread[static_cast<std::size_t>(i - num_points)];
    mass[i] = each.mass;
    properties.r.col(i) = each.arm;
    for (const auto& [point, share] : each.shares)
      properties.r.col(i) += share * points[static_cast<std::size_t>(point)].position;
  }
  properties.mass = mass.sum();
  // sum m r = 0 (2.4); sums start from the first point: a scene far from its origin keeps its digits
  const Eigen::Vector3d first = properties.r.col(0);
  properties.r.colwise() -= first;
  const Eigen::Vector3d offset = properties.r * mass / properties.mass;
  properties.r.colwise() -= offset;
  const Eigen::Vector3d correction = properties.r * mass / properties.mass;
  properties.r.colwise() -= correction;
  properties.p_SB = first + offset + correction;
  properties.centres = properties.r;
  properties.r.conservativeResize(3, num_points);
  for (Eigen::Index i = 0; i < num_points; ++i)
    properties.r.col(i) -= points[static_cast<std::size_t>(i)].offset;
}

// X160: columns whose outer products sum to the second moment of a body about its own centre
Eigen::Matrix3d root_second_moment(const PointMass& point) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(second_moment(point));
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

// what has extent: the points, or, where they are more than point masses, the centres of what has mass and
// the radii of gyration about them (a column to either side counts as one)
Eigen::Matrix3Xd places_of_mass(const Scene& scene, const MassProperties& properties) {
  if (are_point_masses(scene)) return properties.r;
  const std::vector<PointMass>& points = scene.points;
  const Eigen::Index num_spread = properties.centres.cols() - properties.r.cols();
  Eigen::Matrix3Xd places(3, 4 * properties.r.cols() + num_spread);
  places.leftCols(num_spread) = properties.centres.rightCols(num_spread);
  Eigen::Index count = num_spread;
  for (Eigen::Index i = 0; i < properties.r.cols(); ++i) {
    const PointMass& point = points[static_cast<std::size_t>(i)];
    if (point.mass == 0.0) continue;
    places.col(count++) = properties.centres.col(i);
    if (point.inertia.isZero(0.0)) continue;
    places.middleCols<3>(count) = root_second_moment(point) / std::sqrt(point.mass);
    places.middleCols<3>(count).colwise() += Eigen::Vector3d(properties.centres.col(i));
    count += 3;
  }
  return places.leftCols(count);
}

// X40, X41: principal moments from the singular values s of sqrt(m) r, I_1 = s_2^2 + s_3^2 and so
// on. Squares of singular values keep the digits that an eigensolver on the inertia tensor loses for thin
// shapes.
void find_inertia(const std::vector<PointMass>& points, const std::vector<SpreadMass>& spread,
                  MassProperties& properties) {
  const auto num_points = static_cast<Eigen::Index>(points.size());
  const auto num_spread = static_cast<Eigen::Index>(spread.size());
  const auto has_inertia = [](const PointMass& point) { return !point.inertia.isZero(0.0); };
  const Eigen::Index num_turning = std::count_if(points.begin(), points.end(), has_inertia);
  Eigen::Matrix3Xd weighted =
      Eigen::Matrix3Xd::Zero(3, std::max<Eigen::Index>(3, num_points + num_spread + 3 * num_turning));
  for (Eigen::Index i = num_points; i < num_points + num_spread; ++i)
    weighted.col(i) =
        std::sqrt(spread[static_cast<std::size_t>(i - num_points)].mass) * properties.centres.col(i);
  Eigen::Index next = num_points + num_spread;
  for (Eigen::Index i = 0; i < num_points; ++i) {
    const PointMass& point = points[static_cast<std::size_t>(i)];
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
  const std::vector<PointMass>& points = scene.points;
  const std::vector<SpreadMass> spread = spread_masses(scene);
  MassProperties properties;
  find_centre(points, spread, properties);
  find_inertia(points, spread, properties);
  properties.line.setZero();
  const Eigen::Matrix3Xd places = places_of_mass(scene, properties);
  if (places.cols() == 1) {
    properties.rigid_freedoms = 3;
    properties.principal_axes.setIdentity();
    return properties;
  }
  const double length = std::sqrt(places.colwise().squaredNorm().maxCoeff());
  double largest_coordinate = 0.0;
  for (const PointMass& point : points)
    largest_coordinate = std::max(largest_coordinate, point.position.cwiseAbs().maxCoeff());
  if (length <= 4.0 * kEpsilon * largest_coordinate) {
    add_error(faults, points.front().origin,
              join_text("all ", points.size(),
                        " points are in one place; a structure of more than one point needs "
                        "at least two places: move a point or keep only one"));
    return properties;
  }
  // X42: distance of the farthest point from the best line. Unweighted, so that light points count as heavy
  // ones do.
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(places, Eigen::ComputeThinU);
  const Eigen::Vector3d line = svd.matrixU().col(0);
  const Eigen::Matrix3Xd across = places - line * (line.transpose() * places);
  const double width = std::sqrt(across.colwise().squaredNorm().maxCoeff());
  if (places.cols() == 2 || width <= kCollinearRoundings * kEpsilon * std::max(length, largest_coordinate)) {
    properties.rigid_freedoms = 5;
    properties.line = line;
    properties.principal[0] = 0.0;
    properties.principal_axes.col(0) = line;
    properties.principal_axes.col(1) = line.unitOrthogonal();
    properties.principal_axes.col(2) = line.cross(properties.principal_axes.col(1));
  } else if (width < kNearlyCollinear * length) {
    add_warning(
        faults, points.front().origin,
        join_text("the points lie within ", width, " m of a line ", length,
                  " m long: the spin about the line is poorly determined; put the points exactly on the line "
                  "if that is what is meant"));
  }
  return properties;
}

Eigen::MatrixXd rigid_motions(const MassProperties& properties) {
  const Eigen::Index num_points = properties.r.cols();
  Eigen::MatrixXd motions = Eigen::MatrixXd::Zero(3 * num_points, properties.rigid_freedoms);
  for (int axis = 0; axis < 3; ++axis)
    for (Eigen::Index i = 0; i < num_points; ++i) motions(3 * i + axis, axis) = 1.0;
  // the axes of the largest moments first: the first principal axis is the one a collinear shape has no
  // freedom about
  for (int column = 3; column < properties.rigid_freedoms; ++column) {
    const Eigen::Vector3d axis = properties.principal_axes.col(5 - column);
    for (Eigen::Index i = 0; i < num_points; ++i)
      motions.block<3, 1>(3 * i, column) = axis.cross(properties.r.col(i));
  }
  motions.colwise().normalize();
  return motions;
}

}  // namespace freeflex
