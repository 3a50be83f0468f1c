// The rotation that fits some points best, and what follows from it: displacements in its axes, its spin, and
// forces of what is known in its axes   (THEORY X36, X151).
#pragma once

#include <Eigen/Core>
#include <vector>

namespace freeflex {

class FittedFrame {
 public:
  FittedFrame() = default;
  /// \param points  of the whole system  \param weights [-] or [kg] (n) of these  \param rest [m] (3 x all)
  FittedFrame(std::vector<int> points, Eigen::VectorXd weights, const Eigen::Matrix3Xd& rest);

  struct Fit {
    Eigen::Matrix3d A;     // rest axes to present ones
    Eigen::Matrix3Xd x;    // [m] (3 x n) present places from their mean, in the fitted axes
    Eigen::Matrix3Xd V;    // [m] (3 x n) displacements in the fitted axes, x - r
    Eigen::Matrix3d turn;  // (tr S 1 - S)^-1, S = sum w x r^T; without the line of points on a line
  };
  /// \param p [m] (3 x all) present places of the whole system
  Fit fit(const Eigen::Ref<const Eigen::Matrix3Xd>& p) const;

  /// Angular velocity of the fitted axes, in them [rad/s]: turn sum w r x A^T v.  \param v [m/s] (3 x all)
  Eigen::Vector3d spin(const Fit& fit, const Eigen::Ref<const Eigen::Matrix3Xd>& v) const;
  /// Rates V' [m/s] (3 x n) of the displacements in the fitted axes.
  Eigen::Matrix3Xd rates(const Fit& fit, const Eigen::Ref<const Eigen::Matrix3Xd>& v) const;

  /// Adds the forces on the points whose power is that of a moment on the fitted axes.
  /// \param moment [N m] in the fitted axes  \param force [N] (3 x all)
  void add_moment(const Fit& fit, const Eigen::Vector3d& moment, Eigen::Ref<Eigen::Matrix3Xd> force) const;
  /// Adds the forces on the points whose power is sum s . V'. No resultant, no moment.
  /// \param s [N] (3 x n) in the fitted axes
  void add_forces(const Fit& fit, const Eigen::Matrix3Xd& s, Eigen::Ref<Eigen::Matrix3Xd> force) const;

  const std::vector<int>& points() const { return points_; }
  const Eigen::Matrix3Xd& rest() const { return r_; }
  bool is_line() const { return !line_.isZero(0.0); }
  const Eigen::Vector3d& line() const { return line_; }

 private:
  Eigen::Matrix3Xd gather(const Eigen::Ref<const Eigen::Matrix3Xd>& all) const;

  std::vector<int> points_;
  Eigen::VectorXd weights_;
  Eigen::Matrix3Xd r_;                              // [m] (3 x n) rest places from their mean
  Eigen::Vector3d line_ = Eigen::Vector3d::Zero();  // [-] of points on a line, else zero
};

}  // namespace freeflex
