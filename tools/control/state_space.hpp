// Linear models of a free flexible body for control design.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "core/plan.hpp"

namespace freeflex::control {

/// x' = A x + B u, y = C x + D u.
///   x: x y z [m] and rx ry rz [rad] of the body, their rates vx vy vz, wx wy wz; q1.. [m], q_dot1.. [m/s] of
///   the modes; wheel.NAME.momentum [N m s], less its initial value. All vectors are in body axes. The model
///   is exact to first order for small motions of the undeformed body from rest, without the built-in loads
///   and fields. On the rung `rigid` there are no modes.
struct StateSpace {
  Eigen::MatrixXd A, B, C, D;
  // y = by_state x + by_rate x' + by_load u, from which C and D follow
  Eigen::MatrixXd by_state, by_rate, by_load;
  std::vector<std::string> states, inputs, outputs;
  std::vector<int> modes;  // numbers of the modes in the scene, from 1
};

/// Number of states of the body: position, rotation, velocity, angular velocity.
inline constexpr Eigen::Index kBodyStates = 12;
/// Sets C and D.
void set_outputs(StateSpace& model);

/// Names of inputs and outputs of a model, with their columns and rows. Inputs: point.NAME.fx fy fz [N],
/// point.NAME.tx ty tz [N m] of a body, group.NAME.fx .. tz, wheel.NAME.torque [N m]. A name without the last
/// letter, as in point.NAME.f, stands for three. Outputs: the states; point.NAME.x y z, vx vy vz, ax ay az;
/// dx dy dz (elastic); rx ry rz, wx wy wz of a body; link.NAME.axial, moment, 1 ..; three at once with
/// point.NAME.p, v, a, d, r, w.
struct Ports {
  std::vector<std::string> inputs, outputs;
};

/// What makes a model impossible, or the model.
struct StateSpaceResult {
  std::optional<StateSpace> model;
  std::string error;
};
/// Makes the model with all modes of the plan.
/// \pre the plan has rows of all points that the ports name, and omits no feature
StateSpaceResult make_state_space(const Plan& plan, const Ports& ports);

/// Which modes of a model to keep. The three conditions act one after the other.
struct Reduction {
  double low = 0.0, high = 0.0;  // [Hz] band; high 0: all
  std::optional<double> share;   // modes whose Hankel value is at least this share of the largest, 0 to 1
  std::optional<int> count;      // the modes with the largest Hankel values
};
/// The part of a mode in the outputs, b (c0 + c1 s + c2 s^2) / (s^2 + 2 zeta omega s + omega^2), with omega
/// in rad/s. For several inputs and outputs, b and c are norms.
struct ModeGain {
  int mode = 0;            // number in the scene
  double frequency = 0.0;  // [Hz]
  double damping = 0.0;    // [-] ratio zeta
  // |b| |c0 + i omega c1 - omega^2 c2| / omega^2; infinite for frequency 0
  double gain = 0.0;
  // gain / (4 zeta), approximately the Hankel singular value for zeta << 1 (Gawronski, Advanced Structural
  // Dynamics and Active Control of Structures, 2004, section 4.1); infinite without damping
  double hankel = 0.0;
  // upper bound of the part over all frequencies, exact if only one of c0, c1, c2 is not zero; infinite
  // without damping
  double peak = 0.0;
};
/// Returns the part of each mode, taken as uncoupled.
std::vector<ModeGain> mode_gains(const StateSpace& model);

struct Reduced {
  StateSpace model;
  // Upper bound of the gain of what was left out, over all frequencies, for each input and output; infinite
  // if it has no damping, not a number if dashpots, feedback or wheels couple the modes
  double bound = 0.0;
};
Reduced reduce(const StateSpace& model, const Reduction& reduction);

/// The transfer function of a model.
class Response {
 public:
  explicit Response(const StateSpace& model);
  /// Returns C (i omega - A)^-1 B + D.  \param omega  [rad/s] > 0
  Eigen::MatrixXcd at(double omega) const;

 private:
  Eigen::MatrixXd hessenberg_, B_, C_, D_;  // A = Q H Q^T, Q^T B, C Q
};

}  // namespace freeflex::control
