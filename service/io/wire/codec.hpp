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
#include "core/step/command.hpp"
#include "core/step/plan.hpp"
#include "core/step/step.hpp"
#include "freeflex_msgs/applied_t.hpp"
#include "freeflex_msgs/force_t.hpp"
#include "service/io/wire/reason.hpp"

namespace freeflex::io {

/// Returns kAccepted if the bytes are exactly one command: every count is non-negative and within its limit,
/// every string is terminated, and the length agrees with the counts. Else returns kMalformed, kWrongType or
/// kTooManyPoints and writes to `text`, which may be an empty span, what was found and what is allowed. Does
/// not read a message of more than channels::kMaxMessageBytes bytes, reads nothing outside the span and
/// allocates nothing. Must be called before a generated decode.
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
  std::array<std::int32_t, kMaxWheels> wheel_points{};       // point that contains each wheel
  double force_limit = 0.0;                                  // [N] 0: no limit
  double torque_limit = 0.0;                                 // [N m] 0: no limit
  double max_hold = 0.0;                                     // [s] longest duration or lease, 0 for no limit
  std::int64_t max_hold_ticks = 0;                           // max_hold in ticks
  std::array<std::int32_t, kMaxTablePoints> pushable{};      // (num_pushable) points, ascending
  std::array<std::uint8_t, kMaxTablePoints> takes_torque{};  // 1: the pushable point has inertia or an offset
  struct GroupTraits {
    std::int32_t torque_rank = 3;
    std::array<double, 3> line{};  // [-] body axes
    std::uint8_t is_pushable = 0;  // 1 if the plan stores the mode shapes at every point of the group
  };
  std::array<GroupTraits, kMaxGroups> groups{};
  // features that the plan omits and no command can restore, and the points where forces act
  // (THEORY 14.4, 14.5)
  CommandScope scope;  // omits nothing if there is a fallback plan
  // [m] positions of the pushable points from the centre of mass, body axes
  std::array<Vec3, kMaxTablePoints> point_arms{};
  std::array<Vec3, kMaxGroups> group_arms{};  // [m]
};
/// Fills the table from a plan, without a limit on durations and leases (limit_holds sets it).
/// \pre the plan has at most kMaxTablePoints pushable points and kMaxGroups groups (the daemon checks this
///  at
///   start)
void fill_name_table(const Plan& plan, NameTable& table);
/// Sets max_hold of the table, which limits commands from the bus, to `commands: max_hold` of the scene.
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

/// Outcome of decoding. After a rejection, sender and sequence are as far as they could be read, and text
/// (NUL-terminated) gives what was found and what is allowed.
struct Admission {
  Reason reason = Reason::kAccepted;
  std::array<char, kSenderSize> sender{};
  std::int64_t sequence = 0;
  std::array<char, 160> text{};
};

/// Returns the session of a status_t, which may be of an earlier version, or nullopt if the bytes are not a
/// status_t.
std::optional<std::int64_t> read_status_session(std::span<const std::byte> bytes) noexcept;

/// Return true for 1 to 31 of A-Z a-z 0-9 _ . - ; in an array, NUL must fill the remaining bytes.
bool is_valid_sender(std::string_view sender) noexcept;
bool is_valid_sender(const std::array<char, kSenderSize>& sender) noexcept;

/// Returns the first reason to reject a command: kBadSlot to kUnreachableTorque in the order of the
/// enumeration, then kLeftOut. Writes to `text`, which may be an empty span, what was found and what is
/// allowed. Allocates nothing, and reads nothing outside the arrays, whatever values the command contains.
Reason check_command(const ForceCommand& command, const NameTable& table, std::span<char> text) noexcept;

/// Returns kBadControl if a control command is unknown or its count is out of range. The caller must check
/// the count of SHAPES against the number of elastic modes, and the count of SCENE against the number of
/// pages.
Reason check_control(const ControlCommand& command, std::span<char> text) noexcept;

/// Return true if sender and contents pass the checks. For values in memory that another process writes.
/// \param table the caller's own copy
bool is_sane(const ForceCommand& command, const NameTable& table) noexcept;
bool is_sane(const ControlCommand& command) noexcept;
/// Returns true if a rejection may be answered: its reason is in the enumeration, its sender is valid or
/// empty, and its text is printable.
bool is_sane(const Admission& admission) noexcept;

/// Decode a command and check everything that depends neither on the tick nor on earlier commands: layout,
/// session, sender and contents. kQueueFull means that memory for decoding ran out. A torque about the line
/// of a collinear group is rejected with kUnreachableTorque only in body axes. In world axes that component
/// of the torque is ignored at each tick. Session and sender are checked before the contents, so after a
/// reason beyond kBadSender the admission has the sender and the sequence of the command. If an envelope_t is
/// rejected with kNoKeys, the admission has the sender and the sequence of the command inside, if there is
/// one.
Admission decode_force(std::span<const std::byte> bytes, std::int64_t session, const NameTable& table,
                       ForceCommand& command) noexcept;
Admission decode_control(std::span<const std::byte> bytes, std::int64_t session,
                         ControlCommand& command) noexcept;

/// Converts a core command into a message, and keeps the bits of every double.
freeflex_msgs::force_t to_message(const ForceCommand& command, std::int64_t session, std::int64_t utime);
/// Converts a decoded message whose lengths are trusted, from a log. Gives the same reasons as decode_force.
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
