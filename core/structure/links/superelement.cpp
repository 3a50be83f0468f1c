#include "core/structure/links/superelement.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/rounding.hpp"
#include "core/scene/bodies.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

// [-] the limits are the same as for matrices over displacements alone: the uncertainty of printed tables
// with seven digits (THEORY 3.11)
constexpr double kRigidTolerance = 1e-5;
constexpr double kNegativeTolerance = 1e-6;

const MatrixLink& matrix_of(const Scene& scene, int link) {
  return std::get<MatrixLink>(scene.links[static_cast<std::size_t>(link)].kind);
}

// The coordinates of a superelement. Each coordinate is a freedom times a scale that makes it a length. The
// scale is the size of the link for rotations, and for inner coordinates it is the square root of their mass
// over the mean mass per point (THEORY 16.17).
struct Coordinates {
  std::vector<int> freedom;
  Eigen::VectorXd scale;  // [-] displacements; [m] rotations; inner coordinates: depends on their unit
  Eigen::MatrixXd rigid;  // T, orthonormal columns

  Coordinates(const Scene& scene, int index, const Freedoms& freedoms) {
    const Link& link = scene.links[static_cast<std::size_t>(index)];
    const MatrixLink& matrix = matrix_of(scene, index);
    const auto num_points = static_cast<Eigen::Index>(link.points.size());
    const int per_point = matrix.has_rotations ? 6 : 3;
    const Eigen::Index size = per_point * num_points + matrix.num_inner;
    Eigen::Matrix3Xd d(3, num_points);
    for (Eigen::Index k = 0; k < num_points; ++k)
      d.col(k) = scene.points[static_cast<std::size_t>(link.points[static_cast<std::size_t>(k)])].position;
    const double farthest = d.cwiseAbs().maxCoeff();
    d.colwise() -= Eigen::Vector3d(d.rowwise().mean());
    const double extent = d.cwiseAbs().maxCoeff();
    const double length = extent > 64.0 * kEpsilon * farthest ? extent : 1.0;
    scale = Eigen::VectorXd::Ones(size);
    Eigen::MatrixXd motions = Eigen::MatrixXd::Zero(size, 6);
    for (Eigen::Index k = 0; k < num_points; ++k) {
      const int point = link.points[static_cast<std::size_t>(k)];
      for (int axis = 0; axis < per_point; ++axis)
        freedom.push_back(axis < 3 ? 3 * point + axis : freedoms.rotation(point) + axis - 3);
      motions.block<3, 3>(per_point * k, 0).setIdentity();
      for (int axis = 0; axis < 3; ++axis)
        motions.block<3, 1>(per_point * k, 3 + axis) =
            Eigen::Vector3d::Unit(axis).cross(Eigen::Vector3d(d.col(k))) / length;
      if (!matrix.has_rotations) continue;
      scale.segment<3>(per_point * k + 3).setConstant(length);
      motions.block<3, 3>(per_point * k + 3, 3).setIdentity();
    }
    for (int k = 0; k < matrix.num_inner; ++k) {
      const Eigen::Index row = per_point * num_points + k;
      freedom.push_back(freedoms.inner(index) + k);
      const double mass =
          matrix.mass.coeff(row, row) * static_cast<double>(num_points) / mass_of(scene, link);
      if (mass > 0.0) scale[row] = std::sqrt(mass);
    }
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(motions);
    qr.setThreshold(std::min(0.5, kCollinearRoundings * kEpsilon * std::max(1.0, farthest / length)));
    rigid = Eigen::MatrixXd::Identity(size, qr.rank());
    rigid.applyOnTheLeft(qr.householderQ());
  }

  Eigen::MatrixXd scaled(const Eigen::SparseMatrix<double>& matrix) const {
    Eigen::MatrixXd all = matrix;
    all = (0.5 * (all + all.transpose())).eval();
    return scale.cwiseInverse().asDiagonal() * all * scale.cwiseInverse().asDiagonal();
  }

  DeformationRow row(const Eigen::VectorXd& vector, double value) const {
    DeformationRow row;
    for (Eigen::Index k = 0; k < vector.size(); ++k)
      row.coefficients.emplace_back(freedom[static_cast<std::size_t>(k)], vector[k] * scale[k]);
    row.root_stiffness = std::sqrt(value);
    return row;
  }
};

}  // namespace

DeformationRows superelement_rows(const Scene& scene, int index, const Freedoms& freedoms,
                                  MatrixLimits& limits, Faults& faults) {
  const Link& link = scene.links[static_cast<std::size_t>(index)];
  const std::string who = "link " + called(link, index);
  const Coordinates z(scene, index, freedoms);
  Eigen::MatrixXd K = z.scaled(matrix_of(scene, index).matrix);
  const Eigen::MatrixXd K_rigid = K * z.rigid;
  // K <- (1 - T T^T) K (1 - T T^T) = W diag(Lambda) W^T   (THEORY 3.12)
  K.noalias() -= K_rigid * z.rigid.transpose();
  K -= (z.rigid * (z.rigid.transpose() * K)).eval();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(0.5 * (K + K.transpose()));
  const Eigen::VectorXd& value = eigen.eigenvalues();
  const double resisted = K_rigid.colwise().norm().maxCoeff();
  const double largest = std::max(value.cwiseAbs().maxCoeff(), resisted);
  if (!(largest > 0.0)) {
    add_error(faults, link.origin, who + ": the stiffness matrix is zero; it must have a nonzero entry");
    return {};
  }
  if (resisted > kRigidTolerance * largest) {
    add_error(
        faults, link.origin,
        join_text(
            who, ": the stiffness matrix resists rigid motion of its points. |K u| / (|K| |u|) is ",
            resisted / largest, " for one motion u, but may be at most ", kRigidTolerance,
            ". Check supports, units, the order of rows (three displacements and three rotations of each "
            "point, inner coordinates last) and that rotations and displacements are along the "
            "axes of the scene; inner coordinates must be at rest in rigid motion, like those of "
            "Craig and Bampton"));
    return {};
  }
  if (value[0] < -kNegativeTolerance * largest) {
    add_error(faults, link.origin,
              join_text(who, ": the stiffness matrix is not positive semidefinite. Its least eigenvalue is ",
                        value[0], " and its largest ", largest, ", but the least must be at least -",
                        kNegativeTolerance, " times the largest; check the signs of its entries"));
    return {};
  }
  const double null_below = 8.0 * static_cast<double>(K.rows()) * kEpsilon * largest;
  DeformationRows rows;
  for (Eigen::Index mode = 0; mode < value.size(); ++mode) {
    if (value[mode] <= null_below) continue;
    // the removed resistance may have changed this eigenvalue too
    if (rows.empty())
      limits.accuracy =
          std::max(limits.accuracy,
                   std::min(1.0, std::max(kEpsilon * largest, resisted * resisted / largest) / value[mode]));
    rows.push_back(z.row(eigen.eigenvectors().col(mode), value[mode]));
  }
  return rows;
}

// m_s = W_s diag(mu_s) W_s^T, A_m = diag(sqrt(mu_s)) W_s^T   (THEORY 16.17)
DeformationRows superelement_mass_rows(const Scene& scene, int index, const Freedoms& freedoms) {
  assert(!has_mass_matrix(scene.links[freeflex::index(index)]) ||
         mass_matrix_problem(scene, scene.links[freeflex::index(index)]).empty());
  const MatrixLink& matrix = matrix_of(scene, index);
  if (matrix.mass.size() == 0) return {};
  const Coordinates z(scene, index, freedoms);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(z.scaled(matrix.mass));
  const Eigen::VectorXd& value = eigen.eigenvalues();
  const double null_below = 8.0 * static_cast<double>(value.size()) * kEpsilon * value.cwiseAbs().maxCoeff();
  DeformationRows rows;
  for (Eigen::Index mode = value.size() - 1; mode >= 0 && value[mode] > null_below; --mode)
    rows.push_back(z.row(eigen.eigenvectors().col(mode), value[mode]));
  return rows;
}

Eigen::MatrixXd superelement_motions(const Scene& scene, int index, const Freedoms& freedoms,
                                     const Structure& structure) {
  const Coordinates z(scene, index, freedoms);
  const Eigen::Index num_displacements = structure.shapes.rows();
  Eigen::MatrixXd y(z.scale.size(), structure.shapes.cols());
  for (Eigen::Index k = 0; k < y.rows(); ++k) {
    const int freedom = z.freedom[static_cast<std::size_t>(k)];
    y.row(k) = freedom < num_displacements ? structure.shapes.row(freedom)
                                           : structure.rotations.row(freedom - num_displacements);
  }
  return y;
}

}  // namespace freeflex
