// A validated force command. A command has a fixed size and is trivially copyable, so it can be copied
// through ring buffers and shared memory unchanged.
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

#include "core/limits.hpp"

namespace freeflex {

inline constexpr int kMaxCommandPoints = 256;
inline constexpr int kMaxCommandWrenches = 16;
inline constexpr int kMaxCommandTorques = 16;
inline constexpr int kMaxSlots = 64;       // active slots over all senders
inline constexpr int kMaxSlotNumber = 63;  // the slots of a sender are numbered 0..63
inline constexpr int kSenderSize = 32;     // bytes of a sender's name, including at least one NUL

struct PointForce {
  std::int32_t point;           // index into StepPlan::points
  std::int32_t padding;         // 0
  std::array<double, 3> force;  // [N]
};
struct Wrench {
  std::int32_t group;            // index into StepPlan::groups
  std::int32_t padding;          // 0
  std::array<double, 3> force;   // [N]
  std::array<double, 3> torque;  // [N m]
};

struct PointTorque {
  std::int32_t point;            // index into StepPlan::points; the point has an attitude
  std::int32_t padding;          // 0
  std::array<double, 3> torque;  // [N m]
};

struct WheelTorque {
  std::int32_t wheel;    // index into StepPlan::wheels
  std::int32_t padding;  // 0
  double torque;         // [N m] torque of the motor on the wheel; the opposite torque acts on the body
};

/// Holds a command that replaces the loads in one slot of its sender. A command without any force, wrench or
/// torque clears the slot.
struct ForceCommand {
  std::array<char, kSenderSize> sender;  // name: 1 to 31 characters of A-Z a-z 0-9 _ . -, then NUL bytes
  std::int64_t sequence;                 // number of the command; increases for each sender
  std::int32_t slot;                     // number of the slot, 0 to kMaxSlotNumber
  std::int32_t axes;                     // axes of forces and torques: 0 world, 1 body
  std::int64_t start_tick;               // tick at which the loads start to act; -1: at once
  std::int64_t duration_ticks;  // > 0: number of ticks in which the loads act; 0: lease_ticks applies
  // > 0: the slot ends if the sender does not renew it within this number of ticks; 0: duration_ticks
  // applies.
  std::int64_t lease_ticks;
  std::int32_t late_policy;  // if start_tick has passed: 0 reject, 1 apply at the next tick
  std::int32_t num_points;
  std::int32_t num_wrenches;
  std::int32_t num_torques;
  std::int32_t num_wheels;
  std::int32_t padding;  // 0
  std::array<PointForce, kMaxCommandPoints> points;
  std::array<Wrench, kMaxCommandWrenches> wrenches;
  std::array<PointTorque, kMaxCommandTorques> torques;
  std::array<WheelTorque, kMaxWheels> wheels;
};
static_assert(std::is_trivially_copyable_v<ForceCommand>);

/// Returns true if the command clears its slot.
inline bool is_clearing(const ForceCommand& command) noexcept {
  return command.num_points == 0 && command.num_wrenches == 0 && command.num_torques == 0 &&
         command.num_wheels == 0;
}

}  // namespace freeflex
