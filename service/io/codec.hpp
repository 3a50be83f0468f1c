// Bytes <-> validated core values. No socket, no thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/step/command.hpp"
#include "core/step/plan.hpp"
#include "core/step/step.hpp"
#include "freeflex_msgs/applied_t.hpp"
#include "freeflex_msgs/force_t.hpp"
#include "service/io/reason.hpp"

namespace freeflex::io {

/// True when the bytes are exactly one force_t or control_t: every count non-negative and within its limit,
/// every string terminated, and the length the one the counts imply. Reads nothing outside the span,
/// allocates nothing; must hold before a generated decode sees the bytes.
Reason wire_check_force(std::span<const std::byte> bytes) noexcept;
Reason wire_check_control(std::span<const std::byte> bytes) noexcept;

/// What a command may name, trivially copyable so that it can stand in shared memory.
struct NameTable {
  static constexpr int kMaxPoints = 8192;
  static constexpr int kMaxGroups = 1024;
  std::int32_t num_points = 0;
  std::int32_t num_groups = 0;
  double force_limit = 0.0;   // [N] 0: none
  double torque_limit = 0.0;  // [N m] 0: none
  std::array<std::uint8_t, kMaxPoints> is_pushable{};
  struct GroupReach {
    std::int32_t torque_rank = 3;
    std::array<double, 3> line{};  // [-] body axes
    std::uint8_t is_pushable = 0;  // every point of the group has rows
  };
  std::array<GroupReach, kMaxGroups> groups{};
};
/// \pre the plan has at most kMaxPoints points and kMaxGroups groups (the daemon checks at start)
void fill_name_table(const Plan& plan, NameTable& table);

struct ControlCommand {
  std::array<char, kSenderSize> sender{};
  std::int64_t sequence = 0;
  std::int32_t command = 0;  // control_t constants
  std::int64_t count = 0;
};

/// Outcome of decoding: on a rejection, sender and sequence are filled as far as they could be read, and
/// text says what was found and what is allowed (NUL-terminated).
struct Verdict {
  Reason reason = Reason::kAccepted;
  std::array<char, kSenderSize> sender{};
  std::int64_t sequence = 0;
  std::array<char, 160> text{};
};

/// Checks everything about a command that does not depend on the tick: all reasons but 5, 17 to 20, 22 to 24.
/// kUnreachableTorque for body axes only; in world axes the unreachable part is dropped at each tick.
Verdict decode_force(std::span<const std::byte> bytes, std::int64_t session, const NameTable& table,
                     ForceCommand& command) noexcept;
Verdict decode_control(std::span<const std::byte> bytes, std::int64_t session, ControlCommand& command) noexcept;

/// Core command <-> message, bit for bit in every double.
freeflex_msgs::force_t to_message(const ForceCommand& command, std::int64_t session, std::int64_t utime);
/// From a decoded, trusted-length message (a log); Verdict as decode_force.
Verdict from_message(const freeflex_msgs::force_t& message, const NameTable& table, ForceCommand& command) noexcept;

/// Generated encode into bytes.
template <class Message>
std::vector<std::byte> encode(const Message& message) {
  std::vector<std::byte> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

}  // namespace freeflex::io
