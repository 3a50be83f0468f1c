#include "tools/verification/reference/fitted_frame.hpp"

#include <Eigen/LU>
#include <utility>

#include "tools/verification/reference/elastic_error.hpp"
#include "tools/verification/reference/rotations.hpp"

namespace freeflex {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Points = Eigen::Ref<const Matrix3Xd>;

// [-] points are on a line if the distance of every point from the line is at most this fraction of the
// largest distance from the mean
constexpr double kLine = 1e-12;

}  // namespace

FittedFrame::FittedFrame(std::vector<int> points, Eigen::VectorXd weights, const Matrix3Xd& rest)
    : points_(std::move(points)), weights_(std::move(weights)) {
  r_ = gather(rest);
  const Vector3d centre = r_ * weights_ / weights_.sum();
  r_.colwise() -= centre;
  Eigen::Index farthest = 0;
  const double size = r_.colwise().norm().maxCoeff(&farthest);
  const Vector3d direction = r_.col(farthest) / size;
  const double width = (r_ - direction * (direction.transpose() * r_)).colwise().norm().maxCoeff();
  if (width <= kLine * size) line_ = direction;
}

Matrix3Xd FittedFrame::gather(const Points& all) const {
  Matrix3Xd some(3, static_cast<Eigen::Index>(points_.size()));
  for (std::size_t k = 0; k < points_.size(); ++k)
    some.col(static_cast<Eigen::Index>(k)) = all.col(points_[k]);
  return some;
}

FittedFrame::Fit FittedFrame::fit(const Points& p) const {
  Fit fit;
  fit.x = gather(p);
  const Vector3d centre = fit.x * weights_ / weights_.sum();
  fit.x.colwise() -= centre;
  fit.R = fit_rotation(weights_, r_, fit.x);
  fit.x = (fit.R.transpose() * fit.x).eval();
  fit.V = fit.x - r_;
  const Matrix3d S = fit.x * weights_.asDiagonal() * r_.transpose();
  const Matrix3d full = S.trace() * Matrix3d::Identity() - 0.5 * (S + S.transpose());
  // for points on a line, S = tr(S) line line^T at the best fit
  if (is_line())
    fit.inverse_inertia = (Matrix3d::Identity() - line_ * line_.transpose()) / S.trace();
  else
    fit.inverse_inertia = full.inverse();
  return fit;
}

Vector3d FittedFrame::spin(const Fit& fit, const Points& v) const {
  Vector3d moment = Vector3d::Zero();
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    moment += weights_[i] * Vector3d(r_.col(i)).cross(Vector3d(fit.R.transpose() * v.col(points_[k])));
  }
  return fit.inverse_inertia * moment;
}

Matrix3Xd FittedFrame::rates(const Fit& fit, const Points& v) const {
  Matrix3Xd rates = gather(v);
  const Vector3d mean = rates * weights_ / weights_.sum();
  rates.colwise() -= mean;
  return fit.R.transpose() * rates - cross_matrix(spin(fit, v)) * fit.x;
}

void FittedFrame::add_moment(const Fit& fit, const Vector3d& moment, Eigen::Ref<Matrix3Xd> force) const {
  const Vector3d rotation = fit.inverse_inertia * moment;
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    force.col(points_[k]) += fit.R * (weights_[i] * rotation.cross(Vector3d(r_.col(i))));
  }
}

void FittedFrame::add_forces(const Fit& fit, const Matrix3Xd& s, Eigen::Ref<Matrix3Xd> force) const {
  const Vector3d mean = s.rowwise().sum() / weights_.sum();
  Vector3d moment = Vector3d::Zero();
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const Vector3d balanced = s.col(i) - weights_[i] * mean;
    force.col(points_[k]) += fit.R * balanced;
    moment -= Vector3d(fit.x.col(i)).cross(Vector3d(s.col(i)));
  }
  add_moment(fit, moment, force);
}

}  // namespace freeflex
