// The floating frame over one step: translation, attitude, angular momentum (THEORY section 7).
#pragma once

#include <array>
#include <optional>

#include "core/step/state.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

/// What loads do to the body as a whole at one instant, without gravity (THEORY X11).
struct RigidLoad {
  Vec3 force_W{};                     // [N] fixed in world axes
  std::array<double, 27> moment_W{};  // [N m] see LoadPattern
  bool has_moment_W = false;
  Vec3 force_B{};   // [N] fixed in body axes
  Vec3 torque_B{};  // [N m]
};
/// Adds amplitude times a pattern   (THEORY X11, X13).
void add_pattern(const LoadPattern& pattern, double amplitude, RigidLoad& load) noexcept;

/// Resultant [N] in world axes and moment about the centre of mass [N m] in body axes.
Vec3 resultant_W(const RigidLoad& load, const Mat3& R_WB) noexcept;
Vec3 moment_B(const RigidLoad& load, const Mat3& R_WB) noexcept;

/// Momentum of the wheels over one step, body axes: at its start, at the share s of it h_0 + s h_1 + s^2 h_2
/// + s^3 h_3 (THEORY X167).
struct WheelMomentum {
  std::array<Vec3, 4> h{};  // [N m s]
  Vec3 at(double s) const noexcept {
    return add_scaled(add_scaled(add_scaled(h[0], s, h[1]), s * s, h[2]), s * s * s, h[3]);
  }
  /// True when motors change it.
  bool is_driven() const noexcept { return !is_zero(h[1]) || !is_zero(h[2]) || !is_zero(h[3]); }
};

/// Loads over one step: at its start, and at its middle and end when those may differ.
struct StepLoads {
  struct Later {
    RigidLoad middle, end;
  };
  RigidLoad start;
  std::optional<Later> later;
  WheelMomentum wheels;
  const RigidLoad& middle() const noexcept { return later ? later->middle : start; }
  const RigidLoad& end() const noexcept { return later ? later->end : start; }
};

/// Rotation matrix of the Gibbs vector g, turned axes to start axes: 1 + 2 ([g x] + [g x][g x]) / (1 + g.g)
/// (X7).
Mat3 rotation_of_gibbs(const Vec3& g) noexcept;
/// The attitude turned by the Gibbs vector g in the axes of the step's start: q_WB o (1, g) / sqrt(1 +
/// g.g)   (X9).
void turn_attitude(const Vec3& g, Frame& frame) noexcept;
/// The same of a unit quaternion less (1, 0, 0, 0): q_WB += q_WB o less_one, so that rounding stays behind in
/// the low part.
void add_turn(const Quat& less_one, Frame& frame) noexcept;
/// Position and velocity a time h [s] later, M p_WB'' = F_W + M gravity_W   (X6, X72), from forces [N] at its
/// start, middle and end, world axes, by Simpson's rule.
void translate(const Plan& plan, double h, const Vec3& start, const Vec3& middle, const Vec3& end,
               Frame& frame) noexcept;

/// Translation under gravity and the resultant, M p_WB'' = F_W + M gravity_W (X6), exact for F_W quadratic in
/// time:
///   p_WB += h v_WB + h^2 (weighted_force / M + gravity_W) / 2,   v_WB += h (mean_force / M + gravity_W)
/// \param mean_force  [N] int F_W dt / h  \param weighted_force  [N] 2 int (1 - t / h) F_W dt / h
void translate(const Plan& plan, double h, const Vec3& mean_force, const Vec3& weighted_force,
               Frame& frame) noexcept;

/// The frame one period later: M p_WB'' = F_W + M gravity_W, H_W' = L_W, w = I^-1 R_WB^T H_W   (THEORY
/// X6-X9). R_WB is the rotation matrix of from.q_WB.
Frame advance_frame(const Plan& plan, const Frame& from, const Mat3& R_WB, const StepLoads& loads) noexcept;

}  // namespace freeflex
