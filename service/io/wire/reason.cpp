#include "service/io/wire/reason.hpp"

#include <array>

namespace freeflex::io {

const char* reason_name(Reason reason) noexcept {
  static constexpr std::array<const char*, kNumReasons> kNames = {
      "accepted",       "malformed",          "wrong_type",    "wrong_session",    "bad_sender",
      "stale_sequence", "bad_slot",           "bad_axes",      "bad_timing",       "too_many_points",
      "unknown_point",  "not_pushable",       "unknown_group", "duplicate_point",  "not_finite",
      "over_limit",     "unreachable_torque", "late",          "too_far_ahead",    "no_slot_free",
      "queue_full",     "bad_control",        "wrong_mode",    "too_many_senders", "epoch_ended",
      "left_out"};
  const auto index = static_cast<std::int32_t>(reason);
  return index >= 0 && index < kNumReasons ? kNames[static_cast<std::size_t>(index)] : "unknown_reason";
}

}  // namespace freeflex::io
