// Converts between bytes and validated core values. Uses no socket and no thread.
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
#include "core/plan.hpp"
#include "core/step/command.hpp"
#include "core/step/step.hpp"
#include "freeflex_msgs/applied_t.hpp"
#include "freeflex_msgs/force_t.hpp"
#include "service/io/wire/reason.hpp"

namespace freeflex::io {

/// Returns kAccepted if the bytes are exactly one command: every count is non-negative and within its limit,
/// every string is terminated, and the length agrees with the counts. Otherwise returns kMalformed,
/// kWrongType or kTooManyPoints, and writes into `text` what was found and what is allowed. `text` may be
/// empty. Does not read a message of more than channels::kMaxMessageBytes bytes, reads nothing outside the
/// span and allocates nothing. Must be called before a generated decode.
/// \tparam Command  force_t or control_t
template <class Command>
Reason check_layout(std::span<const std::byte> bytes, std::span<char> text = {}) noexcept;

/// Points, groups and wheels to which a command may refer. Trivially copyable, so that the table can be in
/// shared memory.
struct NameTable {
  std::int32_t num_points = 0;  // number of points of the scene
  std::int32_t num_groups = 0;
  std::int32_t num_wheels = 0;
  std::int32_t num_pushable = 0;
  std::array<std::int32_t, kMaxWheels> wheel_points{};       // point of the body that contains each wheel
  double force_limit = 0.0;                                  // [N] 0: no limit
  double torque_limit = 0.0;                                 // [N m] 0: no limit
  double max_hold = 0.0;                                     // [s] longest duration or lease, 0 for no limit
  std::int64_t max_hold_ticks = 0;                           // max_hold in ticks
  std::array<std::int32_t, kMaxTablePoints> pushable{};      // (num_pushable) points, ascending
  std::array<std::uint8_t, kMaxTablePoints> takes_torque{};  // 1: the point has inertia or an offset
  struct GroupTraits {
    std::int32_t torque_rank = 3;
    std::array<double, 3> line{};  // [-] body axes
    std::uint8_t is_pushable = 0;  // 1 if the plan stores the mode shapes at every point of the group
  };
  std::array<GroupTraits, kMaxGroups> groups{};
  // commands that would need a feature that the plan omits, and the points where forces act (THEORY 14.4,
  // 14.5)
  CommandScope scope;  // lacks nothing if there is a fallback plan
  // [m] positions of the pushable points from the centre of mass, body axes
  std::array<Vec3, kMaxTablePoints> point_arms{};
  std::array<Vec3, kMaxGroups> group_arms{};  // [m]
};
/// Fills the table from a plan, without a limit on durations and leases (limit_holds sets it).
/// \pre the plan has at most kMaxTablePoints pushable points and kMaxGroups groups (the daemon checks this at
///   start)
void fill_name_table(const Plan& plan, NameTable& table);
/// Sets max_hold and max_hold_ticks of the table to `commands: max_hold` of the scene. The limit applies to
/// commands from the bus.
void limit_holds(const Plan& plan, NameTable& table);
/// Returns `commands: max_hold` of the scene [ticks], at least one.
std::int64_t max_hold_ticks(const Plan& plan);

struct ControlCommand {
  std::array<char, kSenderSize> sender{};
  std::int64_t sequence = 0;
  std::int32_t command = 0;  // one of the constants in control_t
  std::int64_t count = 0;
  std::array<char, kSenderSize> target{};  // CLEAR: a sender, or kEverySender; else empty
};

/// Outcome of decoding. After a rejection, sender and sequence hold what could be read of them (else empty
/// and 0), and text (NUL-terminated) says what was found and what is allowed.
struct Admission {
  Reason reason = Reason::kAccepted;
  std::array<char, kSenderSize> sender{};
  std::int64_t sequence = 0;
  std::array<char, 160> text{};
};

/// Returns the session of a status_t of this or an earlier version, or nullopt if the bytes are not a
/// status_t.
std::optional<std::int64_t> read_status_session(std::span<const std::byte> bytes) noexcept;

/// Return true for a name of 1 to 31 characters of A-Z a-z 0-9 _ . - ; in an array, NUL must fill the
/// remaining bytes.
bool is_valid_sender(std::string_view sender) noexcept;
bool is_valid_sender(const std::array<char, kSenderSize>& sender) noexcept;

/// Returns the first reason to reject a command, or kAccepted. Checks slot, axes, timing, max_hold and
/// counts, then forces, torques, wheels and wrenches in this order, then whether the plan omits a feature
/// that the command needs. Writes to `text`, which may be an empty span, what was found and what is allowed.
/// Allocates nothing, and reads nothing outside the arrays, whatever values the command contains.
Reason check_command(const ForceCommand& command, const NameTable& table, std::span<char> text) noexcept;

/// Returns kBadControl if a control command is unknown, its count is out of range, or its target is missing,
/// invalid or not allowed; else kAccepted. The caller must check the count of SHAPES against the number of
/// elastic modes, and the count of SCENE against the number of pages.
Reason check_control(const ControlCommand& command, std::span<char> text) noexcept;

/// Return true if sender and contents pass the checks. Use these functions for values in memory that another
/// process writes.
/// \param table the caller's own copy
bool is_sane(const ForceCommand& command, const NameTable& table) noexcept;
bool is_sane(const ControlCommand& command) noexcept;
/// Returns true if a rejection may be answered: its reason is in the enumeration and is not kAccepted, its
/// sender is valid or empty, and its text is printable and terminated.
bool is_sane(const Admission& admission) noexcept;

/// Decode a command and check everything that depends neither on the tick nor on earlier commands: layout,
/// session, sender and contents. kQueueFull means that memory for decoding ran out. A torque about the line
/// of a collinear group is rejected with kUnreachableTorque only if its axes are body axes. In world axes the
/// component about the line is ignored at each tick. Session and sender are checked before the contents, so
/// the admission has the sender and the sequence of the command if the number of the reason is above that of
/// kBadSender. One exception is kNoKeys, the rejection of an envelope_t: the admission has the sender and the
/// sequence of the command inside the envelope, if there is a valid one.
Admission decode_force(std::span<const std::byte> bytes, std::int64_t session, const NameTable& table,
                       ForceCommand& command) noexcept;
Admission decode_control(std::span<const std::byte> bytes, std::int64_t session,
                         ControlCommand& command) noexcept;

/// Converts a core command into a message, and keeps the bits of every double.
freeflex_msgs::force_t to_message(const ForceCommand& command, std::int64_t session, std::int64_t utime);
/// Converts a decoded message from a log, whose lists have the lengths that its counts say. Gives the same
/// reasons as decode_force does after it has checked layout and session.
Admission from_message(const freeflex_msgs::force_t& message, const NameTable& table,
                       ForceCommand& command) noexcept;

/// Returns the encoded message.
template <class Message>
std::vector<std::byte> encode(const Message& message) {
  std::vector<std::byte> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

}  // namespace freeflex::io
