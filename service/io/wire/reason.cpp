#include "service/io/wire/reason.hpp"

#include <array>

namespace freeflex::io {
namespace {

struct NamedReason {
  Reason reason;
  const char* name;
};
constexpr std::array<NamedReason, kNumReasons> kNames = {{
    {Reason::kAccepted, "accepted"},
    {Reason::kMalformed, "malformed"},
    {Reason::kWrongType, "wrong_type"},
    {Reason::kWrongSession, "wrong_session"},
    {Reason::kBadSender, "bad_sender"},
    {Reason::kStaleSequence, "stale_sequence"},
    {Reason::kBadSlot, "bad_slot"},
    {Reason::kBadAxes, "bad_axes"},
    {Reason::kBadTiming, "bad_timing"},
    {Reason::kTooManyPoints, "too_many_points"},
    {Reason::kUnknownPoint, "unknown_point"},
    {Reason::kNotPushable, "not_pushable"},
    {Reason::kUnknownGroup, "unknown_group"},
    {Reason::kDuplicatePoint, "duplicate_point"},
    {Reason::kNotFinite, "not_finite"},
    {Reason::kOverLimit, "over_limit"},
    {Reason::kUnreachableTorque, "unreachable_torque"},
    {Reason::kLate, "late"},
    {Reason::kTooFarAhead, "too_far_ahead"},
    {Reason::kNoSlotFree, "no_slot_free"},
    {Reason::kQueueFull, "queue_full"},
    {Reason::kBadControl, "bad_control"},
    {Reason::kWrongMode, "wrong_mode"},
    {Reason::kTooManySenders, "too_many_senders"},
    {Reason::kEpochEnded, "epoch_ended"},
    {Reason::kLeftOut, "left_out"},
    {Reason::kPointTorque, "point_torque"},
    {Reason::kNoKeys, "no_keys"},
    {Reason::kTooOld, "too_old"},
    {Reason::kKeyRequired, "key_required"},
    {Reason::kUnknownKey, "unknown_key"},
    {Reason::kBadTag, "bad_tag"},
    {Reason::kExpired, "expired"},
    {Reason::kValidTooLong, "valid_too_long"},
    {Reason::kKeyMismatch, "key_mismatch"},
    {Reason::kNotGranted, "not_granted"},
    {Reason::kOverKeyLimit, "over_key_limit"},
    {Reason::kTooFast, "too_fast"},
    {Reason::kHeldTooLong, "held_too_long"},
    {Reason::kCleared, "cleared"},
}};

constexpr bool is_in_order() {
  for (int i = 0; i < kNumReasons; ++i)
    if (kNames[static_cast<std::size_t>(i)].reason != static_cast<Reason>(i)) return false;
  return true;
}
static_assert(is_in_order(), "one name for each reason, at its number");

}  // namespace

const char* reason_name(Reason reason) noexcept {
  const auto index = static_cast<std::int32_t>(reason);
  return index >= 0 && index < kNumReasons ? kNames[static_cast<std::size_t>(index)].name : "unknown_reason";
}

}  // namespace freeflex::io
