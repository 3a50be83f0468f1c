#include "tools/bus/push_command.hpp"

#include <CLI/App.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <string_view>
#include <utility>

#include "core/step/command.hpp"
#include "service/io/scene/text.hpp"
#include "service/io/wire/codec.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

using freeflex_msgs::control_t;
using freeflex_msgs::force_t;

constexpr double kDefaultDuration = 1.0;           // [s]
constexpr std::int64_t kMaxCount = 1'000'000'000;  // limit of the daemon

/// The argument of --point is NAME=X,Y,Z, or NAME alone for a point on which --force acts.
struct PointArgument {
  std::string name;
  std::optional<std::array<double, 3>> force;  // [N]
};

/// Parses the argument of --point. Returns nullopt if the text after = is not three numbers.
std::optional<PointArgument> parse_point(const std::string& text) {
  const auto named = parse_named_numbers(text, 3);
  if (!named) return std::nullopt;
  PointArgument point{named->name, std::nullopt};
  if (!named->numbers.empty()) point.force = {named->numbers[0], named->numbers[1], named->numbers[2]};
  return point;
}

/// Parses run, hold, reset, stop, scene, step=N, shapes=MODE or scene=PAGE. Returns nullopt for any other
/// text.
std::optional<control_t> parse_control(const std::string& text) {
  constexpr std::array<std::pair<std::string_view, std::int32_t>, 5> kUncounted{
      {{"run", control_t::RUN},
       {"hold", control_t::HOLD},
       {"reset", control_t::RESET},
       {"stop", control_t::STOP},
       {"scene", control_t::SCENE}}};
  constexpr std::array<std::pair<std::string_view, std::int32_t>, 3> kCounted{
      {{"step=", control_t::STEP}, {"shapes=", control_t::SHAPES}, {"scene=", control_t::SCENE}}};
  control_t control{};
  for (const auto& [name, command] : kUncounted) {
    control.command = command;
    if (text == name) return control;
  }
  for (const auto& [name, command] : kCounted) {
    if (!text.starts_with(name)) continue;
    const auto count = io::reader::parse_integer(std::string_view(text).substr(name.size()), 1, kMaxCount);
    if (!count) return std::nullopt;
    control.command = command;
    control.count = *count;
    return control;
  }
  return std::nullopt;
}

std::int64_t to_ticks(double seconds, double rate) {
  return std::max<std::int64_t>(1, std::llround(seconds * rate));
}

/// Returns the factor by which a force is scaled so that its impulse stays the same when the duration is
/// rounded to ticks. The factor is 1 if the duration is a whole number of ticks.
double impulse_factor(double seconds, double rate) {
  constexpr double kOnTick = 1e-6;
  const double wanted = seconds * rate, given = static_cast<double>(to_ticks(seconds, rate));
  return std::abs(wanted - given) <= kOnTick ? 1.0 : wanted / given;
}

/// Copies three components, or leaves `to` zero if none are given.
void copy_vector(const std::vector<double>& from, double (&to)[3]) {
  if (!from.empty()) std::copy_n(from.begin(), 3, to);
}

/// Prints an error for an unknown name, with the names in the scene.
void explain_unknown(const std::string& kind, const std::string& name, const SceneCatalogue& scene,
                     const std::vector<std::string>& known) {
  std::string text = "there is no " + kind + " '" + name + "' in scene '" + scene.head().name + "'" +
                     io::reader::did_you_mean(name, {known.begin(), known.end()}) + "; ";
  if (known.empty())
    text += kind == "point" ? "no point can be pushed" : "the scene has no " + kind;
  else
    text += (kind == "point" ? "points that can be pushed are " : kind + "s are ") + listed(known, 12);
  if (const std::size_t rest = scene.num_unlisted(); kind == "point" && rest > 0)
    text += "; " + std::to_string(rest) + " of " + std::to_string(scene.points().size()) +
            " points are not listed, because the scene does not name them; add those that you push to "
            "'commands: points' of the scene";
  if (kind == "point" && scene.find_group(name))
    text += "; there is a group of that name, so use --group " + name;
  if (kind == "group" && scene.find_point(name))
    text += "; there is a point of that name, so use --point " + name;
  print_error(text);
}

/// Adds the points to a command. Returns false if a name is unknown.
bool add_points(const PushOptions& options, const SceneCatalogue& scene, force_t& force) {
  for (const std::string& text : options.points) {
    const PointArgument argument = *parse_point(text);
    const std::optional<std::int32_t> index = scene.find_point(argument.name);
    if (!index) {
      std::vector<std::string> known;
      for (const auto& point : scene.points()) {
        if (point.is_pushable != 0) known.push_back(point.name);
      }
      return explain_unknown("point", argument.name, scene, known), false;
    }
    if (argument.force || !options.force.empty()) {
      freeflex_msgs::point_force_t item{};
      item.point = *index;
      copy_vector(options.force, item.force);
      if (argument.force) std::copy_n(argument.force->begin(), 3, item.force);
      force.forces.push_back(item);
    }
    if (!options.torque.empty()) {
      freeflex_msgs::point_torque_t item{};
      item.point = *index;
      copy_vector(options.torque, item.torque);
      force.torques.push_back(item);
    }
  }
  force.num_forces = static_cast<std::int32_t>(force.forces.size());
  force.num_torques = static_cast<std::int32_t>(force.torques.size());
  return true;
}

/// Adds the groups to a command. Returns false if a name is unknown.
bool add_groups(const PushOptions& options, const SceneCatalogue& scene, force_t& force) {
  for (const std::string& name : options.groups) {
    const std::optional<std::int32_t> index = scene.find_group(name);
    if (!index) {
      std::vector<std::string> known;
      for (const auto& group : scene.groups()) known.push_back(group.name);
      return explain_unknown("group", name, scene, known), false;
    }
    freeflex_msgs::wrench_t item{};
    item.group = *index;
    copy_vector(options.force, item.force);
    copy_vector(options.torque, item.torque);
    force.wrenches.push_back(item);
  }
  force.num_wrenches = static_cast<std::int32_t>(force.wrenches.size());
  return true;
}

/// Adds the wheels to a command. Returns false if a name is unknown.
bool add_wheels(const PushOptions& options, const SceneCatalogue& scene, force_t& force) {
  const auto& wheels = scene.head().wheels;
  for (const std::string& text : options.wheels) {
    const auto named = parse_named_numbers(text, 1);
    const auto found = std::find_if(wheels.begin(), wheels.end(),
                                    [&](const auto& wheel) { return wheel.name == named->name; });
    if (found == wheels.end()) {
      std::vector<std::string> known(wheels.size());
      std::transform(wheels.begin(), wheels.end(), known.begin(),
                     [](const auto& wheel) { return wheel.name; });
      return explain_unknown("wheel", named->name, scene, known), false;
    }
    freeflex_msgs::wheel_torque_t item{};
    item.wheel = static_cast<std::int32_t>(found - wheels.begin());
    item.torque = named->numbers[0];
    force.wheels.push_back(item);
  }
  force.num_wheels = static_cast<std::int32_t>(force.wheels.size());
  return true;
}

/// Returns the first option of the list that the user gave, or an empty text if there is none.
std::string first_given(const CLI::App& command, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (command.count(name) > 0) return name;
  }
  return {};
}

/// Returns an error if options contradict each other or have no effect. Otherwise returns an empty text.
std::string find_conflict(const CLI::App& command) {
  std::string other;
  if (command.count("--control") > 0) {
    other = first_given(command, {"--point", "--group", "--wheel", "--force", "--torque", "--axes",
                                  "--duration", "--lease", "--clear", "--slot", "--at-tick", "--late-ok"});
    if (!other.empty()) return "--control cannot be used with " + other;
  }
  if (command.count("--clear-sender") > 0) {
    other =
        first_given(command, {"--control", "--point", "--group", "--wheel", "--force", "--torque", "--axes",
                              "--duration", "--lease", "--clear", "--slot", "--at-tick", "--late-ok"});
    if (!other.empty()) return "--clear-sender cannot be used with " + other;
  }
  if (command.count("--clear") > 0) {
    other = first_given(
        command, {"--point", "--group", "--wheel", "--force", "--torque", "--axes", "--duration", "--lease"});
    if (!other.empty()) return "--clear cannot be used with " + other;
  }
  if (command.count("--axes") > 0 && first_given(command, {"--point", "--group"}).empty())
    return "--axes needs --point or --group, because the torque of a wheel's motor is about its own axis";
  if (command.count("--lease") > 0 && command.count("--duration") > 0)
    return "give --duration or --lease, not both";
  if (command.count("--key") > 0 && command.count("--sender") > 0)
    return "--key cannot be used with --sender, because the sender is the key's id";
  if (command.count("--key") > 0 && command.count("--socket") > 0)
    return "--key cannot be used with --socket, because the operator's socket needs no key";
  if (command.count("--socket") > 0 && command.count("--lcm-url") > 0)
    return "--socket cannot be used with --lcm-url, because the command is not sent over the bus";
  if (command.count("--late-ok") > 0 && command.count("--at-tick") == 0)
    return "--late-ok needs --at-tick, because without --at-tick a command takes effect at once";
  return {};
}

/// Returns the error in points, groups and the loads on them, or an empty text if there is none.
std::string find_force_fault(const PushOptions& options) {
  for (const std::string& text : options.wheels) {
    const auto named = parse_named_numbers(text, 1);
    if (!named || named->numbers.empty())
      return "--wheel '" + text + "' must be NAME=TORQUE with a number [N m]";
  }
  if (options.points.empty() && options.groups.empty() && !options.torque.empty())
    return "--torque has no effect, because a --wheel has its own =TORQUE; omit --torque";
  bool takes_force = !options.groups.empty();
  bool needs_force = !options.groups.empty() && options.torque.empty();
  for (const std::string& text : options.points) {
    const std::optional<PointArgument> point = parse_point(text);
    if (!point) return "--point '" + text + "' must be NAME or NAME=X,Y,Z with three numbers [N]";
    takes_force = takes_force || !point->force;
    needs_force = needs_force || (!point->force && options.torque.empty());
  }
  if (needs_force && options.force.empty())
    return "give --force X,Y,Z [N] or, for groups and bodies, --torque X,Y,Z [N m]";
  if (!takes_force && !options.force.empty())
    return "--force has no effect, because every --point has its own =X,Y,Z; omit one of the two";
  return {};
}

}  // namespace

std::string find_push_fault(const CLI::App& command, const PushOptions& options) {
  if (command.count("--prefix") > 0 && options.socket && !options.socket->empty())
    return "--socket PATH cannot be used with --prefix, because the socket already identifies the daemon";
  std::string conflict = find_conflict(command);
  if (!conflict.empty()) return conflict;
  const bool is_force =
      !options.points.empty() || !options.groups.empty() || !options.wheels.empty() || options.clear;
  if (!options.clear_sender.empty()) {
    if (options.clear_sender == "*" || io::is_valid_sender(options.clear_sender)) return {};
    return "--clear-sender '" + options.clear_sender +
           "' must be a sender (1 to 31 of A-Z a-z 0-9 _ . -), or '*' for every sender of the bus";
  }
  if (!is_force && options.control.empty())
    return "give --point, --group, --wheel or --clear, or else --control or --clear-sender";
  if (!options.control.empty()) {
    if (parse_control(options.control)) return {};
    return "--control '" + options.control +
           "' must be run, hold, reset, stop, scene, step=N, shapes=MODE or scene=PAGE, where N, MODE and "
           "PAGE are whole numbers from 1 to " +
           std::to_string(kMaxCount);
  }
  if (options.points.size() > std::size_t{kMaxCommandPoints} ||
      options.groups.size() > std::size_t{kMaxCommandWrenches})
    return std::to_string(options.points.size()) + " points and " + std::to_string(options.groups.size()) +
           " groups are given, but one command takes at most " + std::to_string(kMaxCommandPoints) + " and " +
           std::to_string(kMaxCommandWrenches) + "; send the others in another --slot";
  return options.clear ? std::string() : find_force_fault(options);
}

bool is_control(const PushOptions& options) {
  return !options.control.empty() || !options.clear_sender.empty();
}

control_t make_control(const PushOptions& options) {
  if (options.clear_sender.empty()) return *parse_control(options.control);
  control_t control{};
  control.command = control_t::CLEAR;
  control.target = options.clear_sender;
  return control;
}

/// Multiplies all loads of a push by the result of impulse_factor, so that the impulse over whole ticks is as
/// requested.
void keep_impulse(double factor, force_t& force) {
  const auto scale = [factor](auto& vector) {
    for (double& each : vector) each *= factor;
  };
  for (auto& each : force.forces) scale(each.force);
  for (auto& each : force.torques) scale(each.torque);
  for (auto& each : force.wrenches) scale(each.force), scale(each.torque);
  for (auto& each : force.wheels) each.torque *= factor;
}

std::optional<force_t> make_force(const PushOptions& options, const SceneCatalogue& scene) {
  force_t force{};
  force.slot = options.slot;
  force.axes = options.axes == "body" ? 1 : 0;
  force.start_tick = options.at_tick.value_or(-1);
  force.late_policy = options.late_ok ? 1 : 0;
  const double rate = scene.head().rate;
  if (options.lease) {
    force.lease_ticks = to_ticks(*options.lease, rate);
  } else if (!options.clear) {
    force.duration_ticks = to_ticks(options.duration.value_or(kDefaultDuration), rate);
  }
  if (!add_points(options, scene, force) || !add_groups(options, scene, force) ||
      !add_wheels(options, scene, force))
    return std::nullopt;
  if (force.duration_ticks > 0)
    if (const double factor = impulse_factor(options.duration.value_or(kDefaultDuration), rate);
        factor != 1.0)
      keep_impulse(factor, force);
  return force;
}

std::string rounded_duration(const PushOptions& options, double rate) {
  constexpr double kMuch = 0.01;  // [-] largest change, relative to the requested time, without a warning
  if (!options.duration && !options.lease) return {};
  const double asked = options.lease.value_or(options.duration.value_or(0.0));
  const std::int64_t ticks = to_ticks(asked, rate);
  const double lasts = static_cast<double>(ticks) / rate;
  if (std::abs(lasts - asked) <= kMuch * asked) return {};
  std::ostringstream text;
  text << (options.lease ? "--lease " : "--duration ") << asked << " s is " << asked * rate
       << " ticks, so it lasts " << ticks << (ticks == 1 ? " tick, " : " ticks, ") << lasts << " s; "
       << (options.lease ? "without a renewal it ends then" : "the force is scaled to keep the impulse");
  return text.str();
}

}  // namespace freeflex::tools
