// The reasons why a command is rejected. The numbers are part of the protocol, and messages/README.md lists
// them.
#pragma once

#include <cstdint>

namespace freeflex::io {

enum class Reason : std::int32_t {
  kAccepted = 0,
  kMalformed = 1,  // length, counts, terminators or trailing bytes do not fit the type
  kWrongType = 2,  // fingerprint of another message type or version, see versions.hpp
  kWrongSession = 3,
  kBadSender = 4,      // not 1 to 31 of A-Z a-z 0-9 _ . -
  kStaleSequence = 5,  // not greater than the last sequence of this sender
  kBadSlot = 6,
  kBadAxes = 7,
  kBadTiming = 8,      // invalid start, late policy, duration or lease, or not exactly one of the last two
  kTooManyPoints = 9,  // too many points, wrenches, torques or wheels
  kUnknownPoint = 10,  // the scene has no point, or no wheel, of this index
  kNotPushable = 11,   // commands may not push the point, the group, or the body that contains the wheel
  kUnknownGroup = 12,
  kDuplicatePoint = 13,  // the command lists a point, group or wheel twice
  kNotFinite = 14,
  kOverLimit = 15,          // |force| or |torque| above the scene's limit
  kUnreachableTorque = 16,  // torque about the line of a collinear group, or on a group of one point
  kLate = 17,               // start_tick has passed and late_policy is 0
  kTooFarAhead = 18,        // start_tick is more than kMaxAheadTicks ahead; from the bus: more than max_hold
  kNoSlotFree = 19,         // all slots of the daemon are in use
  kQueueFull = 20,          // the rings or the places for waiting commands are full, or memory ran out
  kBadControl = 21,         // unknown control command, count out of range, or wrong target
  kWrongMode = 22,       // the control command does not apply now (RUN in lockstep; in a fault, every command
                         // except RESET and STOP)
  kTooManySenders = 23,  // the daemon's table of senders and their sequences is full
  kEpochEnded = 24,      // a reset came before the command's start_tick
  kLeftOut = 25,         // the command needs a feature that the plan omits
  kPointTorque = 26,     // a torque on a point that has no inertia
  kNoKeys = 27,          // a sealed command, but this daemon uses no keys
  kTooOld = 28,          // the command waited longer than `commands: max_age` of the scene for its decision
  // 29 to 37 occur only if keys are required
  kKeyRequired = 29,   // a command without an envelope
  kUnknownKey = 30,    // none of the daemon's keys has this id
  kBadTag = 31,        // the envelope was not sealed with this key for this channel
  kExpired = 32,       // valid_until has passed
  kValidTooLong = 33,  // valid_until is more than kMaxValidity ahead
  kKeyMismatch = 34,   // sender or sequence of the command differ from the sender or sequence of its envelope
  kNotGranted = 35,    // the key may not use this channel, control, point, group or slot
  kOverKeyLimit = 36,  // |force| or |torque| above the key's limit
  kTooFast = 37,       // more commands a second than the key may send
  // 38 and 39 occur only on the bus, whether or not keys are required
  kHeldTooLong = 38,  // duration or lease is longer than `commands: max_hold` of the scene
  kCleared = 39,      // the operator cleared the sender before the accepted command took effect
};
inline constexpr int kNumReasons = static_cast<int>(Reason::kCleared) + 1;

/// [us] Longest time by which valid_until may be ahead of the daemon's wall clock. An attacker who holds back
/// a sealed command can let it take effect only within this time.
inline constexpr std::int64_t kMaxValidity = 60'000'000;

inline constexpr std::int64_t kMaxAheadTicks = 100'000'000;
/// [ticks] Longest duration or lease: 31,000 years at 1 kHz. With this limit no sum of ticks overflows.
inline constexpr std::int64_t kMaxDurationTicks = 1'000'000'000'000'000;

/// Returns the snake-case name for screens and JSON, such as "unknown_point".
const char* reason_name(Reason reason) noexcept;

}  // namespace freeflex::io
