#include "core/structure/modes/dense/eckart_complement.hpp"

#include <cmath>
#include <utility>

namespace freeflex {

// O_H^T (L^T T, L^-1 C^T, L^T V_m) = (Z_H; 0), O_H = (O_1, H)   (THEORY 4.7). H is therefore orthogonal to
// the rigid motions L^T T, so all displacements that H spans meet sum m b = 0 and sum m r x b = 0
// (THEORY 2.15)
EckartComplement::EckartComplement(RootMass root_mass, double mass, const Eigen::MatrixXd& rigid,
                                   const Eigen::MatrixXd& constraints, const Eigen::MatrixXd& mechanisms)
    : root_mass_(std::move(root_mass)), mass_(mass), num_mechanisms_(mechanisms.cols()) {
  add_stage(root_mass_.weigh(rigid));
  // Constraints forbid y along L^-1 C^T. Empty blocks are skipped, because Eigen would form an invalid
  // pointer
  if (constraints.rows() > 0) add_stage(root_mass_.weigh_rows(constraints).transpose());
  if (mechanisms.cols() > 0) add_stage(root_mass_.weigh(mechanisms));
}

void EckartComplement::add_stage(Eigen::MatrixXd columns) {
  if (columns.cols() == 0) return;
  columns.colwise().normalize();
  for (const Stage& stage : stages_) {
    Eigen::MatrixXd lower = columns.bottomRows(columns.rows() - stage.first);
    lower.applyOnTheLeft(stage.qr.householderQ().adjoint());
    columns.bottomRows(columns.rows() - stage.first) = lower;
  }
  Stage stage;
  stage.first = num_before_;
  stage.count = columns.cols();
  stage.qr.compute(columns.bottomRows(columns.rows() - num_before_));
  num_before_ += stage.count;
  stages_.push_back(std::move(stage));
}

Eigen::MatrixXd EckartComplement::reduce(const Eigen::MatrixXd& rows) const {
  Eigen::MatrixXd rotated = root_mass_.weigh_rows(rows);
  for (const Stage& stage : stages_) {
    rotated.applyOnTheRight(stage.qr.householderQ());
    rotated = rotated.rightCols(rotated.cols() - stage.count).eval();
  }
  return rotated;
}

Eigen::VectorXd EckartComplement::sizes(const Eigen::MatrixXd& rows) const {
  return root_mass_.weigh_rows(rows).rowwise().norm();
}

Eigen::MatrixXd EckartComplement::to_displacements(Eigen::MatrixXd y) const {
  if (y.cols() == 0) return y;
  for (auto stage = stages_.rbegin(); stage != stages_.rend(); ++stage) {
    Eigen::MatrixXd lower = y.bottomRows(y.rows() - stage->first);
    lower.applyOnTheLeft(stage->qr.householderQ());
    y.bottomRows(y.rows() - stage->first) = lower;
  }
  return std::sqrt(mass_) * root_mass_.motions(y);
}

// b = sqrt(M) L^-T H Y, b^T m b = M   (THEORY 4.3, 4.9)
Eigen::MatrixXd EckartComplement::shapes(const Eigen::MatrixXd& coordinates) const {
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(root_mass_.size(), coordinates.cols());
  // a block of a matrix without columns would begin at an offset from a null pointer
  if (coordinates.cols() > 0) y.bottomRows(dimension()) = coordinates;
  return to_displacements(std::move(y));
}

Eigen::MatrixXd EckartComplement::mechanism_shapes() const {
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(root_mass_.size(), num_mechanisms_);
  for (Eigen::Index k = 0; k < num_mechanisms_; ++k) y(num_before_ - num_mechanisms_ + k, k) = 1.0;
  return to_displacements(std::move(y));
}

}  // namespace freeflex
