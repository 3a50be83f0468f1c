#include "core/paper/force_groups.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

using Vectors = Eigen::Matrix3Xd;

// a shape is planar if its thickness is at most this number of rounding errors of the largest coordinate
// (THEORY 11.5)
constexpr double kPlanarRoundings = 64.0;

// Returns the unit normal of the plane that fits the points best. All points have the same weight, so that a
// light point outside the line of the heavy points determines the plane
Eigen::Vector3d plane_normal(const MassProperties& properties) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(properties.r, Eigen::ComputeFullU);
  return svd.matrixU().col(2);
}

// Holds the groups as columns of f. add() adds a force to the column `next`, and end() goes to the next
// column
struct Groups {
  Eigen::MatrixXd f;
  Eigen::Index next = 0;
  void add(int point, const Eigen::Vector3d& force) { f.block<3, 1>(3 * Eigen::Index{point}, next) += force; }
  void end() { ++next; }
};

// Returns the weights divided by the largest magnitude. The results are zero if all weights are zero
template <typename Weights>
Weights scaled(const Weights& weights) {
  const double largest = weights.cwiseAbs().maxCoeff();
  return largest > 0.0 ? Weights(weights / largest) : Weights(Weights::Zero());
}

// Adds a pair of unit forces that pull two points apart: f_i = -(r_j - r_i) / |r_j - r_i|, f_j = -f_i
// (THEORY 11.6)
void add_pair(const Vectors& r, int first, int second, Groups& groups) {
  const Eigen::Vector3d span = r.col(second) - r.col(first);
  const double length = span.stableNorm();
  if (length > 0.0) {
    groups.add(first, -span / length);
    groups.add(second, span / length);
  }
  groups.end();
}

// Adds forces along the line on pairs of neighbours (THEORY 11.6), then forces normal to the line, in two
// directions n, on three neighbours (THEORY 11.7). Here s is the coordinate on the line:
//   (f_1, f_2, f_3) = (s_3 - s_2, -(s_3 - s_1), s_2 - s_1) n
void collinear_groups(const MassProperties& properties, const std::vector<int>& at, Groups& groups) {
  const Eigen::VectorXd s = properties.r.transpose() * properties.line;
  for (std::size_t i = 0; i + 1 < at.size(); ++i) {
    groups.add(at[i], -properties.line);
    groups.add(at[i + 1], properties.line);
    groups.end();
  }
  for (int axis = 1; axis < 3; ++axis) {
    const Eigen::Vector3d across = properties.principal_axes.col(axis);
    for (std::size_t i = 0; i + 2 < at.size(); ++i) {
      const double first = s[at[i + 1]] - s[at[i]], second = s[at[i + 2]] - s[at[i + 1]];
      const Eigen::Vector3d weights = scaled(Eigen::Vector3d(second, -(first + second), first));
      for (std::size_t k = 0; k < 3; ++k)
        groups.add(at[i + k], weights[static_cast<Eigen::Index>(k)] * across);
      groups.end();
    }
  }
}

// Adds pairs of points whose numbers differ by one or two (THEORY 11.6), then groups of forces along the
// normal n on four neighbours a, b, c, d (THEORY 11.8), where A is the signed area of three points:
//   (f_a, f_b, f_c, f_d) = (A_bcd, -A_acd, A_abd, -A_abc) n
void planar_groups(const MassProperties& properties, const std::vector<int>& at, Groups& groups) {
  const Vectors& r = properties.r;
  for (std::size_t apart = 1; apart <= 2; ++apart)
    for (std::size_t i = 0; i + apart < at.size(); ++i) add_pair(r, at[i], at[i + apart], groups);
  const Eigen::Vector3d normal = plane_normal(properties);
  const auto area = [&](int a, int b, int c) {
    return normal.dot((r.col(b) - r.col(a)).cross(r.col(c) - r.col(a)));
  };
  for (std::size_t i = 0; i + 3 < at.size(); ++i) {
    const int a = at[i], b = at[i + 1], c = at[i + 2], d = at[i + 3];
    const Eigen::Vector4d weights =
        scaled(Eigen::Vector4d(area(b, c, d), -area(a, c, d), area(a, b, d), -area(a, b, c)));
    for (std::size_t k = 0; k < 4; ++k) groups.add(at[i + k], weights[static_cast<Eigen::Index>(k)] * normal);
    groups.end();
  }
}

// Returns the forces S [N] (3 x N) that accelerate the points as one rigid body and have the resultant and
// moment L of the given forces F   (THEORY 11.2, 11.3):
//   S_i = m_i / M sum_j F_j + m_i omega_dot x r_i,   omega_dot = sum_k u_k (u_k.L) / I_k
Vectors rigid_part(const std::vector<PointMass>& points, const MassProperties& properties,
                   const Vectors& forces) {
  const Vectors& r = properties.r;
  const Eigen::Vector3d resultant = forces.rowwise().sum();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < r.cols(); ++i) moment += r.col(i).cross(forces.col(i));
  // the moment of forces on a collinear shape has no component about its line, and one point has no moment
  Eigen::Vector3d omega_dot = Eigen::Vector3d::Zero();
  for (int k = 6 - properties.rigid_freedoms; k < 3; ++k) {
    const Eigen::Vector3d axis = properties.principal_axes.col(k);
    omega_dot += axis * (axis.dot(moment) / properties.principal[k]);
  }
  Vectors S(3, r.cols());
  for (Eigen::Index i = 0; i < r.cols(); ++i)
    S.col(i) = points[index(i)].mass * (resultant / properties.mass + omega_dot.cross(r.col(i)));
  return S;
}

// Adds the groups f = F - S(F), the part of each unit load F that deforms the body (THEORY 11.1, 11.4). In
// the code, f overwrites F
void formal_groups(const std::vector<PointMass>& points, const MassProperties& properties,
                   const std::vector<int>& at, Groups& groups) {
  for (const int loaded : at) {
    for (int axis = 0; axis < 3; ++axis) {
      Vectors F = Vectors::Zero(3, properties.r.cols());
      F(axis, loaded) = 1.0;
      // A second pass removes the rounding errors of the first pass, which are large if the principal moments
      // differ by a large factor
      for (int pass = 0; pass < 2; ++pass) F -= rigid_part(points, properties, F);
      for (std::size_t i = 0; i < points.size(); ++i)
        groups.add(static_cast<int>(i), F.col(static_cast<Eigen::Index>(i)));
      groups.end();
    }
  }
}

}  // namespace

ShapeClass shape_class(const std::vector<PointMass>& points, const MassProperties& properties) {
  if (properties.rigid_freedoms == 3) return ShapeClass::kPoint;
  if (properties.rigid_freedoms == 5) return ShapeClass::kCollinear;
  double largest = std::sqrt(properties.r.colwise().squaredNorm().maxCoeff());
  for (const PointMass& point : points) largest = std::max(largest, point.position.cwiseAbs().maxCoeff());
  const double thickness = (plane_normal(properties).transpose() * properties.r).cwiseAbs().maxCoeff();
  const bool is_planar =
      points.size() == 3 || thickness <= kPlanarRoundings * std::numeric_limits<double>::epsilon() * largest;
  return is_planar ? ShapeClass::kPlanar : ShapeClass::kSpatial;
}

const char* name_of(Recipe recipe) {
  switch (recipe) {
    case Recipe::kCollinear:
      return "collinear";
    case Recipe::kPlanar:
      return "planar";
    case Recipe::kSpatial:
      return "spatial";
    case Recipe::kFormal:
      return "formal";
    case Recipe::kHouseholder:
      return "householder";
    case Recipe::kModes:
      break;
  }
  return "modes";
}

const char* name_of(ShapeClass shape) {
  switch (shape) {
    case ShapeClass::kPoint:
      return "one point";
    case ShapeClass::kCollinear:
      return "collinear";
    case ShapeClass::kPlanar:
      return "planar";
    case ShapeClass::kSpatial:
      break;
  }
  return "spatial";
}

Recipe recipe_of(ShapeClass shape) {
  switch (shape) {
    case ShapeClass::kCollinear:
      return Recipe::kCollinear;
    case ShapeClass::kPlanar:
      return Recipe::kPlanar;
    case ShapeClass::kSpatial:
      return Recipe::kSpatial;
    case ShapeClass::kPoint:
      break;
  }
  return Recipe::kFormal;
}

Eigen::MatrixXd force_groups(Recipe recipe, const std::vector<PointMass>& points,
                             const MassProperties& properties, const std::vector<int>& numbering) {
  assert(recipe != Recipe::kHouseholder && recipe != Recipe::kModes);
  const auto num_points = static_cast<Eigen::Index>(points.size());
  // room for the largest number of groups of a recipe
  Groups groups{Eigen::MatrixXd::Zero(3 * num_points, 3 * num_points)};
  if (recipe == Recipe::kCollinear) collinear_groups(properties, numbering, groups);
  if (recipe == Recipe::kPlanar) planar_groups(properties, numbering, groups);
  // pairs of points whose numbers differ by one, two or three: (N - 1) + (N - 2) + (N - 3) = 3N - 6 pairs
  // (THEORY 11.9)
  if (recipe == Recipe::kSpatial)
    for (std::size_t apart = 1; apart <= 3; ++apart)
      for (std::size_t i = 0; i + apart < numbering.size(); ++i)
        add_pair(properties.r, numbering[i], numbering[i + apart], groups);
  if (recipe == Recipe::kFormal) formal_groups(points, properties, numbering, groups);
  return groups.f.leftCols(groups.next);
}

}  // namespace freeflex
