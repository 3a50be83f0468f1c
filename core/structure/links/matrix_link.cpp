// This code makes the rows of a matrix link from its stiffness or flexibility matrix.
#include <cmath>
#include <limits>

#include "core/rounding.hpp"
#include "core/structure/links/link_factor.hpp"
#include "core/structure/modes/dense/decompositions.hpp"
#include "core/structure/modes/dense/rigid_residual.hpp"

namespace freeflex {
namespace {

// [-] largest allowed |K_link v| / (Lambda_max |v|) for a rigid motion v   (THEORY 3.11). Coordinates and
// matrices are often written with seven digits (single precision), which leaves residuals of about 1e-7. A
// link to ground exceeds the limit by far.
constexpr double kRigidTolerance = 1e-5;

// [-] largest allowed ratio of the magnitude of a negative eigenvalue to the largest eigenvalue
// (THEORY 3.11). Setting such an eigenvalue to zero changes the matrix by no more than kSymmetryTolerance and
// kRigidTolerance allow.
constexpr double kNegativeTolerance = 1e-6;

// returns the name of a row or column of the matrix, for example "point 'b' x"
std::string freedom_name(const Scene& scene, const Link& link, Eigen::Index row) {
  const int point = link.points[index(row / 3)];
  return join_text("point ", quoted(scene.points[index(point)].name, point), " ", "xyz"[row % 3]);
}

// Checks finiteness and symmetry   (THEORY 3.11). Returns false on an error
bool check_matrix(const Scene& scene, const Link& link, const std::string& who, const Eigen::MatrixXd& K,
                  Faults& faults) {
  const char* const what = std::get<MatrixLink>(link.kind).is_flexibility ? "flexibility" : "stiffness";
  const double largest = K.cwiseAbs().maxCoeff();
  if (!std::isfinite(largest) || largest <= 0.0) {
    add_error(faults, link.origin,
              join_text("link ", who, ": the ", what, " matrix ",
                        largest <= 0.0 ? "is zero" : "has an entry that is not finite",
                        "; it must have finite entries and at least one that is not zero"));
    return false;
  }
  Eigen::Index row = 0, column = 0;
  const double asymmetry = (K - K.transpose()).cwiseAbs().maxCoeff(&row, &column) / largest;
  if (asymmetry > kSymmetryTolerance) {
    add_error(
        faults, link.origin,
        join_text("link ", who, ": the ", what,
                  " matrix is not symmetric. Entries across the diagonal differ by up to ", asymmetry,
                  " of the largest entry, but may differ by at most ", kSymmetryTolerance,
                  ". The worst are the entries of ", freedom_name(scene, link, row), " by ",
                  freedom_name(scene, link, column), ", which are ", K(row, column), " and ", K(column, row),
                  "; give a symmetric matrix, or average it with its transpose if the difference is "
                  "measurement error"));
    return false;
  }
  return true;
}

// For self-equilibrated loads, T_perp^T Phi T_perp = W diag(1 / Lambda) W^T   (THEORY 3.38); the rows are e =
// W^T T_perp^T V with D = Lambda   (THEORY 3.39). In the code T_perp and Phi are H and F, and the eigenvalues
// are 1 / Lambda.
DeformationRows flexibility_rows(const Scene& scene, const Link& link, const std::string& who,
                                 const Eigen::MatrixXd& F, Faults& faults) {
  const Eigen::MatrixXd rigid = rigid_basis(scene, link.points);
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(rigid);
  const Eigen::MatrixXd all = qr.householderQ() * Eigen::MatrixXd::Identity(F.rows(), F.rows());
  const Eigen::MatrixXd H = all.rightCols(F.rows() - rigid.cols());
  const Eigen::MatrixXd F_H = H.transpose() * F * H;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(0.5 * (F_H + F_H.transpose()));
  const Eigen::VectorXd& value = eigen.eigenvalues();
  const Eigen::MatrixXd loads = H * eigen.eigenvectors();
  if (value[0] <= 8.0 * static_cast<double>(F.rows()) * kEpsilon * F.cwiseAbs().maxCoeff()) {
    Eigen::Index worst = 0;
    loads.col(0).cwiseAbs().maxCoeff(&worst);
    add_error(
        faults, link.origin,
        join_text("link ", who,
                  ": the flexibility matrix is not positive definite. For the balanced load that is "
                  "largest at ",
                  freedom_name(scene, link, worst), " the flexibility is ", value[0], " m/N (the largest is ",
                  value[value.size() - 1],
                  " m/N), but every balanced load must strain the link; if none does, use a rigid link"));
    return {};
  }
  DeformationRows rows;
  for (Eigen::Index mode = value.size() - 1; mode >= 0; --mode) {
    DeformationRow row;
    for (std::size_t k = 0; k < link.points.size(); ++k)
      add_vector(row, 3 * link.points[k], 1.0, loads.block<3, 1>(3 * static_cast<Eigen::Index>(k), mode));
    row.root_stiffness = 1.0 / std::sqrt(value[mode]);
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace

Eigen::MatrixXd rigid_basis(const Scene& scene, const std::vector<int>& points) {
  const auto num_points = static_cast<Eigen::Index>(points.size());
  Eigen::Matrix3Xd position(3, num_points);
  for (Eigen::Index k = 0; k < num_points; ++k)
    position.col(k) = scene.points[static_cast<std::size_t>(points[index(k)])].position;
  const double farthest = position.cwiseAbs().maxCoeff();
  position.colwise() -= Eigen::Vector3d(position.col(0));
  position.colwise() -= Eigen::Vector3d(position.rowwise().mean());
  const double length = std::max(position.cwiseAbs().maxCoeff(), std::numeric_limits<double>::min());
  Eigen::MatrixXd motions = Eigen::MatrixXd::Zero(3 * num_points, 6);
  for (Eigen::Index k = 0; k < num_points; ++k) {
    motions.block<3, 3>(3 * k, 0).setIdentity();
    const Eigen::Vector3d d = position.col(k) / length;
    motions.block<3, 3>(3 * k, 3) << 0.0, d.z(), -d.y(), -d.z(), 0.0, d.x(), d.y(), -d.x(), 0.0;
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(motions);
  // a rotation with displacements below 64 rounding errors of the coordinates is omitted (THEORY 2.9); no
  // translation is omitted, because the pivots of translations are at least 0.7 times the largest pivot and
  // the threshold is at most 0.5
  qr.setThreshold(std::min(0.5, kCollinearRoundings * kEpsilon * std::max(1.0, farthest / length)));
  Eigen::MatrixXd basis = Eigen::MatrixXd::Identity(3 * num_points, qr.rank());
  basis.applyOnTheLeft(qr.householderQ());
  return basis;
}

DeformationRows matrix_rows(const Scene& scene, const Link& link, int link_index, MatrixLimits& limits,
                            Faults& faults) {
  const auto& matrix = std::get<MatrixLink>(link.kind);
  const std::string who = called(link, link_index);
  Eigen::MatrixXd K = matrix.matrix;
  if (!check_matrix(scene, link, who, K, faults)) return {};
  K = (0.5 * (K + K.transpose())).eval();
  if (matrix.is_flexibility) return flexibility_rows(scene, link, who, K, faults);

  const Eigen::MatrixXd rigid = rigid_basis(scene, link.points);
  const Eigen::MatrixXd K_rigid = K * rigid;
  // K_link <- (1 - T T^T) K_link (1 - T T^T) = W diag(Lambda) W^T   (THEORY 3.12); in the code K_link and T
  // are K and rigid
  K.noalias() -= K_rigid * rigid.transpose();
  K -= (rigid * (rigid.transpose() * K)).eval();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(0.5 * (K + K.transpose()));
  const Eigen::VectorXd& value = eigen.eigenvalues();
  const double largest = std::max(value.cwiseAbs().maxCoeff(), K_rigid.colwise().norm().maxCoeff());
  const double residual = K_rigid.colwise().norm().maxCoeff() / largest;
  if (residual > kRigidTolerance) {
    add_error(faults, link.origin,
              join_text("link ", who,
                        ": the stiffness matrix resists rigid motion of its points. |K u| / (|K| |u|) is ",
                        residual, " for one motion u, but may be at most ", kRigidTolerance,
                        ", because a free structure has no link to ground; check supports, units and the "
                        "order of points"));
    return {};
  }
  if (value[0] < -kNegativeTolerance * largest) {
    add_error(faults, link.origin,
              join_text("link ", who,
                        ": the stiffness matrix is not positive semidefinite. Its least eigenvalue is ",
                        value[0], " N/m and its largest ", largest, " N/m, but the least must be at least -",
                        kNegativeTolerance,
                        " times the largest, because such a link would release an unlimited amount of "
                        "energy; check the signs of its entries"));
    return {};
  }
  // The rows are e = W^T V with D = Lambda (THEORY 3.13); eigenvalues below a few rounding errors of the
  // largest belong to the null space. The residual is K_o = T G^T + G T^T (THEORY 3.15), G = K T - T (T^T K
  // T) / 2 (THEORY 3.16). The accuracy of the lowest eigenvalue is eps Lambda_max / Lambda_min (THEORY 3.14).
  const double null_below = 8.0 * static_cast<double>(K.rows()) * kEpsilon * largest;
  if (residual * largest > null_below)
    limits.rigid_residuals.push_back({link_index, rigid,
                                      K_rigid - 0.5 * rigid * (rigid.transpose() * K_rigid),
                                      is_within_digits(matrix.matrix, rigid, K_rigid, null_below)});
  DeformationRows rows;
  for (Eigen::Index mode = 0; mode < value.size(); ++mode) {
    if (value[mode] <= null_below) continue;
    if (rows.empty()) limits.accuracy = std::max(limits.accuracy, kEpsilon * largest / value[mode]);
    DeformationRow row;
    for (std::size_t k = 0; k < link.points.size(); ++k)
      add_vector(row, 3 * link.points[k], 1.0,
                 eigen.eigenvectors().block<3, 1>(3 * static_cast<Eigen::Index>(k), mode));
    row.root_stiffness = std::sqrt(value[mode]);
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace freeflex
