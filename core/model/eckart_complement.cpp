#include "core/model/eckart_complement.hpp"

#include <algorithm>
#include <numeric>

#include "core/model/mass_properties.hpp"

namespace freeflex {

EckartComplement::EckartComplement(const std::vector<PointMass>& points, const MassProperties& properties,
                                   const Eigen::MatrixXd& mechanisms)
    : mass_(properties.mass), num_rigid_(properties.rigid_freedoms), num_mechanisms_(mechanisms.cols()) {
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
  Eigen::MatrixXd rigid = root_mass_.asDiagonal() * rigid_motions(properties)(order_, Eigen::all);
  rigid.colwise().normalize();
  rigid_qr_.compute(rigid);
  if (num_mechanisms_ == 0) return;
  Eigen::MatrixXd moving = root_mass_.asDiagonal() * mechanisms(order_, Eigen::all);
  moving.colwise().normalize();
  moving.applyOnTheLeft(rigid_qr_.householderQ().adjoint());
  mechanism_qr_.compute(moving.bottomRows(root_mass_.size() - num_rigid_));
}

Eigen::MatrixXd EckartComplement::reduce(const Eigen::MatrixXd& rows) const {
  Eigen::MatrixXd turned = rows(Eigen::all, order_) * root_mass_.cwiseInverse().asDiagonal();
  turned.applyOnTheRight(rigid_qr_.householderQ());
  Eigen::MatrixXd left = turned.rightCols(turned.cols() - num_rigid_);
  if (num_mechanisms_ > 0) left.applyOnTheRight(mechanism_qr_.householderQ());
  return left.rightCols(dimension());
}

Eigen::MatrixXd EckartComplement::to_displacements(Eigen::MatrixXd y) const {
  if (num_mechanisms_ > 0) {
    Eigen::MatrixXd lower = y.bottomRows(y.rows() - num_rigid_);
    lower.applyOnTheLeft(mechanism_qr_.householderQ());
    y.bottomRows(y.rows() - num_rigid_) = lower;
  }
  y.applyOnTheLeft(rigid_qr_.householderQ());
  Eigen::MatrixXd displacements(y.rows(), y.cols());
  displacements(order_, Eigen::all) = std::sqrt(mass_) * (root_mass_.cwiseInverse().asDiagonal() * y);
  return displacements;
}

Eigen::MatrixXd EckartComplement::shapes(const Eigen::MatrixXd& coordinates) const {
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(root_mass_.size(), coordinates.cols());
  y.bottomRows(dimension()) = coordinates;
  return to_displacements(std::move(y));
}

Eigen::MatrixXd EckartComplement::mechanism_shapes() const {
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(root_mass_.size(), num_mechanisms_);
  for (Eigen::Index k = 0; k < num_mechanisms_; ++k) y(num_rigid_ + k, k) = 1.0;
  return to_displacements(std::move(y));
}

}  // namespace freeflex
