// A validated force command: fixed size and trivially copyable, so it crosses rings and shared memory as it
// is.
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
inline constexpr int kMaxSlotNumber = 63;  // slot numbers 0..63 of one sender
inline constexpr int kSenderSize = 32;     // bytes, NUL-terminated

struct PointForce {
  std::int32_t point;           // index into Plan::points
  std::int32_t padding;         // 0
  std::array<double, 3> force;  // [N]
};
struct Wrench {
  std::int32_t group;            // index into Plan::groups
  std::int32_t padding;          // 0
  std::array<double, 3> force;   // [N]
  std::array<double, 3> torque;  // [N m]
};

struct PointTorque {
  std::int32_t point;            // index into Plan::points, of a body
  std::int32_t padding;          // 0
  std::array<double, 3> torque;  // [N m]
};

struct WheelTorque {
  std::int32_t wheel;    // index into Plan::wheels
  std::int32_t padding;  // 0
  double torque;         // [N m] of the motor, on the wheel; the body takes the opposite
};

/// Replaces the contents of one slot (sender, slot). No force, wrench or torque: the slot is cleared.
struct ForceCommand {
  std::array<char, kSenderSize> sender;  // [A-Za-z0-9_.-], 1 to 31 characters, rest NUL
  std::int64_t sequence;                 // per sender, increasing
  std::int32_t slot;                     // 0..kMaxSlotNumber
  std::int32_t axes;                     // 0 world, 1 body
  std::int64_t start_tick;               // -1: at once
  std::int64_t duration_ticks;           // > 0: ends so many ticks after it took effect; 0: see lease
  std::int64_t lease_ticks;              // > 0: ends unless the slot is renewed within; 0: see duration
  std::int32_t late_policy;              // 0: reject when start_tick has passed, 1: take at the next tick
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

/// True when the command clears its slot.
inline bool is_clearing(const ForceCommand& command) noexcept {
  return command.num_points == 0 && command.num_wrenches == 0 && command.num_torques == 0 &&
         command.num_wheels == 0;
}

}  // namespace freeflex
