// Finds out whether a command needs a feature that a plan omits, and switches a state to the fallback plan,
// which has the feature.
#pragma once

#include <cstdint>
#include <span>

#include "core/step/state.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

/// Identifies a feature that a command needs and the plan omits.
enum class Need : std::int32_t { kNone = 0, kRotation = 1, kOutOfPlane = 2 };

/// [-] A moment or an out-of-plane component is a rounding error if it is at most this fraction of the sum of
/// the magnitudes of its terms.
inline constexpr double kScopeRounding = 1e-12;

/// Returns the omitted feature that a command needs   (THEORY 14.16). kRotation: the plan omits rotation, and
/// the moment about the centre of mass exceeds rounding error. Otherwise kOutOfPlane: the plan omits
/// out-of-plane modes, and a load is not in the plane. Otherwise kNone. The moment is a rounding error, and
/// the loads are in the plane, if
///   |sum_i r_i x F_i + T| <= 1e-12 (sum_i |r_i| |F_i| + |T|)   (THEORY 14.4)
///   |n . F| <= 1e-12 |F|,   |T x n| <= 1e-12 |T|   (THEORY 14.5)
/// \param point_arm, group_arm  functions that return the position [m] of a force in body axes, given the
/// index of its point or group
template <class PointArm, class GroupArm>
Need find_need(const CommandScope& scope, const ForceCommand& command, const PointArm& point_arm,
               const GroupArm& group_arm) noexcept {
  if (!scope.lacks_rotation && !scope.lacks_out_of_plane) return Need::kNone;
  // All values are divided by the largest component, so that no product overflows or underflows.
  double largest = 0.0;
  const auto note = [&](const Vec3& v) {
    for (const double x : v) largest = __builtin_fabs(x) > largest ? __builtin_fabs(x) : largest;
  };
  for (std::int32_t k = 0; k < command.num_points; ++k) note(command.points[index(k)].force);
  for (std::int32_t k = 0; k < command.num_wrenches; ++k) {
    note(command.wrenches[index(k)].force);
    note(command.wrenches[index(k)].torque);
  }
  if (largest == 0.0) return Need::kNone;
  const auto in_body_axes = [&](const Vec3& v) {
    const Vec3 share{v[0] / largest, v[1] / largest, v[2] / largest};
    return command.axes == 1 ? share : multiply_transposed(scope.R_WB, share);
  };
  const auto size = [](const Vec3& v) { return __builtin_sqrt(dot(v, v)); };
  const auto leaves_plane = [&](const Vec3& v) {
    return __builtin_fabs(dot(v, scope.normal_B)) > kScopeRounding * size(v);
  };
  Vec3 moment{};
  double terms = 0.0;
  bool is_out = false;
  const auto take_force = [&](const Vec3& arm, const Vec3& force) {
    moment = add(moment, cross(arm, force));
    terms += size(arm) * size(force);
    is_out = is_out || leaves_plane(force);
  };
  for (std::int32_t k = 0; k < command.num_points; ++k) {
    const PointForce& each = command.points[index(k)];
    take_force(point_arm(each.point), in_body_axes(each.force));
  }
  for (std::int32_t k = 0; k < command.num_wrenches; ++k) {
    const Wrench& each = command.wrenches[index(k)];
    take_force(group_arm(each.group), in_body_axes(each.force));
    const Vec3 torque = in_body_axes(each.torque);
    moment = add(moment, torque);
    terms += size(torque);
    is_out = is_out || size(cross(torque, scope.normal_B)) > kScopeRounding * size(torque);
  }
  if (scope.lacks_rotation && size(moment) > kScopeRounding * terms) return Need::kRotation;
  return scope.lacks_out_of_plane && is_out ? Need::kOutOfPlane : Need::kNone;
}
/// Returns the omitted feature that a command needs. The positions of points and groups are those in the
/// plan.
Need find_need(const StepPlan& plan, const ForceCommand& command) noexcept;

/// Converts a state from the reduced plan to the fallback plan. The modes of both plans keep their
/// coordinates, and the modes that only the fallback plan has start at rest (THEORY 14.16). The next step
/// computes the loads again. Allocates nothing.
/// \pre there is a fallback plan, and the state does not use it
void switch_to_fallback(const StepPlan& plan, Need need, State& state) noexcept;
/// Undoes switch_to_fallback after a failed step.
/// \pre the state has not changed since switch_to_fallback
void switch_back(const StepPlan& plan, State& state) noexcept;

/// Resizes a workspace for the plan on which the state is stepped. Allocates nothing.
void fit(const StepPlan& plan, const State& state, Workspace& workspace) noexcept;

}  // namespace freeflex
