#include "core/scene/bodies.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/scene/faults.hpp"

namespace freeflex {

bool has_attitude(const PointMass& point) { return !point.inertia.isZero(0.0) || !point.offset.isZero(0.0); }

bool are_point_masses(const std::vector<PointMass>& points) {
  return std::all_of(points.begin(), points.end(),
                     [](const PointMass& point) { return point.mass > 0.0 && !has_attitude(point); });
}

Eigen::Matrix3d second_moment(const PointMass& point) {
  return 0.5 * point.inertia.trace() * Eigen::Matrix3d::Identity() - point.inertia;
}

std::string inertia_problem(const Eigen::Matrix3d& inertia) {
  // [-] of the largest moment: what printed tables of seven digits leave open
  constexpr double kRounding = 1e-6;
  if (!inertia.allFinite()) return "inertia is not finite";
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(inertia, Eigen::EigenvaluesOnly);
  const Eigen::Vector3d moments = eigen.eigenvalues();  // ascending
  const double least = -kRounding * moments[2];
  if (moments[0] < least)
    return join_text("inertia has the principal moment ", moments[0],
                     " kg m^2, must be >= 0; the entries of the matrix are wanted, products of inertia as "
                     "-sum m x y");
  if (moments[0] + moments[1] - moments[2] < least)
    return join_text("inertia has the principal moments ", moments.transpose(),
                     " kg m^2: no mass has one above the sum of the two others; check the order and that "
                     "they are about the centre of mass");
  return {};
}

}  // namespace freeflex
