#include "core/plan/omit/motion_scope.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/faults.hpp"
#include "core/rounding.hpp"
#include "core/step/array.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

// [-] a moment, or a component along the normal, below this fraction of the sum of its absolute terms is a
// rounding error of the given values
constexpr double kRounding = 1e-12;

bool has_commands(const Scene& scene) { return !scene.pushable.empty() || !scene.groups.empty(); }

std::string name_of_load(const Scene& scene, const Load& load) {
  return "load " + quoted(load.name, static_cast<int>(&load - scene.loads.data()));
}

// Returns the normal of points that lie in a plane within 64 rounding errors (THEORY 11.5). If the points lie
// on a line, the normal is the direction of the spin component normal to the line. Without such a component,
// it is normal to the line and to the first load, initial displacement or initial velocity that is not along
// the line. If the points do not lie in a plane, returns zero.
Eigen::Vector3d plane_normal(const MassProperties& body, const Eigen::Vector3d& spin,
                             const std::vector<Eigen::Vector3d>& directions) {
  if (body.rigid_freedoms == 3) return Eigen::Vector3d::Zero();
  if (body.rigid_freedoms == 5) {
    const Eigen::Vector3d across = spin - body.line * body.line.dot(spin);
    if (!across.isZero(0.0)) return across.normalized();
    for (const Eigen::Vector3d& direction : directions) {
      const Eigen::Vector3d normal = body.line.cross(direction);
      if (normal.norm() > kRounding * direction.norm()) return normal.normalized();
    }
    return body.line.unitOrthogonal();
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> shape(body.r, Eigen::ComputeFullU);
  const Eigen::Vector3d normal = shape.matrixU().col(2);
  const double rounding = 64.0 * kEpsilon * body.r.cwiseAbs().maxCoeff();
  return (normal.transpose() * body.r).cwiseAbs().maxCoeff() <= rounding ? normal : Eigen::Vector3d::Zero();
}

bool is_along(const Eigen::Vector3d& v, const Eigen::Vector3d& normal) {
  return v.cross(normal).norm() <= kRounding * v.norm();
}
bool is_across(const Eigen::Vector3d& v, const Eigen::Vector3d& normal) {
  return std::abs(v.dot(normal)) <= kRounding * v.norm();
}

Eigen::Matrix3d body_from(const Load& load, const Eigen::Matrix3d& R_WB) {
  return load.axes == Axes::kWorld ? Eigen::Matrix3d(R_WB.transpose())
                                   : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
}

// Returns why the body rotates. If nothing rotates the body, the text is empty. A load has a moment if
// |sum r_i x F_i| > 1e-12 sum |r_i| |F_i|   (THEORY 14.4).
std::string find_rotation_cause(const Scene& scene, const Structure& structure, const Eigen::Matrix3d& R_WB) {
  const MassProperties& body = structure.mass_properties;
  if (body.rigid_freedoms == 3) return {};
  Eigen::Vector3d spin = scene.initial.angular_velocity;
  if (body.rigid_freedoms == 5) spin -= body.line * body.line.dot(spin);
  if (!spin.isZero(0.0)) return join_text("it starts with a spin of ", spin.norm(), " rad/s");
  if (scene.attractor.mu > 0.0) return "an attractor turns it";
  if (!scene.feedbacks.empty()) return "forces of feedback may turn it";
  for (const Load& load : scene.loads) {
    if (load.axes == Axes::kLocal) return name_of_load(scene, load) + " follows the elastic motion";
    const Eigen::VectorXd forces = load_forces(scene, structure, load, body_from(load, R_WB));
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    double terms = 0.0;
    for (Eigen::Index i = 0; i < body.r.cols(); ++i) {
      const Eigen::Vector3d force = forces.segment<3>(3 * i), arm = body.r.col(i);
      moment += arm.cross(force);
      terms += arm.norm() * force.norm();
    }
    if (moment.norm() > kRounding * terms)
      return name_of_load(scene, load) + " has a moment about the centre of mass";
  }
  return {};
}

// Returns true if a command can exert a moment about the centre of mass. This needs a group, or a point away
// from the centre of mass.
bool commands_rotate(const Scene& scene, const MassProperties& body) {
  if (body.rigid_freedoms == 3) return false;
  return !scene.groups.empty() || std::any_of(scene.pushable.begin(), scene.pushable.end(),
                                              [&](int point) { return body.r.col(point).norm() > 0.0; });
}

std::vector<Eigen::Vector3d> directions_in_body(const Scene& scene, const Eigen::Matrix3d& R_WB) {
  std::vector<Eigen::Vector3d> directions;
  for (const Load& load : scene.loads) {
    const Eigen::Matrix3d rotation = body_from(load, R_WB);
    for (const PointLoad& each : load.forces) directions.push_back(rotation * each.force);
    for (const WrenchLoad& each : load.wrenches) directions.push_back(rotation * each.force);
  }
  for (const auto& each : scene.initial.points) {
    directions.push_back(each.displacement);
    directions.push_back(each.velocity);
  }
  return directions;
}

// Returns what makes the motion leave the plane with the normal nu. If the motion stays in the plane, the
// text is empty. A load stays in the plane if |nu . F| <= 1e-12 |F| and |T x nu| <= 1e-12 |T|
// (THEORY 14.5).
std::string find_departure_from_plane(const Scene& scene, const Eigen::Vector3d& normal,
                                      const Eigen::Matrix3d& R_WB) {
  if (normal.isZero(0.0)) return "the points do not lie in a plane";
  if (!is_along(scene.initial.angular_velocity, normal))
    return "the initial spin is not about the normal of the plane";
  if (scene.attractor.mu > 0.0) return "an attractor pulls from outside the plane";
  if (!scene.feedbacks.empty()) return "forces of feedback may leave the plane";
  for (const Load& load : scene.loads) {
    const std::string who = name_of_load(scene, load);
    if (load.axes == Axes::kLocal) return who + " follows the elastic motion";
    const Eigen::Matrix3d rotation = body_from(load, R_WB);
    for (const PointLoad& each : load.forces)
      if (!is_across(rotation * each.force, normal)) return who + " leaves the plane";
    for (const WrenchLoad& each : load.wrenches)
      if (!is_across(rotation * each.force, normal) || !is_along(rotation * each.torque, normal))
        return who + " leaves the plane";
  }
  return {};
}

}  // namespace

void add_wrench_forces(const Scene& scene, const Structure& structure, const Group& group,
                       const Eigen::Vector3d& force, const Eigen::Vector3d& torque, Eigen::VectorXd& forces) {
  const MassProperties& body = structure.mass_properties;
  Eigen::VectorXd mass(static_cast<Eigen::Index>(group.points.size()));
  for (std::size_t k = 0; k < group.points.size(); ++k)
    mass[static_cast<Eigen::Index>(k)] = scene.points[index(group.points[k])].mass;
  Eigen::Matrix3Xd d = body.r(Eigen::all, group.points);
  const Eigen::Vector3d centre = d * mass / mass.sum();
  d.colwise() -= centre;
  const Eigen::Matrix3d second = d * mass.asDiagonal() * d.transpose();
  const Eigen::Matrix3d inertia = second.trace() * Eigen::Matrix3d::Identity() - second;
  // Points on a line support no torque about the line, so the least-squares solution omits that component
  // (THEORY 8.9)
  const Eigen::Vector3d rotation =
      Eigen::CompleteOrthogonalDecomposition<Eigen::Matrix3d>(inertia).solve(torque);
  for (std::size_t k = 0; k < group.points.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    forces.segment<3>(3 * Eigen::Index{group.points[k]}) +=
        mass[column] * (force / mass.sum() + rotation.cross(Eigen::Vector3d(d.col(column))));
  }
}

Eigen::VectorXd load_forces(const Scene& scene, const Structure& structure, const Load& load,
                            const Eigen::Matrix3d& rotation) {
  Eigen::VectorXd forces = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(scene.points.size()));
  for (const PointLoad& each : load.forces)
    forces.segment<3>(3 * Eigen::Index{each.point}) += rotation * each.force;
  for (const WrenchLoad& each : load.wrenches)
    add_wrench_forces(scene, structure, scene.groups[index(each.group)], rotation * each.force,
                      rotation * each.torque, forces);
  return forces;
}

MotionScope find_motion_scope(const Scene& scene, const Structure& structure, Fidelity rung,
                              bool with_commands) {
  const MassProperties& body = structure.mass_properties;
  MotionScope scope;
  scope.takes_spin_load = traits_of(rung).takes_spin_load;
  const Eigen::Vector4d q = scene.initial.attitude.stableNormalized();
  scope.R_WB = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();

  scope.why_rotates = find_rotation_cause(scene, structure, scope.R_WB);
  const bool is_rotated_by_commands = commands_rotate(scene, body);
  scope.has_rotation = !scope.why_rotates.empty() || (with_commands && is_rotated_by_commands);
  if (scope.has_rotation && scope.why_rotates.empty())
    scope.why_rotates = "commands may turn it; on_need: refuse or replan would leave it out";
  if (!scope.has_rotation) {
    scope.why_rotates = "no spin, and no load has a moment";
    scope.binds_rotation = is_rotated_by_commands;
    if (scope.binds_rotation) scope.why_rotates += "; commands with one are held back";
  }

  scope.normal = plane_normal(body, scene.initial.angular_velocity, directions_in_body(scene, scope.R_WB));
  scope.why_not_planar = find_departure_from_plane(scene, scope.normal, scope.R_WB);
  const bool is_bound = has_commands(scene);
  scope.is_planar = scope.why_not_planar.empty() && !(with_commands && is_bound);
  if (!scope.is_planar && scope.why_not_planar.empty())
    scope.why_not_planar = "commands may leave the plane; on_need: refuse or replan would leave it out";
  scope.binds_plane = scope.is_planar && is_bound;
  return scope;
}

}  // namespace freeflex
