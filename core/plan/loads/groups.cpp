#include "core/plan/loads/groups.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <span>

#include "core/plan/arrays.hpp"
#include "core/rounding.hpp"
#include "core/structure/links/link_factor.hpp"
#include "core/structure/masses/particles.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

// Returns the rotation rows of a body whose particles are the last `count` particles of the plan
// (THEORY 12.53).
PlanBodyRotation rotation_of_body(const Scene& scene, const Structure& structure, int point, int count,
                                  const StepPlan& plan) {
  PlanBodyRotation rotation;
  rotation.first = static_cast<std::int32_t>(plan.particles.all.size()) - count;
  rotation.count = count;
  rotation.point = point;
  const Eigen::Vector3d offset = scene.points[index(point)].offset;
  rotation.offset = to_array(offset);
  rotation.centre = to_array(Eigen::Vector3d(structure.mass_properties.centres.col(point)));
  const Freedoms freedoms(scene);
  const int first = freedoms.rotation(point) - freedoms.num_displacements();
  for (int axis = 0; axis < 3; ++axis)
    append_row(plan, row_of(structure.rotations, first + axis), rotation.rows);
  return rotation;
}

// Returns the rotation rows of a mass of a link, which is the last particle of the plan. Such a mass is a
// point, so its rotation rows are zero.
PlanBodyRotation rotation_of_link_mass(const StepPlan& plan) {
  PlanBodyRotation rotation;
  rotation.first = static_cast<std::int32_t>(plan.particles.all.size()) - 1;
  rotation.count = 1;
  rotation.centre = plan.particles.all.back().r;
  rotation.rows.assign(3 * index(plan.num_padded), 0.0);
  return rotation;
}

// Finds the points and particles that carry the mass of groups, as indices for mass_point. Adds those
// particles that belong to a group to the plan (THEORY 16.4).
class GroupMasses {
 public:
  GroupMasses(const Scene& scene, const Structure& structure, StepPlan& plan)
      : scene_(scene), structure_(structure), plan_(plan) {
    const std::vector<CarriedMass> carried = carried_masses(scene, Freedoms(scene));
    for (std::size_t p = 0; p < carried.size(); ++p)
      (carried[p].point >= 0 ? of_points_[carried[p].point] : of_links_[carried[p].link]).push_back(p);
  }

  std::vector<std::int32_t> of(const Group& group) {
    std::vector<std::int32_t> masses;
    for (const int point : group.points) {
      const PointMass& each = scene_.points[index(point)];
      const bool has_attitude = structure_.resolved.has_attitude[index(point)];
      if (!has_attitude && each.mass > 0.0) masses.push_back(point);
      if (has_attitude && add(of_points_[point], masses) && is_coupled(plan_))
        plan_.coupled.kinetics.body_rotations.push_back(
            rotation_of_body(scene_, structure_, point, static_cast<int>(of_points_[point].size()), plan_));
    }
    const std::set<int> points(group.points.begin(), group.points.end());
    for (const auto& [link, own] : of_links_) {
      const std::vector<int>& ends = scene_.links[index(link)].points;
      if (!std::all_of(ends.begin(), ends.end(), [&](int end) { return points.count(end) > 0; })) continue;
      for (const std::size_t p : own)
        if (add({p}, masses) && is_coupled(plan_))
          plan_.coupled.kinetics.body_rotations.push_back(rotation_of_link_mass(plan_));
    }
    return masses;
  }

 private:
  // Adds the indices of particles to `masses`, and the particles to the plan unless they are in it. Returns
  // true if at least one of the particles was not in the plan.
  bool add(const std::vector<std::size_t>& particles, std::vector<std::int32_t>& masses) {
    bool are_new = false;
    for (const std::size_t p : particles) {
      const auto [found, is_new] =
          in_plan_.emplace(p, static_cast<std::int32_t>(plan_.points.size() + plan_.particles.all.size()));
      if (is_new) append(static_cast<Eigen::Index>(p));
      are_new = are_new || is_new;
      masses.push_back(found->second);
    }
    return are_new;
  }
  void append(Eigen::Index particle) {
    PlanPoint point;
    point.mass = structure_.particles.mass[particle];
    point.r = to_array(Eigen::Vector3d(structure_.particles.r.col(particle)));
    point.row = num_row_blocks(plan_);
    for (int axis = 0; axis < 3; ++axis)
      append_row(plan_, row_of(structure_.particles.shapes, 3 * particle + axis), plan_.rows);
    plan_.particles.all.push_back(point);
  }

  const Scene& scene_;
  const Structure& structure_;
  StepPlan& plan_;
  std::map<int, std::vector<std::size_t>> of_points_, of_links_;  // particles of each point and link
  std::map<std::size_t, std::int32_t> in_plan_;
};

PlanGroup compile_group(const Group& group, std::span<const std::int32_t> masses, const StepPlan& of,
                        double largest_coordinate) {
  const auto num_points = static_cast<Eigen::Index>(masses.size());
  PlanGroup plan;
  plan.name = group.name;
  plan.points.assign(group.points.begin(), group.points.end());
  Eigen::VectorXd mass(num_points);
  Eigen::Matrix3Xd d(3, num_points);
  for (Eigen::Index k = 0; k < num_points; ++k) {
    const PlanPoint& carrier = mass_point(of, masses[index(k)]);
    mass[k] = carrier.mass;
    d.col(k) = Eigen::Map<const Eigen::Vector3d>(carrier.r.data());
  }
  plan.mass = mass.sum();
  const Eigen::Vector3d centre = d * mass / plan.mass;
  d.colwise() -= centre;
  plan.centre = to_array(centre);

  const Eigen::JacobiSVD<Eigen::MatrixXd> shape(d, Eigen::ComputeFullU);
  const double length = std::sqrt(d.colwise().squaredNorm().maxCoeff());
  // the limit of (THEORY 2.9), with coordinates relative to the centre of mass of the body
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

void compile_groups(const Scene& scene, const Structure& structure, StepPlan& plan) {
  assert(plan.points.size() == scene.points.size());
  const double largest = structure.mass_properties.r.cwiseAbs().maxCoeff();
  const bool has_particles = !structure.resolved.are_point_masses;
  std::optional<GroupMasses> mass;
  if (has_particles && !scene.groups.empty()) mass.emplace(scene, structure, plan);
  for (const Group& group : scene.groups) {
    std::vector<std::int32_t> masses(group.points.begin(), group.points.end());
    if (has_particles) {
      masses = mass->of(group);
      plan.particles.of_groups.push_back(masses);
    }
    plan.groups.push_back(compile_group(group, masses, plan, largest));
  }
}

}  // namespace freeflex
