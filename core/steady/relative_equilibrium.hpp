// Steady motions of a plan on a coupled rung, and the small motions about them   (THEORY 12.98 to 12.101).
#pragma once

#include <Eigen/Core>
#include <complex>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/step/loads/step_loads.hpp"
#include "core/step/plan.hpp"

namespace freeflex {

/// Holds a small motion exp(rate t).
struct SmallMotion {
  std::complex<double> rate;  // [1/s]
  // index of the mode with the largest share of its energy; -1: the rotation of the body has the largest
  std::int32_t mode = -1;
  double share = 0.0;  // [-] this share
};

/// Holds a steady motion: in its own axes the body rotates at a constant rate with a constant deformation.
struct RelativeEquilibrium {
  std::string error;               // why no steady motion was found; empty if one was found
  Eigen::Vector3d spin;            // [rad/s] body axes
  Eigen::Matrix3Xd displacements;  // [m] (3 x num_points) body axes
  // [rad/s^2] acceleration of the rotation by a moment of the loads that is too small to matter beside the
  // elastic motion, body axes; zero if there is none
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
  // ascending in |Im rate|, one of each conjugate pair; motions that only continue the steady motion with
  // another attitude or spin are left out
  std::vector<SmallMotion> motions;
  // of respond(): the links do not hold the shape, so that a small push moves the structure far
  bool is_unstable = false;
  // [-] largest relative change of a rate if the finite differences take three times longer steps
  double accuracy = 0.0;
};

/// Finds steady motions of a plan on a coupled rung, and linearises the equations of the step about them
/// (THEORY 12.98 to 12.101). Feedback and damping act, and wheels keep their initial momenta. The attractor
/// is left out.
/// \pre the rung is coupled
class RelativeEquilibria {
 public:
  /// \param loads_at  [s] time at which built-in loads have the values that they keep, rounded to a tick;
  ///   nullopt: no load acts
  RelativeEquilibria(const StepPlan& plan, std::optional<double> loads_at);

  /// Finds the steady motion at the rate |spin| whose axis is near that of `spin`, by Newton's method from
  /// the steady motion that was found last or from the shape at rest. If it fails, it follows the motion from
  /// rest as spin and loads grow in equal steps. Then finds the small motions about it.
  /// \param spin  [rad/s] body axes
  RelativeEquilibrium find(const Eigen::Vector3d& spin);

  /// Finds the shape that is at rest in the axes of the body, without elastic rates and accelerations, at an
  /// instant at which the body rotates at `spin`, and whether this shape is stable at a fixed spin. The loads
  /// may turn the body and change its spin   (THEORY 15.11). Finds no small motions.
  /// \param spin  [rad/s] body axes
  RelativeEquilibrium respond(const Eigen::Vector3d& spin);

  /// Returns the time of the loads [s], a multiple of the period of the plan.
  double time() const { return static_cast<double>(tick_) * plan_.period; }

 private:
  // q, p over the mass, H_B and the small rotation of the attitude: (n + n + 3 + 3)
  using Vector = Eigen::VectorXd;

  std::string refusal(const Eigen::Vector3d& spin) const;
  void scale_loads(double share);
  Vector steady_state(const Vector& q, const Eigen::Vector3d& spin);
  Vector rates(const Vector& z, const Eigen::Vector3d& spin);
  Vector by_acceleration(const Vector& q, const Eigen::Vector3d& H_rate);
  void renew_joints(const Vector& z, const Eigen::Vector3d& spin);
  Vector residual_at(const Vector& q, const Eigen::Vector3d& w);
  Eigen::MatrixXd stiffness_at(const Vector& q, const Eigen::Vector3d& w);
  std::string solve(double rate, Vector& q, Eigen::Vector3d& spin);
  Vector step_of(const Eigen::MatrixXd& J, const Vector& r) const;
  double zero_rate(const Eigen::MatrixXd& A, double spin) const;
  std::string follow(const Eigen::Vector3d& asked, int num_steps, Vector& q, Eigen::Vector3d& spin);
  Eigen::MatrixXd linearise(const Vector& z, const Eigen::Vector3d& spin, double stretch);
  std::string follow_from_last(const Eigen::Vector3d& asked, Vector& q, Eigen::Vector3d& spin);
  Eigen::Matrix3Xd displacements() const;
  std::string set_motions(const Vector& z, RelativeEquilibrium& motion);

  StepPlan plan_;
  std::int64_t tick_ = 0;
  Eigen::Index n_;
  double size_ = 0.0;  // [m] largest distance of a point from the centre of mass
  Vector scale_;       // [rad/s] (n) frequency of each mode, or the lowest one of all
  Vector step_;        // [m] (n) step of finite differences
  bool has_world_loads_ = false, has_motor_ = false;
  bool may_accelerate_ = false;  // the shape of respond() is sought
  double load_size_ = 0.0;       // [N] sum of the sizes of all loads
  Vector amplitudes_;            // [-] of each history at the time of the loads
  Vector q_;                     // [m] (n) of the last steady motion
  State state_;
  Workspace workspace_;
};

}  // namespace freeflex
