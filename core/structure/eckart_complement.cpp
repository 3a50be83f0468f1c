#include "core/structure/eckart_complement.hpp"

#include <cmath>
#include <utility>

namespace freeflex {

EckartComplement::EckartComplement(RootMass root_mass, double mass, const Eigen::MatrixXd& rigid,
                                   const Eigen::MatrixXd& constraints, const Eigen::MatrixXd& mechanisms)
    : root_mass_(std::move(root_mass)), mass_(mass), num_mechanisms_(mechanisms.cols()) {
  add_stage(root_mass_.weigh(rigid));
  // constraints forbid y along L^-1 C^T; blocks without a column have no memory that may be pointed into
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
  Eigen::MatrixXd turned = root_mass_.weigh_rows(rows);
  for (const Stage& stage : stages_) {
    turned.applyOnTheRight(stage.qr.householderQ());
    turned = turned.rightCols(turned.cols() - stage.count).eval();
  }
  return turned;
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

Eigen::MatrixXd EckartComplement::shapes(const Eigen::MatrixXd& coordinates) const {
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(root_mass_.size(), coordinates.cols());
  // Eigen's part of a matrix without columns begins at an offset from null
  if (coordinates.cols() > 0) y.bottomRows(dimension()) = coordinates;
  return to_displacements(std::move(y));
}

Eigen::MatrixXd EckartComplement::mechanism_shapes() const {
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(root_mass_.size(), num_mechanisms_);
  for (Eigen::Index k = 0; k < num_mechanisms_; ++k) y(num_before_ - num_mechanisms_ + k, k) = 1.0;
  return to_displacements(std::move(y));
}

}  // namespace freeflex
