#include "tools/control/held_modes.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/index.hpp"
#include "service/io/scene/text.hpp"
#include "tools/control/rows.hpp"

namespace freeflex::control {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

/// Returns the points with this name, or those of the group with this name.
std::vector<int> points_of(const Plan& plan, const std::string& name) {
  for (std::size_t k = 0; k < plan.points.size(); ++k)
    if (plan.points[k].name == name) return {static_cast<int>(k)};
  for (const PlanGroup& group : plan.groups)
    if (group.name == name) return {group.points.begin(), group.points.end()};
  return {};
}

/// Returns the axes about which the body can turn, as columns: three, two if all its mass is on a line, none
/// if it is at a point   (THEORY 2.10).
MatrixXd rotation_axes(const Plan& plan) {
  // Points are on a line if the moment of inertia about it is at most this part of the largest moment. It is
  // then a rounding error.
  constexpr double kRounding = 1e-12;
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(matrix_of(plan.inertia));
  const Vector3d& moments = solver.eigenvalues();
  const auto num_zero = static_cast<Index>((moments.array() <= kRounding * moments[2]).count());
  return solver.eigenvectors().rightCols(3 - num_zero);
}

/// Returns the displacements of the held points, and the rotations of held bodies, as rows of the
/// coordinates: position of the body, its rotation about the axes, then the modes.
MatrixXd constraint_rows(const Plan& plan, const std::vector<int>& points, const MatrixXd& axes) {
  const Index n = plan.num_elastic;
  MatrixXd rows(0, 3 + axes.cols() + n);
  const auto add = [&](const Matrix3d& moved, const Matrix3d& turned, const MatrixXd& shapes) {
    rows.conservativeResize(rows.rows() + 3, Eigen::NoChange);
    rows.bottomRows<3>() << moved, turned * axes, shapes.leftCols(n);
  };
  for (const int point : points) {
    const PlanPoint& of = plan.points[index(point)];
    add(Matrix3d::Identity(), -cross_matrix(vector_of(of.r)), shapes_of_point(plan, of.row));
    if (const int attitude = attitude_index_of(plan, point); attitude >= 0)
      add(Matrix3d::Zero(), Matrix3d::Identity(), rotations_of_body(plan, attitude));
  }
  return rows;
}

/// Returns an orthonormal basis of the vectors x with rows x = 0.
MatrixXd null_space(const MatrixXd& rows) {
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(rows.transpose());
  const MatrixXd q = qr.householderQ();
  return q.rightCols(rows.cols() - qr.rank());
}

}  // namespace

HeldModes hold(const Plan& plan, const std::string& name) {
  HeldModes held;
  const std::vector<int> points = points_of(plan, name);
  if (points.empty()) {
    std::vector<std::string_view> names;
    for (const PlanPoint& point : plan.points) names.push_back(point.name);
    for (const PlanGroup& group : plan.groups) names.push_back(group.name);
    held.error =
        "there is no point or group " + io::reader::quote(name) + io::reader::did_you_mean(name, names);
    return held;
  }
  const MatrixXd axes = rotation_axes(plan);
  const Index n = plan.num_elastic, r = axes.cols();
  MatrixXd M = MatrixXd::Identity(3 + r + n, 3 + r + n) * plan.mass, K = MatrixXd::Zero(3 + r + n, 3 + r + n);
  M.block(3, 3, r, r) = axes.transpose() * matrix_of(plan.inertia) * axes;
  for (Index l = 0; l < n; ++l)
    K(3 + r + l, 3 + r + l) = plan.mass * plan.omega[index(l)] * plan.omega[index(l)];
  // rotations are scaled to lengths, so that the basis is well scaled
  const double size = r > 0 ? std::sqrt(matrix_of(plan.inertia).trace() / plan.mass) : 1.0;
  MatrixXd rows = constraint_rows(plan, points, axes);
  rows.middleCols(3, r) /= size;
  held.holds_rotation = Eigen::ColPivHouseholderQR<MatrixXd>(rows.leftCols(3 + r)).rank() == 3 + r;
  MatrixXd Z = null_space(rows);
  Z.middleRows(3, r) /= size;
  if (Z.cols() == 0) {
    held.error = io::reader::quote(name) + " is all that can move, so nothing is left to vibrate";
    return held;
  }
  Vector3d about = Vector3d::Zero();
  for (const int point : points)
    about += vector_of(plan.points[index(point)].r) / static_cast<double>(points.size());
  held.about = about + vector_of(plan.p_SB);
  // rigid motions of the whole structure: along x y z, and about axes through the held point, so that the
  // centre of mass moves by theta x (0 - about)
  MatrixXd rigid = MatrixXd::Zero(3 + r + n, 6);
  rigid.block<3, 3>(0, 0).setIdentity();
  rigid.block<3, 3>(0, 3) = cross_matrix(about);
  rigid.block(3, 3, r, 3) = axes.transpose();
  const MatrixXd reduced_mass = Z.transpose() * M * Z;
  const Eigen::LLT<MatrixXd> factor(reduced_mass);
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(Z.transpose() * K * Z, reduced_mass);
  if (factor.info() != Eigen::Success || solver.info() != Eigen::Success) {
    held.error = "the modes of the held structure could not be computed";
    return held;
  }
  const MatrixXd load = Z.transpose() * M * rigid;
  // the mass of the rigid motion that the free coordinates can follow
  held.moving = (load.transpose() * factor.solve(load)).diagonal();
  for (Index k = 0; k < solver.eigenvalues().size(); ++k) {
    HeldMode mode;
    mode.frequency = std::sqrt(std::max(0.0, solver.eigenvalues()[k])) / (2.0 * std::numbers::pi);
    const Eigen::Matrix<double, 6, 1> factors = load.transpose() * solver.eigenvectors().col(k);
    mode.participation = factors / std::sqrt(plan.mass);
    mode.effective_mass = factors.cwiseAbs2();
    held.modes.push_back(mode);
  }
  return held;
}

}  // namespace freeflex::control
