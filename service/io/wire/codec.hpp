// Bytes <-> validated core values. No socket, no thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/limits.hpp"
#include "core/step/command.hpp"
#include "core/step/plan.hpp"
#include "core/step/step.hpp"
#include "freeflex_msgs/applied_t.hpp"
#include "freeflex_msgs/force_t.hpp"
#include "service/io/wire/reason.hpp"

namespace freeflex::io {

/// kAccepted when the bytes are exactly one command: every count non-negative and within its limit, every
/// string terminated, and the length the one the counts imply; else kMalformed, kWrongType or kTooManyPoints,
/// and text (may be empty) gets what was found and what is allowed. Of more than channels::kMaxMessageBytes
/// it reads nothing at all. Reads nothing outside the span, allocates nothing; must hold before a generated
/// decode sees the bytes. \tparam Command  force_t or control_t
template <class Command>
Reason check_layout(std::span<const std::byte> bytes, std::span<char> text = {}) noexcept;

/// What a command may name, trivially copyable so that it can stand in shared memory.
struct NameTable {
  std::int32_t num_points = 0;  // of the scene
  std::int32_t num_groups = 0;
  std::int32_t num_wheels = 0;
  std::int32_t num_pushable = 0;
  std::array<std::int32_t, kMaxWheels> wheel_points{};       // that they are in
  double force_limit = 0.0;                                  // [N] 0: none
  double torque_limit = 0.0;                                 // [N m] 0: none
  double max_hold = 0.0;                                     // [s] of a duration or lease; 0: no limit
  std::int64_t max_hold_ticks = 0;                           // the same
  std::array<std::int32_t, kMaxTablePoints> pushable{};      // (num_pushable) points, ascending
  std::array<std::uint8_t, kMaxTablePoints> takes_torque{};  // those of them that turn
  struct GroupReach {
    std::int32_t torque_rank = 3;
    std::array<double, 3> line{};  // [-] body axes
    std::uint8_t is_pushable = 0;  // every point of the group has rows
  };
  std::array<GroupReach, kMaxGroups> groups{};
  // what the plan leaves out for good, and where forces act   (THEORY X121, X122)
  CommandScope scope;                              // lacks nothing when a wide plan stands ready
  std::array<Vec3, kMaxTablePoints> point_arms{};  // [m] of those, from the centre of mass, body axes
  std::array<Vec3, kMaxGroups> group_arms{};       // [m]
};
/// \pre the plan lets at most kMaxTablePoints points be pushed and has at most kMaxGroups groups (the daemon
/// checks at start)
/// Sets no limit on durations and leases: limit_holds does, for commands from the bus.
void fill_name_table(const Plan& plan, NameTable& table);
/// commands: max_hold of the scene, for commands from the bus.
void limit_holds(const Plan& plan, NameTable& table);
/// [ticks] commands: max_hold of the scene, at least one.
std::int64_t max_hold_ticks(const Plan& plan);

struct ControlCommand {
  std::array<char, kSenderSize> sender{};
  std::int64_t sequence = 0;
  std::int32_t command = 0;  // control_t constants
  std::int64_t count = 0;
  std::array<char, kSenderSize> target{};  // of CLEAR: a sender, or kEverySender; else empty
};

/// Outcome of decoding: on a rejection, sender and sequence are filled as far as they could be read, and
/// text says what was found and what is allowed (NUL-terminated).
struct Admission {
  Reason reason = Reason::kAccepted;
  std::array<char, kSenderSize> sender{};
  std::int64_t sequence = 0;
  std::array<char, 160> text{};
};

/// Session in the front of a status_t, of an earlier version also; empty when the bytes are none.
std::optional<std::int64_t> read_status_session(std::span<const std::byte> bytes) noexcept;

/// 1 to 31 of A-Z a-z 0-9 _ . - ; as an array, NUL to the end.
bool is_valid_sender(std::string_view sender) noexcept;
bool is_valid_sender(const std::array<char, kSenderSize>& sender) noexcept;

/// kBadSlot to kUnreachableTorque in the order of the list, then kLeftOut: the first that holds of a command.
/// text (may be empty) gets what was found and what is allowed. Allocates nothing; touches no entry outside
/// the arrays whatever the command holds.
Reason check_command(const ForceCommand& command, const NameTable& table, std::span<char> text) noexcept;

/// The same for a control command: kBadControl when the command is unknown or its count out of range. The
/// numbers of elastic modes and of pages, which bound SHAPES and SCENE, are the caller's to check.
Reason check_control(const ControlCommand& command, std::span<char> text) noexcept;

/// True when sender and contents pass, for values out of memory that another process writes.
/// \param table the caller's own copy
bool is_sane(const ForceCommand& command, const NameTable& table) noexcept;
bool is_sane(const ControlCommand& command) noexcept;
/// A rejection that may be answered: a reason of the list, a valid sender or none, printable text.
bool is_sane(const Admission& admission) noexcept;

/// Checks everything about a command that depends neither on the tick nor on what came before: layout,
/// session, sender and contents; kQueueFull only when there is no memory to decode in. kUnreachableTorque
/// about the line of a collinear group for body axes only: in world axes that part is dropped at each tick.
/// Session and sender are checked before the contents, so a rejection after kBadSender is of a command whose
/// sender and sequence stand in the admission; that of an envelope_t, kNoKeys, says those inside, if any.
Admission decode_force(std::span<const std::byte> bytes, std::int64_t session, const NameTable& table,
                       ForceCommand& command) noexcept;
Admission decode_control(std::span<const std::byte> bytes, std::int64_t session,
                         ControlCommand& command) noexcept;

/// Core command <-> message, bit for bit in every double.
freeflex_msgs::force_t to_message(const ForceCommand& command, std::int64_t session, std::int64_t utime);
/// From a decoded, trusted-length message (a log); Admission as decode_force.
Admission from_message(const freeflex_msgs::force_t& message, const NameTable& table,
                       ForceCommand& command) noexcept;

/// Generated encode into bytes.
template <class Message>
std::vector<std::byte> encode(const Message& message) {
  std::vector<std::byte> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

}  // namespace freeflex::io
