#include "core/plan/groups.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>

#include "core/plan/arrays.hpp"
#include "core/rounding.hpp"
#include "core/scene/bodies.hpp"
#include "core/structure/decompositions.hpp"
#include "core/structure/link_factor.hpp"
#include "core/structure/particles.hpp"

namespace freeflex {
namespace {

// X197: how a body's particles, the last of the plan, turn
PlanTurn turn_of(const Scene& scene, const Structure& structure, int point, int count, const Plan& plan) {
  PlanTurn turn;
  turn.first = static_cast<std::int32_t>(plan.particles.all.size()) - count;
  turn.count = count;
  const Eigen::Vector3d offset = scene.points[static_cast<std::size_t>(point)].offset;
  turn.offset = to_array(offset);
  turn.centre = to_array(Eigen::Vector3d(structure.mass_properties.centres.col(point)));
  const Freedoms freedoms(scene);
  for (int axis = 0; axis < 3; ++axis)
    append_row(plan, structure.turns.row(freedoms.rotation(point) - freedoms.num_displacements() + axis),
               turn.rows);
  return turn;
}

// what carries the mass of a group's points: indices for mass_point
std::vector<std::int32_t> parts_of(const Scene& scene, const Group& group, const Structure& structure,
                                   Plan& plan, std::map<int, std::vector<std::int32_t>>& of_bodies) {
  std::vector<std::int32_t> parts;
  const std::vector<CarriedMass> carried = carried_masses(scene.points);
  for (const int point : group.points) {
    const PointMass& each = scene.points[static_cast<std::size_t>(point)];
    if (!has_attitude(each)) {
      if (each.mass > 0.0) parts.push_back(point);
      continue;
    }
    auto& own = of_bodies[point];
    for (std::size_t p = 0; p < carried.size() && own.empty(); ++p) {
      for (; p < carried.size() && carried[p].point == point; ++p) {
        const auto column = static_cast<Eigen::Index>(p);
        PlanPoint part;
        part.mass = carried[p].mass;
        part.r = to_array(Eigen::Vector3d(structure.particles.r.col(column)));
        part.row = num_row_blocks(plan);
        for (int axis = 0; axis < 3; ++axis)
          append_row(plan, structure.particles.shapes.row(3 * column + axis), plan.rows);
        own.push_back(static_cast<std::int32_t>(plan.points.size() + plan.particles.all.size()));
        plan.particles.all.push_back(part);
      }
      if (!own.empty() && is_coupled(plan))
        plan.coupled.kinetics.turns.push_back(
            turn_of(scene, structure, point, static_cast<int>(own.size()), plan));
    }
    parts.insert(parts.end(), own.begin(), own.end());
  }
  return parts;
}

PlanGroup compile_group(const Group& group, std::span<const std::int32_t> parts, const Plan& of,
                        double largest_coordinate) {
  const auto num_points = static_cast<Eigen::Index>(parts.size());
  PlanGroup plan;
  plan.name = group.name;
  plan.points.assign(group.points.begin(), group.points.end());
  Eigen::VectorXd mass(num_points);
  Eigen::Matrix3Xd d(3, num_points);
  for (Eigen::Index k = 0; k < num_points; ++k) {
    const PlanPoint& part = mass_point(of, parts[static_cast<std::size_t>(k)]);
    mass[k] = part.mass;
    d.col(k) = Eigen::Map<const Eigen::Vector3d>(part.r.data());
  }
  plan.mass = mass.sum();
  const Eigen::Vector3d centre = d * mass / plan.mass;
  d.colwise() -= centre;
  plan.centre = to_array(centre);

  const Eigen::JacobiSVD<Eigen::MatrixXd> shape(d, Eigen::ComputeFullU);
  const double length = std::sqrt(d.colwise().squaredNorm().maxCoeff());
  // the same measure of a line as for the whole body; coordinates are from its centre
  const double rounding = 64.0 * kEpsilon * std::max(1e-300, largest_coordinate);
  const Eigen::Vector3d line = shape.matrixU().col(0);
  const Eigen::Matrix3Xd across = d - line * (line.transpose() * d);
  const double width = std::sqrt(across.colwise().squaredNorm().maxCoeff());
  plan.torque_rank = length <= rounding ? 0 : (num_points == 2 || width <= rounding ? 2 : 3);
  if (plan.torque_rank == 2) plan.line = to_array(line);
  if (plan.torque_rank == 0) return plan;

  const Eigen::Matrix3Xd weighted = d * mass.cwiseSqrt().asDiagonal();
  const Eigen::Matrix3d second_moment = weighted * weighted.transpose();
  const Eigen::Matrix3d inertia = second_moment.trace() * Eigen::Matrix3d::Identity() - second_moment;
  if (plan.torque_rank == 2) {
    const Eigen::Matrix3d normal = Eigen::Matrix3d::Identity() - line * line.transpose();
    plan.inverse_inertia = to_array(Eigen::Matrix3d(normal / second_moment.trace()));
  } else {
    plan.inverse_inertia = to_array(Eigen::Matrix3d(inertia.inverse()));
  }
  return plan;
}

}  // namespace

void compile_groups(const Scene& scene, const Structure& structure, Plan& plan) {
  const double largest = structure.mass_properties.r.cwiseAbs().maxCoeff();
  std::map<int, std::vector<std::int32_t>> of_bodies;
  for (const Group& group : scene.groups) {
    std::vector<std::int32_t> parts(group.points.begin(), group.points.end());
    if (!are_point_masses(scene.points)) {
      parts = parts_of(scene, group, structure, plan, of_bodies);
      plan.particles.of_groups.push_back(parts);
    }
    plan.groups.push_back(compile_group(group, parts, plan, largest));
  }
}

}  // namespace freeflex
