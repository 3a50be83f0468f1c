// Fits a rotation to the positions of some points. Computes the displacements in the fitted axes, the angular
// velocity of these axes, and the point forces that do the same work as a moment on these axes or forces in
// these axes. THEORY 10.8, 10.13 to 10.15
#pragma once

#include <Eigen/Core>
#include <vector>

namespace freeflex {

/// A set of points with weights w and rest positions r relative to their weighted mean.
class FittedFrame {
 public:
  FittedFrame() = default;
  /// \param points  (n) indices of the points in the set, among the N points of the system
  /// \param weights  [-] or [kg] (n) weights of the points in the set
  /// \param rest  [m] (3 x N) rest positions of all points of the system
  FittedFrame(std::vector<int> points, Eigen::VectorXd weights, const Eigen::Matrix3Xd& rest);

  struct Fit {
    Eigen::Matrix3d R;   // rotation from the rest axes to the fitted axes
    Eigen::Matrix3Xd x;  // [m] (3 x n) present positions from their weighted mean, in the fitted axes
    Eigen::Matrix3Xd V;  // [m] (3 x n) displacements in the fitted axes, x - r
    // (tr(S) 1 - S)^-1, S = sum w x r^T; for points on a line, the inverse normal to the line, and zero along
    // the line
    Eigen::Matrix3d inverse_inertia;
  };
  /// Fits the rotation to present positions.
  /// \param p  [m] (3 x N) present positions of all points of the system
  Fit fit(const Eigen::Ref<const Eigen::Matrix3Xd>& p) const;

  /// Returns the angular velocity w_F [rad/s] of the fitted axes, in these axes   (THEORY 10.13):
  ///   w_F = (tr(S) 1 - S)^-1 sum w r x R^T v
  /// \param v  [m/s] (3 x N) velocities of all points of the system
  Eigen::Vector3d spin(const Fit& fit, const Eigen::Ref<const Eigen::Matrix3Xd>& v) const;
  /// Returns the rates V' [m/s] (3 x n) of the displacements in the fitted axes:
  ///   V' = R^T (v - mean) - w_F x x
  Eigen::Matrix3Xd rates(const Fit& fit, const Eigen::Ref<const Eigen::Matrix3Xd>& v) const;

  /// Adds point forces whose power equals the power of a moment L on the fitted axes   (THEORY 10.14):
  ///   F_i += R (w_i ((tr(S) 1 - S)^-1 L) x r_i)
  /// \param moment  [N m] the moment L, in the fitted axes
  /// \param force  [N] (3 x N) forces on all points of the system
  void add_moment(const Fit& fit, const Eigen::Vector3d& moment, Eigen::Ref<Eigen::Matrix3Xd> force) const;
  /// Adds point forces whose power is sum s.V' and whose resultant and moment are zero. They are the forces
  /// that add_moment() adds for L = -sum x_i x s_i, and in addition   (THEORY 10.15):
  ///   F_i += R (s_i - w_i sum s / sum w)
  /// \param s  [N] (3 x n) forces on the points in the set, in the fitted axes
  void add_forces(const Fit& fit, const Eigen::Matrix3Xd& s, Eigen::Ref<Eigen::Matrix3Xd> force) const;

  const std::vector<int>& points() const { return points_; }
  const Eigen::Matrix3Xd& rest() const { return r_; }
  bool is_line() const { return !line_.isZero(0.0); }
  const Eigen::Vector3d& line() const { return line_; }

 private:
  Eigen::Matrix3Xd gather(const Eigen::Ref<const Eigen::Matrix3Xd>& all) const;

  std::vector<int> points_;
  Eigen::VectorXd weights_;
  Eigen::Matrix3Xd r_;  // [m] (3 x n) rest positions from their weighted mean
  // [-] direction of the line if the points are on a line, else zero
  Eigen::Vector3d line_ = Eigen::Vector3d::Zero();
};

}  // namespace freeflex
