// Rigid links and bodies as constraints on accelerations   (THEORY 10.23).
#include <Eigen/QR>

#include "tools/verification/reference/rotations.hpp"
#include "tools/verification/reference/true_geometry.hpp"

namespace freeflex {
namespace {

using Eigen::Map;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Solver = Eigen::CompleteOrthogonalDecomposition<MatrixXd>;

// [-] a constraint is redundant if it equals a combination of other constraints to within this fraction
constexpr double kRedundant = 1e-9;

VectorXd stacked(const Matrix3Xd& columns) { return Map<const VectorXd>(columns.data(), columns.size()); }

// Returns the constraint rows G m^-1/2 [1/sqrt(kg)] of one rigid body, (constraints x 3N), where
// G = T_o^T R^T and T_o is body.forbidden   (THEORY 10.23)
MatrixXd body_rows(const TrueBody& body, const FittedFrame::Fit& fit, const VectorXd& mass) {
  MatrixXd rows = MatrixXd::Zero(body.forbidden.cols(), 3 * mass.size());
  const auto& points = body.frame.points();
  for (std::size_t k = 0; k < points.size(); ++k)
    rows.middleCols<3>(3 * Eigen::Index{points[k]}) =
        body.forbidden.middleRows<3>(3 * static_cast<Eigen::Index>(k)).transpose() * fit.R.transpose() /
        std::sqrt(mass[points[k]]);
  return rows;
}

Solver decompose(const MatrixXd& rows) {
  Solver solver;
  solver.setThreshold(kRedundant);
  solver.compute(rows);
  return solver;
}

}  // namespace

MatrixXd TrueGeometry::forbidden(const PointVectors& e) const {
  Eigen::Index count = 0;
  for (const TrueBody& body : bodies_) count += body.forbidden.cols();
  MatrixXd rows(count, 3 * mass_.size());
  Eigen::Index row = 0;
  for (const TrueBody& body : bodies_) {
    rows.middleRows(row, body.forbidden.cols()) = body_rows(body, body.frame.fit(r_ + e), mass_);
    row += body.forbidden.cols();
  }
  return rows;
}

// G e'' = T_o^T (w_F x (w_F x r) - 2 kappa V' - kappa^2 V)   (THEORY 10.23), solved by the change of e'' with
// the least sum of m |change|^2
void TrueGeometry::constrain(const PointVectors& e, const PointVectors& e_dot, Forces acceleration) const {
  if (bodies_.empty()) return;
  const MatrixXd rows = forbidden(e);
  VectorXd wanted(rows.rows());
  Eigen::Index row = 0;
  for (const TrueBody& body : bodies_) {
    const FittedFrame::Fit fit = body.frame.fit(r_ + e);
    const Vector3d spin = body.frame.spin(fit, e_dot);
    // points of a rigid body have the centripetal acceleration w_F x (w_F x r) in addition to the
    // acceleration of a rigid displacement
    Matrix3Xd target = cross_matrix(spin) * cross_matrix(spin) * body.frame.rest();
    target -= 2.0 * correction_ * body.frame.rates(fit, e_dot) + correction_ * correction_ * fit.V;
    wanted.segment(row, body.forbidden.cols()) = body.forbidden.transpose() * stacked(target);
    row += body.forbidden.cols();
  }
  const Matrix3Xd root = mass_.cwiseSqrt().transpose().replicate<3, 1>();
  const VectorXd now = stacked(acceleration.cwiseProduct(root));
  const VectorXd change = decompose(rows).solve(wanted - rows * now);
  acceleration += Map<const Matrix3Xd>(change.data(), 3, mass_.size()).cwiseQuotient(root);
}

void TrueGeometry::project(Forces e, Forces e_dot) const {
  if (bodies_.empty()) return;
  constexpr int kSteps = 8;
  const Matrix3Xd root = mass_.cwiseSqrt().transpose().replicate<3, 1>();
  for (int k = 0; k <= kSteps; ++k) {
    const bool is_last = k == kSteps;
    const MatrixXd rows = forbidden(e);
    VectorXd off(rows.rows());
    Eigen::Index row = 0;
    for (const TrueBody& body : bodies_) {
      const FittedFrame::Fit fit = body.frame.fit(r_ + e);
      off.segment(row, body.forbidden.cols()) =
          body.forbidden.transpose() * stacked(is_last ? body.frame.rates(fit, e_dot) : fit.V);
      row += body.forbidden.cols();
    }
    const VectorXd change = decompose(rows).solve(off);
    (is_last ? e_dot : e) -= Map<const Matrix3Xd>(change.data(), 3, mass_.size()).cwiseQuotient(root);
  }
}

}  // namespace freeflex
