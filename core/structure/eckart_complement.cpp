#include "core/structure/eckart_complement.hpp"

#include <algorithm>
#include <numeric>

#include "core/structure/mass_properties.hpp"

namespace freeflex {

EckartComplement::EckartComplement(const std::vector<PointMass>& points, const MassProperties& properties,
                                   const Eigen::MatrixXd& constraints, const Eigen::MatrixXd& mechanisms)
    : mass_(properties.mass), num_mechanisms_(mechanisms.cols()) {
  std::vector<int> by_mass(points.size());
  std::iota(by_mass.begin(), by_mass.end(), 0);
  std::stable_sort(by_mass.begin(), by_mass.end(), [&](int a, int b) {
    return points[static_cast<std::size_t>(a)].mass > points[static_cast<std::size_t>(b)].mass;
  });
  root_mass_.resize(3 * static_cast<Eigen::Index>(points.size()));
  for (const int point : by_mass)
    for (int axis = 0; axis < 3; ++axis) {
      root_mass_[static_cast<Eigen::Index>(order_.size())] =
          std::sqrt(points[static_cast<std::size_t>(point)].mass);
      order_.push_back(3 * point + axis);
    }
  add_stage(root_mass_.asDiagonal() * rigid_motions(properties)(order_, Eigen::all));
  // constraints forbid y along M^-1/2 C^T; blocks without a column have no memory that may be pointed into
  if (constraints.rows() > 0)
    add_stage(root_mass_.cwiseInverse().asDiagonal() * constraints(Eigen::all, order_).transpose());
  if (mechanisms.cols() > 0) add_stage(root_mass_.asDiagonal() * mechanisms(order_, Eigen::all));
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
  Eigen::MatrixXd turned = rows(Eigen::all, order_) * root_mass_.cwiseInverse().asDiagonal();
  for (const Stage& stage : stages_) {
    turned.applyOnTheRight(stage.qr.householderQ());
    turned = turned.rightCols(turned.cols() - stage.count).eval();
  }
  return turned;
}

Eigen::VectorXd EckartComplement::sizes(const Eigen::MatrixXd& rows) const {
  return (rows(Eigen::all, order_) * root_mass_.cwiseInverse().asDiagonal()).rowwise().norm();
}

Eigen::MatrixXd EckartComplement::to_displacements(Eigen::MatrixXd y) const {
  if (y.cols() == 0) return y;
  for (auto stage = stages_.rbegin(); stage != stages_.rend(); ++stage) {
    Eigen::MatrixXd lower = y.bottomRows(y.rows() - stage->first);
    lower.applyOnTheLeft(stage->qr.householderQ());
    y.bottomRows(y.rows() - stage->first) = lower;
  }
  Eigen::MatrixXd displacements(y.rows(), y.cols());
  displacements(order_, Eigen::all) = std::sqrt(mass_) * (root_mass_.cwiseInverse().asDiagonal() * y);
  return displacements;
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
