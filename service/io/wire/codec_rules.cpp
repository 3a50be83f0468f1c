// Rules for commands that do not depend on the encoded bytes or on the tick.
#include <algorithm>
#include <bitset>
#include <cmath>
#include <optional>
#include <string_view>

#include "core/step/scope.hpp"
#include "freeflex_msgs/control_t.hpp"
#include "service/io/wire/codec.hpp"
#include "service/io/wire/codec_wire.hpp"
#include "service/io/wire/operator_address.hpp"

namespace freeflex::io {
namespace {

using Text = std::span<char>;

constexpr std::int64_t kMaxControlCount =
    1'000'000'000;  // limit for STEP; far above any number of modes or pages

bool is_finite(const Vec3& v) { return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]); }
bool is_zero(const Vec3& v) { return v[0] == 0.0 && v[1] == 0.0 && v[2] == 0.0; }

/// Returns true if |v| exceeds the limit. The computation cannot overflow.  \param limit > 0, or 0: no limit
bool is_over(const Vec3& v, double limit) {
  // allows for the rounding errors of three squares and their sum, so that a vector whose norm equals the
  // limit is accepted
  constexpr double kRounding = 1.0 + 8.0 * 2.220446049250313e-16;
  if (limit <= 0.0) return false;
  double square = 0.0;
  for (const double component : v) {
    const double part = component / limit;
    if (std::fabs(part) > 1.0) return true;
    square += part * part;
  }
  return square > kRounding;
}

/// Writes that a vector exceeds its limit, with enough digits to distinguish the norm from the limit.
void print_over_limit(Text text, const char* list, int i, const char* kind, int number, const char* name,
                      const Vec3& v, double limit, const char* unit) {
  constexpr int kUsual = 10, kAll = 17;
  const double length = std::hypot(v[0], v[1], v[2]);
  const int digits = length < limit * (1.0 + 1e-9) ? kAll : kUsual;
  print(text, "%s[%d]: %s %d has |%s| %.*g %s, but the scene allows at most %.*g %s", list, i, kind, number,
        name, digits, length, unit, digits, limit, unit);
}

/// Returns true if forces on the group's points cannot produce the torque: a torque about the line of a
/// collinear group in body axes, or any torque on a single point.
bool is_unreachable(const NameTable::GroupTraits& traits, const Vec3& torque, std::int32_t axes) {
  // by rounding in the sender's computation, a torque that is meant to be normal to the line may have a small
  // component along the line
  constexpr double kAlong = 1e-9;
  if (traits.torque_rank == 0) return !is_zero(torque);
  if (traits.torque_rank == 3 || axes != 1) return false;
  const double largest = std::max({std::fabs(torque[0]), std::fabs(torque[1]), std::fabs(torque[2])});
  if (largest == 0.0) return false;
  double along = 0.0;
  for (std::size_t i = 0; i < 3; ++i) along += torque[i] / largest * traits.line[i];
  return std::fabs(along) > kAlong;
}

Reason check_header(const ForceCommand& command, const NameTable& table, Text text) {
  if (command.slot < 0 || command.slot > kMaxSlotNumber) {
    print(text, "slot is %d, but must be 0 to %d", command.slot, kMaxSlotNumber);
    return Reason::kBadSlot;
  }
  if (command.axes != 0 && command.axes != 1) {
    print(text, "axes is %d, but must be 0 (world) or 1 (body)", command.axes);
    return Reason::kBadAxes;
  }
  if (command.start_tick < -1) {
    print(text, "start_tick is %lld, but must be -1 (at once) or a tick",
          static_cast<long long>(command.start_tick));
    return Reason::kBadTiming;
  }
  if (command.late_policy != 0 && command.late_policy != 1) {
    print(text, "late_policy is %d, but must be 0 (reject) or 1 (apply at the next tick)",
          command.late_policy);
    return Reason::kBadTiming;
  }
  const auto in_range = [](std::int64_t ticks) { return ticks >= 0 && ticks <= kMaxDurationTicks; };
  const int num_ends = (command.duration_ticks != 0) + (command.lease_ticks != 0);
  if (!in_range(command.duration_ticks) || !in_range(command.lease_ticks) || num_ends > 1 ||
      (num_ends == 0 && !is_clearing(command))) {
    print(text, "duration_ticks is %lld and lease_ticks is %lld, but one must be 0 and the other 1 to %lld",
          static_cast<long long>(command.duration_ticks), static_cast<long long>(command.lease_ticks),
          static_cast<long long>(kMaxDurationTicks));
    return Reason::kBadTiming;
  }
  const std::int64_t held = std::max(command.duration_ticks, command.lease_ticks);
  if (table.max_hold_ticks > 0 && held > table.max_hold_ticks) {
    print(text,
          "%s_ticks is %lld, but may be at most %lld from the bus (%g s, 'commands: max_hold' of the scene); "
          "%s",
          command.lease_ticks > 0 ? "lease" : "duration", static_cast<long long>(held),
          static_cast<long long>(table.max_hold_ticks), table.max_hold,
          command.lease_ticks > 0 ? "renew it more often" : "send it again before it ends");
    return Reason::kHeldTooLong;
  }
  const auto exceeds = [text](std::int32_t count, const char* name, std::int32_t most) {
    if (count >= 0 && count <= most) return false;
    print(text, "there are %d %s, but at most %d are allowed", count, name, most);
    return true;
  };
  if (exceeds(command.num_points, "forces", kMaxCommandPoints) ||
      exceeds(command.num_wrenches, "wrenches", kMaxCommandWrenches) ||
      exceeds(command.num_torques, "torques", kMaxCommandTorques) ||
      exceeds(command.num_wheels, "wheels", kMaxWheels))
    return Reason::kTooManyPoints;
  return Reason::kAccepted;
}

/// Returns the position of a point in the list of pushable points, or nullopt if the point is not pushable.
/// The position is a valid index, whatever values the table contains.
std::optional<std::size_t> find_pushable(const NameTable& table, std::int32_t point) {
  const auto end = table.pushable.begin() + std::clamp(table.num_pushable, 0, kMaxTablePoints);
  const auto found = std::lower_bound(table.pushable.begin(), end, point);
  if (found == end || *found != point) return std::nullopt;
  return index(found - table.pushable.begin());
}

Reason check_points(const ForceCommand& command, const NameTable& table, Text text) {
  std::bitset<kMaxTablePoints> seen;
  for (int i = 0; i < command.num_points; ++i) {
    const PointForce& entry = command.points[index(i)];
    if (entry.point < 0 || entry.point >= table.num_points) {
      print(text, "forces[%d]: point %d does not exist; the scene has points 0 to %d", i, entry.point,
            table.num_points - 1);
      return Reason::kUnknownPoint;
    }
    const std::optional<std::size_t> place = find_pushable(table, entry.point);
    if (!place) {
      print(text, "forces[%d]: point %d may not be pushed; add it to 'commands: points' of the scene", i,
            entry.point);
      return Reason::kNotPushable;
    }
    if (seen.test(*place)) {
      print(text, "forces[%d]: point %d is listed twice, but must be listed once", i, entry.point);
      return Reason::kDuplicatePoint;
    }
    seen.set(*place);
    if (!is_finite(entry.force)) {
      print(text, "forces[%d]: point %d has the force (%g, %g, %g) N, which must be finite", i, entry.point,
            entry.force[0], entry.force[1], entry.force[2]);
      return Reason::kNotFinite;
    }
    if (is_over(entry.force, table.force_limit)) {
      print_over_limit(text, "forces", i, "point", entry.point, "force", entry.force, table.force_limit, "N");
      return Reason::kOverLimit;
    }
  }
  return Reason::kAccepted;
}

Reason check_torques(const ForceCommand& command, const NameTable& table, Text text) {
  std::bitset<kMaxTablePoints> seen;
  for (int i = 0; i < command.num_torques; ++i) {
    const PointTorque& entry = command.torques[index(i)];
    if (entry.point < 0 || entry.point >= table.num_points) {
      print(text, "torques[%d]: point %d does not exist; the scene has points 0 to %d", i, entry.point,
            table.num_points - 1);
      return Reason::kUnknownPoint;
    }
    const std::optional<std::size_t> place = find_pushable(table, entry.point);
    if (place && table.takes_torque[*place] == 0) {
      print(text, "torques[%d]: point %d has no inertia and takes no torque; use a wrench on a group", i,
            entry.point);
      return Reason::kPointTorque;
    }
    if (!place) {
      print(text, "torques[%d]: point %d may not be pushed; add it to 'commands: points' of the scene", i,
            entry.point);
      return Reason::kNotPushable;
    }
    if (seen.test(*place)) {
      print(text, "torques[%d]: point %d is listed twice, but must be listed once", i, entry.point);
      return Reason::kDuplicatePoint;
    }
    seen.set(*place);
    if (!is_finite(entry.torque)) {
      print(text, "torques[%d]: point %d has the torque (%g, %g, %g) N m, which must be finite", i,
            entry.point, entry.torque[0], entry.torque[1], entry.torque[2]);
      return Reason::kNotFinite;
    }
    if (is_over(entry.torque, table.torque_limit)) {
      print_over_limit(text, "torques", i, "point", entry.point, "torque", entry.torque, table.torque_limit,
                       "N m");
      return Reason::kOverLimit;
    }
  }
  return Reason::kAccepted;
}

Reason check_wheels(const ForceCommand& command, const NameTable& table, Text text) {
  std::bitset<kMaxWheels> seen;
  const int known = std::clamp(table.num_wheels, 0, kMaxWheels);
  for (int i = 0; i < command.num_wheels; ++i) {
    const WheelTorque& entry = command.wheels[index(i)];
    if (entry.wheel < 0 || entry.wheel >= known) {
      print(text, "wheels[%d]: wheel %d does not exist; the scene has %d wheels, numbered from 0", i,
            entry.wheel, known);
      return Reason::kUnknownPoint;
    }
    const auto wheel = index(entry.wheel);
    if (!find_pushable(table, table.wheel_points[wheel])) {
      print(text,
            "wheels[%d]: wheel %d is in point %d, which may not be pushed; add it to 'commands: points'", i,
            entry.wheel, table.wheel_points[wheel]);
      return Reason::kNotPushable;
    }
    if (seen.test(wheel)) {
      print(text, "wheels[%d]: wheel %d is listed twice, but must be listed once", i, entry.wheel);
      return Reason::kDuplicatePoint;
    }
    seen.set(wheel);
    if (!std::isfinite(entry.torque)) {
      print(text, "wheels[%d]: wheel %d has the torque %g N m, which must be finite", i, entry.wheel,
            entry.torque);
      return Reason::kNotFinite;
    }
    if (table.torque_limit > 0.0 && std::abs(entry.torque) > table.torque_limit) {
      print(text, "wheels[%d]: wheel %d has the torque %g N m, but the scene allows at most %g N m", i,
            entry.wheel, entry.torque, table.torque_limit);
      return Reason::kOverLimit;
    }
  }
  return Reason::kAccepted;
}

Reason check_wrench_values(const Wrench& entry, int i, const NameTable& table, Text text) {
  if (!is_finite(entry.force) || !is_finite(entry.torque)) {
    print(text, "wrenches[%d]: group %d: force (%g, %g, %g) N and torque (%g, %g, %g) N m must be finite", i,
          entry.group, entry.force[0], entry.force[1], entry.force[2], entry.torque[0], entry.torque[1],
          entry.torque[2]);
    return Reason::kNotFinite;
  }
  if (is_over(entry.force, table.force_limit)) {
    print_over_limit(text, "wrenches", i, "group", entry.group, "force", entry.force, table.force_limit, "N");
    return Reason::kOverLimit;
  }
  if (is_over(entry.torque, table.torque_limit)) {
    print_over_limit(text, "wrenches", i, "group", entry.group, "torque", entry.torque, table.torque_limit,
                     "N m");
    return Reason::kOverLimit;
  }
  return Reason::kAccepted;
}

Reason check_wrenches(const ForceCommand& command, const NameTable& table, Text text) {
  std::bitset<kMaxGroups> seen;
  const int known = std::clamp(table.num_groups, 0, kMaxGroups);
  for (int i = 0; i < command.num_wrenches; ++i) {
    const Wrench& entry = command.wrenches[index(i)];
    if (entry.group < 0 || entry.group >= known) {
      print(text, "wrenches[%d]: group %d does not exist; the scene has %d groups, numbered from 0", i,
            entry.group, known);
      return Reason::kUnknownGroup;
    }
    const auto group = index(entry.group);
    const NameTable::GroupTraits& traits = table.groups[group];
    if (traits.is_pushable == 0) {
      print(text,
            "wrenches[%d]: group %d may not be pushed, because the plan lacks the mode shapes at some of its "
            "points",
            i, entry.group);
      return Reason::kNotPushable;
    }
    if (seen.test(group)) {
      print(text, "wrenches[%d]: group %d is listed twice, but must be listed once", i, entry.group);
      return Reason::kDuplicatePoint;
    }
    seen.set(group);
    const Reason values = check_wrench_values(entry, i, table, text);
    if (values != Reason::kAccepted) return values;
    if (is_unreachable(traits, entry.torque, command.axes)) {
      print(text, "wrenches[%d]: group %d cannot take the torque (%g, %g, %g) N m; %s", i, entry.group,
            entry.torque[0], entry.torque[1], entry.torque[2],
            traits.torque_rank == 0 ? "it is a single point"
                                    : "its points lie on a line, about which the torque must be 0");
      return Reason::kUnreachableTorque;
    }
  }
  return Reason::kAccepted;
}

/// Checks that the command needs no feature that the plan omits.
/// \pre every index of the command is in the table
Reason check_scope(const ForceCommand& command, const NameTable& table, Text text) {
  const auto arm_of_point = [&](std::int32_t point) {
    return table.point_arms[find_pushable(table, point).value_or(0)];
  };
  const auto arm_of_group = [&](std::int32_t group) { return table.group_arms[index(group)]; };
  switch (find_need(table.scope, command, arm_of_point, arm_of_group)) {
    case Need::kNone:
      return Reason::kAccepted;
    case Need::kRotation:
      print(text,
            "the forces have a moment about the centre of mass, but the plan omits rotation; keep rotation "
            "or set on_need: replan in leave_out of the scene");
      break;
    case Need::kOutOfPlane:
      print(text,
            "a load leaves the plane (normal %g, %g, %g in body axes), but the plan omits out_of_plane; "
            "keep it or set on_need: replan in leave_out",
            table.scope.normal_B[0], table.scope.normal_B[1], table.scope.normal_B[2]);
      break;
  }
  return Reason::kLeftOut;
}

}  // namespace

bool is_valid_sender(std::string_view sender) noexcept {
  const auto is_allowed = [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '.' || c == '-';
  };
  return !sender.empty() && sender.size() < kSenderSize &&
         std::all_of(sender.begin(), sender.end(), is_allowed);
}

bool is_valid_sender(const std::array<char, kSenderSize>& sender) noexcept {
  const auto end = std::find(sender.begin(), sender.end(), '\0');
  return std::all_of(end, sender.end(), [](char c) { return c == '\0'; }) &&
         is_valid_sender(std::string_view(sender.data(), index(end - sender.begin())));
}

Reason check_command(const ForceCommand& command, const NameTable& table, std::span<char> text) noexcept {
  const Reason header = check_header(command, table, text);
  if (header != Reason::kAccepted) return header;
  const Reason points = check_points(command, table, text);
  if (points != Reason::kAccepted) return points;
  const Reason torques = check_torques(command, table, text);
  if (torques != Reason::kAccepted) return torques;
  const Reason wheels = check_wheels(command, table, text);
  if (wheels != Reason::kAccepted) return wheels;
  const Reason wrenches = check_wrenches(command, table, text);
  return wrenches != Reason::kAccepted ? wrenches : check_scope(command, table, text);
}

Reason check_control(const ControlCommand& command, std::span<char> text) noexcept {
  using Control = freeflex_msgs::control_t;
  std::int64_t least = 0;
  std::int64_t most = 0;
  if (command.command == Control::STEP || command.command == Control::SHAPES) {
    least = 1;
    most = kMaxControlCount;
  } else if (command.command == Control::SCENE) {
    most = kMaxControlCount;
  } else if (command.command < Control::RUN || command.command > Control::CLEAR) {
    print(text,
          "command is %d, but must be 1 run, 2 hold, 3 step, 4 reset, 5 stop, 6 shapes, 7 scene or 8 clear",
          command.command);
    return Reason::kBadControl;
  }
  if (command.command == Control::CLEAR) {
    if (command.target != service::kEverySender && !is_valid_sender(command.target)) {
      print(text,
            "command 8 (clear) needs a target, the name of a sender or \"*\" for every sender of the bus");
      return Reason::kBadControl;
    }
  } else if (command.target != std::array<char, kSenderSize>{}) {
    print(text, "command %d has a target, but only command 8 (clear) may have one", command.command);
    return Reason::kBadControl;
  }
  if (command.count < least || command.count > most) {
    print(text, "command %d has count %lld, which must be %lld to %lld", command.command,
          static_cast<long long>(command.count), static_cast<long long>(least), static_cast<long long>(most));
    return Reason::kBadControl;
  }
  return Reason::kAccepted;
}

bool is_sane(const ForceCommand& command, const NameTable& table) noexcept {
  return is_valid_sender(command.sender) && check_command(command, table, {}) == Reason::kAccepted;
}

bool is_sane(const ControlCommand& command) noexcept {
  return is_valid_sender(command.sender) && check_control(command, {}) == Reason::kAccepted;
}

bool is_sane(const Admission& admission) noexcept {
  const auto reason = static_cast<std::int32_t>(admission.reason);
  if (reason <= 0 || reason >= kNumReasons) return false;
  if (admission.sender[0] != '\0' && !is_valid_sender(admission.sender)) return false;
  const auto end = std::find(admission.text.begin(), admission.text.end(), '\0');
  return end != admission.text.end() &&
         std::all_of(admission.text.begin(), end, [](char c) { return c >= ' ' && c <= '~'; });
}

}  // namespace freeflex::io
