// The step of the floating frame advances translation, attitude and angular momentum (THEORY section 7).
#pragma once

#include <array>
#include <optional>

#include "core/step/state.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

/// Holds the resultant and the moment of the loads on the body at one time, without gravity
/// (THEORY 8.1 to 8.3, 8.7).
struct RigidLoad {
  Vec3 force_W{};                     // [N] resultant of the forces fixed in world axes
  std::array<double, 27> moment_W{};  // [N m] moment of these forces, as in LoadPattern
  bool has_moment_W = false;
  Vec3 force_B{};   // [N] resultant of the loads fixed in body axes
  Vec3 torque_B{};  // [N m] moment of these loads about the centre of mass
};
/// Adds amplitude times the pattern to the load.
void add_pattern(const LoadPattern& pattern, double amplitude, RigidLoad& load) noexcept;

/// Returns the resultant force [N] in world axes.
Vec3 resultant_W(const RigidLoad& load, const Mat3& R_WB) noexcept;
/// Returns the moment about the centre of mass [N m] in body axes: L_B,c = torque_B,c + sum_ab R_WB,ba L_c,ab
/// (THEORY 8.3).
Vec3 moment_B(const RigidLoad& load, const Mat3& R_WB) noexcept;

/// Holds the momentum of the wheels over one step, in body axes: h_0 + s h_1 + s^2 h_2 + s^3 h_3, where s is
/// the time in the step, from 0 to 1   (THEORY 16.21).
struct WheelMomentum {
  std::array<Vec3, 4> h{};  // [N m s]
  Vec3 at(double s) const noexcept {
    return add_scaled(add_scaled(add_scaled(h[0], s, h[1]), s * s, h[2]), s * s * s, h[3]);
  }
  /// Returns true if motors change the momentum.
  bool is_driven() const noexcept { return !is_zero(h[1]) || !is_zero(h[2]) || !is_zero(h[3]); }
};

/// Holds the loads on the body at the start of a step. Holds them also at the middle and at the end if they
/// may differ from those at the start.
struct RigidLoads {
  struct Later {
    RigidLoad middle, end;
  };
  RigidLoad start;
  std::optional<Later> later;
  WheelMomentum wheels;
  const RigidLoad& middle() const noexcept { return later ? later->middle : start; }
  const RigidLoad& end() const noexcept { return later ? later->end : start; }
};

/// Returns the rotation matrix of the Gibbs vector g. It transforms vectors from the rotated axes to the axes
/// at the start of the step:
///   G(g) = 1 + 2 ([g x] + [g x][g x]) / (1 + g.g)   (THEORY 7.6)
Mat3 rotation_of_gibbs(const Vec3& g) noexcept;
/// Rotates the attitude by the Gibbs vector g in body axes at the start of the step:
///   q_WB^1 = q_WB^0 o (1, g) / sqrt(1 + g.g)   (THEORY 7.13)
void rotate_attitude(const Vec3& g, Frame& frame) noexcept;
/// Rotates the attitude by a unit quaternion: q_WB += q_WB o less_one, where less_one is the unit quaternion
/// minus (1, 0, 0, 0). The rounding error of the sum is stored in the low part   (THEORY 7.13).
void add_rotation(const Quat& less_one, Frame& frame) noexcept;
/// Advances position and velocity by a time h [s] under M p_WB'' = F_W + M g_W (THEORY 7.2). Applies
/// Simpson's rule to the forces [N], in world axes, at the start, the middle and the end of h   (THEORY 7.5):
///   mean_force = (start + 4 middle + end) / 6,   weighted_force = (start + 2 middle) / 3
void translate(const StepPlan& plan, double h, const Vec3& start, const Vec3& middle, const Vec3& end,
               Frame& frame) noexcept;

/// Advances position and velocity by a time h [s], exactly for F_W quadratic in time:
///   p_WB += h v_WB + h^2 (weighted_force / M + g_W) / 2,   v_WB += h (mean_force / M + g_W)   (THEORY 7.5)
/// If there is an attractor, its field replaces g_W   (THEORY 7.26, 8.18).
/// \param mean_force  [N] mean of the force over h, int F_W dt / h
/// \param weighted_force  [N] mean of the force with weights 2 (1 - t / h), 2 int (1 - t / h) F_W dt / h
void translate(const StepPlan& plan, double h, const Vec3& mean_force, const Vec3& weighted_force,
               Frame& frame) noexcept;

/// Returns the frame one period later:
///   M p_WB'' = F_W + M g_W,   H_W' = L_W,   w = I^-1 R_WB^T H_W   (THEORY 7.2 to 7.4)
/// \param R_WB  rotation matrix of from.q_WB
Frame advance_frame(const StepPlan& plan, const Frame& from, const Mat3& R_WB,
                    const RigidLoads& loads) noexcept;

}  // namespace freeflex
