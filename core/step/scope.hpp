// Commands against the parts that a plan leaves out, and the way back to the plan that has them.
#pragma once

#include <cstdint>
#include <span>

#include "core/step/state.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

/// What a command needs of a plan that lacks it.
enum class Need : std::int32_t { kNone = 0, kRotation = 1, kOutOfPlane = 2 };

/// A moment or a part along the normal below this share of its terms is rounding [-].
inline constexpr double kScopeRounding = 1e-12;

/// The first part left out that a command needs (X125): it has a moment about the centre of mass (X121), or
/// loads that are not in the plane (X122). \param point_arm, group_arm  [m] from an index to the place where
/// the force acts, body axes
template <class PointArm, class GroupArm>
Need find_need(const CommandScope& scope, const ForceCommand& command, const PointArm& point_arm,
               const GroupArm& group_arm) noexcept {
  if (!scope.lacks_rotation && !scope.lacks_out_of_plane) return Need::kNone;
  // as shares of the largest component, so that no product leaves the range of numbers
  double largest = 0.0;
  const auto note = [&](const Vec3& v) {
    for (const double x : v) largest = __builtin_fabs(x) > largest ? __builtin_fabs(x) : largest;
  };
  for (std::int32_t k = 0; k < command.num_points; ++k)
    note(command.points[static_cast<std::size_t>(k)].force);
  for (std::int32_t k = 0; k < command.num_wrenches; ++k) {
    note(command.wrenches[static_cast<std::size_t>(k)].force);
    note(command.wrenches[static_cast<std::size_t>(k)].torque);
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
    const PointForce& each = command.points[static_cast<std::size_t>(k)];
    take_force(point_arm(each.point), in_body_axes(each.force));
  }
  for (std::int32_t k = 0; k < command.num_wrenches; ++k) {
    const Wrench& each = command.wrenches[static_cast<std::size_t>(k)];
    take_force(group_arm(each.group), in_body_axes(each.force));
    const Vec3 torque = in_body_axes(each.torque);
    moment = add(moment, torque);
    terms += size(torque);
    is_out = is_out || size(cross(torque, scope.normal_B)) > kScopeRounding * size(torque);
  }
  if (scope.lacks_rotation && size(moment) > kScopeRounding * terms) return Need::kRotation;
  return scope.lacks_out_of_plane && is_out ? Need::kOutOfPlane : Need::kNone;
}
/// The same with the arms of the plan itself.
Need find_need(const Plan& plan, const ForceCommand& command) noexcept;

/// Carries a state over into the wide plan: kept modes as they are, the others at rest. Rebuilds the loads at
/// the next step. Allocates nothing.
/// \pre plan.wide is there, state is not wide
void widen(const Plan& plan, Need need, State& state) noexcept;
/// The way back, of a step that was not made.  \pre widen was the last thing done to the state
void narrow(const Plan& plan, State& state) noexcept;

/// Gives a workspace the sizes of the plan that the state is in. Allocates nothing.
void fit(const Plan& plan, const State& state, Workspace& workspace) noexcept;

}  // namespace freeflex
