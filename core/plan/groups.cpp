#include "core/plan/groups.hpp"

#include <algorithm>
#include <cmath>

#include "core/plan/arrays.hpp"
#include "core/rounding.hpp"
#include "core/structure/decompositions.hpp"

namespace freeflex {
namespace {}  // namespace

PlanGroup compile_group(const Scene& scene, const Group& group, const MassProperties& body) {
  const auto num_points = static_cast<Eigen::Index>(group.points.size());
  PlanGroup plan;
  plan.name = group.name;
  plan.points.assign(group.points.begin(), group.points.end());
  Eigen::VectorXd mass(num_points);
  for (Eigen::Index k = 0; k < num_points; ++k)
    mass[k] = scene.points[static_cast<std::size_t>(group.points[static_cast<std::size_t>(k)])].mass;
  plan.mass = mass.sum();
  Eigen::Matrix3Xd d = body.r(Eigen::all, group.points);
  const Eigen::Vector3d centre = d * mass / plan.mass;
  d.colwise() -= centre;
  plan.centre = to_array(centre);

  const Eigen::JacobiSVD<Eigen::MatrixXd> shape(d, Eigen::ComputeFullU);
  const double length = std::sqrt(d.colwise().squaredNorm().maxCoeff());
  // the same measure of a line as for the whole body; coordinates are from its centre
  const double rounding = 64.0 * kEpsilon * std::max(1e-300, body.r.cwiseAbs().maxCoeff());
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

}  // namespace freeflex
