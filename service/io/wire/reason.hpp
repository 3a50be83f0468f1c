// Why a command was not taken. Numbers are part of the protocol: messages/README.md lists them.
#pragma once

#include <cstdint>

namespace freeflex::io {

enum class Reason : std::int32_t {
  kAccepted = 0,
  kMalformed = 1,  // length, counts, terminators or trailing bytes do not fit the type
  kWrongType = 2,  // fingerprint of another message type or version, see versions.hpp
  kWrongSession = 3,
  kBadSender = 4,      // not 1 to 31 of A-Z a-z 0-9 _ . -
  kStaleSequence = 5,  // not greater than the last of this sender
  kBadSlot = 6,
  kBadAxes = 7,
  kBadTiming = 8,      // start, late policy, duration and lease do not fit together
  kTooManyPoints = 9,  // or wrenches
  kUnknownPoint = 10,  // index outside the scene
  kNotPushable = 11,   // the scene does not let commands push this point
  kUnknownGroup = 12,
  kDuplicatePoint = 13,  // a point or group named twice in one command
  kNotFinite = 14,
  kOverLimit = 15,          // |force| or |torque| above the scene's limit
  kUnreachableTorque = 16,  // torque about the line of a collinear group, or on a single point
  kLate = 17,               // start_tick has passed and late_policy is 0
  kTooFarAhead = 18,        // start_tick further ahead than kMaxAheadTicks, or from the bus than max_hold
  kNoSlotFree = 19,         // all slots of the daemon are taken
  kQueueFull = 20,          // more commands than the rings or the pending list hold
  kBadControl = 21,         // unknown control command or count outside its range
  kWrongMode = 22,  // the control does not apply now (run in lockstep, all but reset, stop while faulted)
  kTooManySenders = 23,  // more senders than the daemon keeps sequences for
  kEpochEnded = 24,      // a reset came before the command's start_tick
  kLeftOut = 25,         // the command needs a part that the plan leaves out
  kPointTorque = 26,     // a torque on a point, which has no inertia
  kNoKeys = 27,          // a signed command, and this daemon takes no keys
  kTooOld = 28,          // waited longer for its decision than the scene allows
  // where keys are required
  kKeyRequired = 29,   // a command without an envelope
  kUnknownKey = 30,    // key id of none of the daemon's keys
  kBadTag = 31,        // the envelope was not sealed with this key for this channel
  kExpired = 32,       // valid_until has passed
  kValidTooLong = 33,  // valid_until further ahead than kMaxValidity
  kKeyMismatch = 34,   // sender or sequence of the command are not those of its envelope
  kNotGranted = 35,    // the key may not use this channel, control, point, group or slot
  kOverKeyLimit = 36,  // |force| or |torque| above the key's limit
  kTooFast = 37,       // more commands a second than the key may send
  // on the bus, with keys or without
  kHeldTooLong = 38,  // duration or lease longer than the scene's commands: max_hold
  kCleared = 39,      // the operator cleared the sender while the accepted command waited
};
inline constexpr int kNumReasons = static_cast<int>(Reason::kCleared) + 1;

/// [us] Furthest that valid_until may be ahead of the daemon's wall clock: as long as a command that is held
/// back on its way can still take effect.
inline constexpr std::int64_t kMaxValidity = 60'000'000;

inline constexpr std::int64_t kMaxAheadTicks = 100'000'000;
/// Longest duration or lease: 31,000 years at 1 kHz, and no sum of ticks overflows.
inline constexpr std::int64_t kMaxDurationTicks = 1'000'000'000'000'000;

/// Snake-case name used on screens and in JSON, "unknown_point".
const char* reason_name(Reason reason) noexcept;

}  // namespace freeflex::io
