#include "service/io/wire/codec.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <exception>
#include <string_view>

#include "freeflex_msgs/control_t.hpp"
#include "messages/channels.hpp"
#include "service/io/wire/codec_wire.hpp"
#include "service/io/wire/decode.hpp"
#include "service/io/wire/versions.hpp"

namespace freeflex::io {
namespace {

void copy_sender(std::string_view from, std::array<char, kSenderSize>& to) {
  to.fill('\0');
  std::copy_n(from.data(), std::min(from.size(), index(kSenderSize - 1)), to.data());
}

/// Returns a sender in printable form: at most 40 characters, with '?' in place of characters that are not
/// printable.
std::array<char, 41> printable(std::string_view sender) {
  std::array<char, 41> shown{};
  std::transform(sender.begin(),
                 sender.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(sender.size(), 40)),
                 shown.begin(), [](char c) { return c >= ' ' && c <= '~' ? c : '?'; });
  return shown;
}

/// Copies sender and sequence into the admission, then checks session and sender.
/// \pre the admission has the reason and the text of the layout check
void check_head(std::span<const std::byte> bytes, std::int64_t session, Admission& admission) {
  // the first fields of a message of another type are unknown, but a command of an earlier version begins
  // with the same fields as a command of this version
  if (admission.reason == Reason::kWrongType && find_earlier(bytes) == nullptr) return;
  if (bytes.size() > index(channels::kMaxMessageBytes)) return;
  const std::optional<Head> head = read_head(bytes);
  if (!head) return;
  const bool is_sender_valid = is_valid_sender(head->sender);
  if (is_sender_valid) copy_sender(head->sender, admission.sender);
  admission.sequence = head->sequence;
  if (admission.reason == Reason::kMalformed || admission.reason == Reason::kWrongType) return;
  if (head->session != session) {
    admission.reason = Reason::kWrongSession;
    print(admission.text, "session is %lld, but must be %lld as in status_t.session of this daemon",
          static_cast<long long>(head->session), static_cast<long long>(session));
  } else if (!is_sender_valid) {
    admission.reason = Reason::kBadSender;
    print(admission.text, "sender \"%s\" has %zu characters, but must be 1 to %d of A-Z a-z 0-9 _ . -",
          printable(head->sender).data(), head->sender.size(), kSenderSize - 1);
  }
}

/// Refuses an envelope. Reads the body of the envelope only to find sender and sequence for the answer.
Admission refuse_envelope(std::span<const std::byte> bytes) {
  Admission admission;
  const std::optional<std::span<const std::byte>> body = find_body(bytes);
  if (!body) {
    admission.reason = Reason::kMalformed;
    print(admission.text, "the %zu bytes are not exactly one envelope_t; encode it anew", bytes.size());
    return admission;
  }
  admission.reason = Reason::kNoKeys;
  print(admission.text, "this daemon uses no keys; send the command without an envelope");
  const std::optional<Head> head = read_head(*body);
  if (!head || !is_valid_sender(head->sender)) return admission;
  copy_sender(head->sender, admission.sender);
  admission.sequence = head->sequence;
  return admission;
}

/// Rejects a command for lack of memory. The decoder throws for no other cause, because the lengths were
/// checked before.
Admission out_of_memory(Admission admission) {
  admission.reason = Reason::kQueueFull;
  print(admission.text, "there is no memory to decode the command; send it again");
  return admission;
}

}  // namespace

void fill_name_table(const Plan& plan, NameTable& table) {
  assert(plan.groups.size() <= index(kMaxGroups));
  table = NameTable{};
  table.num_points = static_cast<std::int32_t>(plan.points.size());
  table.num_wheels = static_cast<std::int32_t>(plan.wheels.size());
  for (std::size_t k = 0; k < plan.wheels.size(); ++k)
    table.wheel_points[k] = plan.particles.attitude_points[index(plan.wheels[k].attitude_index)];
  table.num_groups = static_cast<std::int32_t>(plan.groups.size());
  table.force_limit = plan.force_limit;
  table.torque_limit = plan.torque_limit;
  if (plan.fallback.empty()) table.scope = plan.scope;
  for (std::int32_t i = 0; i < table.num_points && table.num_pushable < kMaxTablePoints; ++i) {
    const PlanPoint& point = plan.points[index(i)];
    if (!point.pushable || point.row < 0) continue;
    const auto place = index(table.num_pushable++);
    table.pushable[place] = i;
    table.takes_torque[place] = attitude_index_of(plan, i) >= 0 ? 1 : 0;
    table.point_arms[place] = point.r;
  }
  for (std::size_t g = 0; g < plan.groups.size(); ++g) {
    const PlanGroup& group = plan.groups[g];
    const auto has_rows = [&plan](std::int32_t point) { return plan.points[index(point)].row >= 0; };
    table.groups[g].torque_rank = group.torque_rank;
    table.groups[g].line = group.line;
    table.group_arms[g] = group.centre;
    table.groups[g].is_pushable = std::all_of(group.points.begin(), group.points.end(), has_rows) ? 1 : 0;
  }
}

std::int64_t max_hold_ticks(const Plan& plan) {
  const double ticks = std::round(plan.command_limits.max_hold / plan.period);
  return static_cast<std::int64_t>(std::clamp(ticks, 1.0, static_cast<double>(kMaxDurationTicks)));
}

void limit_holds(const Plan& plan, NameTable& table) {
  table.max_hold = plan.command_limits.max_hold;
  table.max_hold_ticks = max_hold_ticks(plan);
}

Admission decode_force(std::span<const std::byte> bytes, std::int64_t session, const NameTable& table,
                       ForceCommand& command) noexcept {
  if (is_envelope(bytes)) return refuse_envelope(bytes);
  Admission admission;
  admission.reason = check_layout<freeflex_msgs::force_t>(bytes, admission.text);
  check_head(bytes, session, admission);
  if (admission.reason != Reason::kAccepted) return admission;
  try {
    freeflex_msgs::force_t message;
    if (decode_walked(bytes, message)) return from_message(message, table, command);
  } catch (const std::exception&) {
    return out_of_memory(admission);
  }
  admission.reason = Reason::kMalformed;
  print(admission.text, "the %zu bytes do not decode as force_t; encode it anew", bytes.size());
  return admission;
}

Admission decode_control(std::span<const std::byte> bytes, std::int64_t session,
                         ControlCommand& command) noexcept {
  if (is_envelope(bytes)) return refuse_envelope(bytes);
  Admission admission;
  admission.reason = check_layout<freeflex_msgs::control_t>(bytes, admission.text);
  check_head(bytes, session, admission);
  if (admission.reason != Reason::kAccepted) return admission;
  try {
    freeflex_msgs::control_t message;
    if (!decode_walked(bytes, message)) {
      admission.reason = Reason::kMalformed;
      print(admission.text, "the %zu bytes do not decode as control_t; encode it anew", bytes.size());
      return admission;
    }
    command = {admission.sender, message.sequence, message.command, message.count, {}};
    if (message.target.size() >= kSenderSize) {
      admission.reason = Reason::kBadControl;
      print(admission.text, "target has %zu characters, but may have at most %d", message.target.size(),
            kSenderSize - 1);
      return admission;
    }
    copy_sender(message.target, command.target);
    admission.reason = check_control(command, admission.text);
  } catch (const std::exception&) {
    return out_of_memory(admission);
  }
  return admission;
}

freeflex_msgs::force_t to_message(const ForceCommand& command, std::int64_t session, std::int64_t utime) {
  freeflex_msgs::force_t message{};
  message.utime = utime;
  message.session = session;
  message.sender = command.sender.data();
  message.sequence = command.sequence;
  message.slot = command.slot;
  message.axes = command.axes;
  message.start_tick = command.start_tick;
  message.late_policy = command.late_policy;
  message.duration_ticks = command.duration_ticks;
  message.lease_ticks = command.lease_ticks;
  message.num_forces = command.num_points;
  message.num_wrenches = command.num_wrenches;
  message.forces.resize(static_cast<std::size_t>(command.num_points));
  message.wrenches.resize(static_cast<std::size_t>(command.num_wrenches));
  for (std::size_t i = 0; i < message.forces.size(); ++i) {
    message.forces[i].point = command.points[i].point;
    std::copy_n(command.points[i].force.begin(), 3, message.forces[i].force);
  }
  for (std::size_t i = 0; i < message.wrenches.size(); ++i) {
    message.wrenches[i].group = command.wrenches[i].group;
    std::copy_n(command.wrenches[i].force.begin(), 3, message.wrenches[i].force);
    std::copy_n(command.wrenches[i].torque.begin(), 3, message.wrenches[i].torque);
  }
  message.num_torques = command.num_torques;
  message.torques.resize(static_cast<std::size_t>(command.num_torques));
  for (std::size_t i = 0; i < message.torques.size(); ++i) {
    message.torques[i].point = command.torques[i].point;
    std::copy_n(command.torques[i].torque.begin(), 3, message.torques[i].torque);
  }
  message.num_wheels = command.num_wheels;
  message.wheels.resize(static_cast<std::size_t>(command.num_wheels));
  for (std::size_t i = 0; i < message.wheels.size(); ++i) {
    message.wheels[i].wheel = command.wheels[i].wheel;
    message.wheels[i].torque = command.wheels[i].torque;
  }
  return message;
}

Admission from_message(const freeflex_msgs::force_t& message, const NameTable& table,
                       ForceCommand& command) noexcept {
  Admission admission;
  admission.sequence = message.sequence;
  if (!is_valid_sender(message.sender)) {
    admission.reason = Reason::kBadSender;
    print(admission.text, "sender \"%s\" has %zu characters, but must be 1 to %d of A-Z a-z 0-9 _ . -",
          printable(message.sender).data(), message.sender.size(), kSenderSize - 1);
    return admission;
  }
  copy_sender(message.sender, admission.sender);
  command = ForceCommand{};
  command.sender = admission.sender;
  command.sequence = message.sequence;
  command.slot = message.slot;
  command.axes = message.axes;
  command.start_tick = message.start_tick;
  command.late_policy = message.late_policy;
  command.duration_ticks = message.duration_ticks;
  command.lease_ticks = message.lease_ticks;
  command.num_points = message.num_forces;
  command.num_wrenches = message.num_wrenches;
  // entries beyond the size of an array are not copied; check_command rejects a command with so many
  const std::size_t num_points = std::min(message.forces.size(), command.points.size());
  const std::size_t num_wrenches = std::min(message.wrenches.size(), command.wrenches.size());
  for (std::size_t i = 0; i < num_points; ++i) {
    command.points[i].point = message.forces[i].point;
    std::copy_n(message.forces[i].force, 3, command.points[i].force.begin());
  }
  for (std::size_t i = 0; i < num_wrenches; ++i) {
    command.wrenches[i].group = message.wrenches[i].group;
    std::copy_n(message.wrenches[i].force, 3, command.wrenches[i].force.begin());
    std::copy_n(message.wrenches[i].torque, 3, command.wrenches[i].torque.begin());
  }
  command.num_torques = message.num_torques;
  const std::size_t num_torques = std::min(message.torques.size(), command.torques.size());
  for (std::size_t i = 0; i < num_torques; ++i) {
    command.torques[i].point = message.torques[i].point;
    std::copy_n(message.torques[i].torque, 3, command.torques[i].torque.begin());
  }
  command.num_wheels = message.num_wheels;
  const std::size_t num_wheels = std::min(message.wheels.size(), command.wheels.size());
  for (std::size_t i = 0; i < num_wheels; ++i)
    command.wheels[i] = {message.wheels[i].wheel, 0, message.wheels[i].torque};
  admission.reason = check_command(command, table, admission.text);
  return admission;
}

}  // namespace freeflex::io
