// freeflex push: one command from the shell, acknowledged on screen.
#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "freeflex_msgs/control_t.hpp"
#include "freeflex_msgs/force_t.hpp"
#include "messages/channels.hpp"
#include "service/io/codec.hpp"
#include "service/io/reason.hpp"
#include "service/io/scene_text.hpp"
#include "tools/bus.hpp"
#include "tools/commands.hpp"
#include "tools/console.hpp"
#include "tools/usage.hpp"
#include "tools/wire_layout.hpp"

namespace freeflex::tools {
namespace {

using freeflex_msgs::control_t;
using freeflex_msgs::force_t;
using freeflex_msgs::status_t;

struct Options {
  BusOptions bus;
  std::vector<std::string> points;
  std::vector<std::string> groups;
  std::vector<double> force;   // [N] (3), or not given
  std::vector<double> torque;  // [N m] (3), or not given
  std::string axes = "world";
  std::optional<double> duration;  // [s]
  std::optional<double> lease;     // [s]
  bool clear = false;
  int slot = 0;
  std::optional<std::int64_t> at_tick;
  bool late_ok = false;
  std::string sender = "push";
  std::string control;
  double timeout = 3.0;  // [s]
  bool json = false;
};

/// What --point says: NAME, pushed by --force, or NAME=X,Y,Z.
struct PointArgument {
  std::string name;
  std::optional<std::array<double, 3>> force;  // [N]
};

/// nullopt when what stands behind = is not three numbers.
std::optional<PointArgument> parse_point(const std::string& text) {
  const std::size_t equals = text.find('=');
  PointArgument point{text.substr(0, equals), std::nullopt};
  if (equals == std::string::npos) return point;
  const char* next = text.data() + equals + 1;
  const char* end = text.data() + text.size();
  std::array<double, 3>& force = point.force.emplace();
  for (int k = 0; k < 3; ++k) {
    const auto parsed = std::from_chars(next, end, force[static_cast<std::size_t>(k)]);
    const bool is_followed_well = k < 2 ? parsed.ptr != end && *parsed.ptr == ',' : parsed.ptr == end;
    if (parsed.ec != std::errc() || !is_followed_well) return std::nullopt;
    next = parsed.ptr + 1;
  }
  return point;
}

struct Daemon {
  std::optional<status_t> status;
  SceneCatalogue scene;
};

/// run, hold, reset, stop, step=N, shapes=MODE.
std::optional<control_t> parse_control(const std::string& text) {
  constexpr std::array<std::pair<std::string_view, std::int32_t>, 4> kPlain{{{"run", control_t::RUN},
                                                                             {"hold", control_t::HOLD},
                                                                             {"reset", control_t::RESET},
                                                                             {"stop", control_t::STOP}}};
  constexpr std::array<std::pair<std::string_view, std::int32_t>, 2> kCounted{
      {{"step=", control_t::STEP}, {"shapes=", control_t::SHAPES}}};
  control_t control{};
  for (const auto& [name, command] : kPlain) {
    control.command = command;
    if (text == name) return control;
  }
  for (const auto& [name, command] : kCounted) {
    if (!text.starts_with(name)) continue;
    control.command = command;
    const char* end = text.data() + text.size();
    const auto parsed = std::from_chars(text.data() + name.size(), end, control.count);
    if (parsed.ec == std::errc() && parsed.ptr == end) return control;
  }
  return std::nullopt;
}

std::int64_t to_ticks(double seconds, double rate) {
  return std::max<std::int64_t>(1, std::llround(seconds * rate));
}

/// Three components, zero where they were not given.
void copy_vector(const std::vector<double>& from, double (&to)[3]) {
  if (!from.empty()) std::copy_n(from.begin(), 3, to);
}

/// Says which points, or groups, there are instead of one that there is not.
void explain_unknown(const std::string& kind, const std::string& name, const SceneCatalogue& scene,
                     const std::vector<std::string>& known) {
  std::string text = "no " + kind + " '" + name + "' in scene '" + scene.head().name + "'" +
                     io::reader::did_you_mean(name, {known.begin(), known.end()}) + "; ";
  text += kind == "point" ? "points that can be pushed: " : "groups: ";
  text += known.empty() ? "none" : listed(known, 12);
  if (kind == "point" && scene.find_group(name)) text += "; there is a group of that name: --group " + name;
  if (kind == "group" && scene.find_point(name)) text += "; there is a point of that name: --point " + name;
  print_error(text);
}

/// Names become indices, seconds become ticks. An unknown name is explained and gives nullopt.
std::optional<force_t> make_force(const Options& options, const SceneCatalogue& scene) {
  force_t force{};
  force.slot = options.slot;
  force.axes = options.axes == "body" ? 1 : 0;
  force.start_tick = options.at_tick.value_or(-1);
  force.late_policy = options.late_ok ? 1 : 0;
  const double rate = scene.head().rate;
  if (options.lease) {
    force.lease_ticks = to_ticks(*options.lease, rate);
  } else if (!options.clear) {
    force.duration_ticks = to_ticks(options.duration.value_or(1.0), rate);
  }
  for (const std::string& text : options.points) {
    const PointArgument argument = *parse_point(text);
    const std::string& name = argument.name;
    const std::optional<std::int32_t> index = scene.find_point(name);
    if (!index) {
      std::vector<std::string> known;
      for (const auto& point : scene.points()) {
        if (point.is_pushable != 0) known.push_back(point.name);
      }
      explain_unknown("point", name, scene, known);
      return std::nullopt;
    }
    freeflex_msgs::point_force_t item{};
    item.point = *index;
    copy_vector(options.force, item.force);
    if (argument.force) std::copy_n(argument.force->begin(), 3, item.force);
    force.forces.push_back(item);
  }
  for (const std::string& name : options.groups) {
    const std::optional<std::int32_t> index = scene.find_group(name);
    if (!index) {
      std::vector<std::string> known;
      for (const auto& group : scene.groups()) known.push_back(group.name);
      explain_unknown("group", name, scene, known);
      return std::nullopt;
    }
    freeflex_msgs::wrench_t item{};
    item.group = *index;
    copy_vector(options.force, item.force);
    copy_vector(options.torque, item.torque);
    force.wrenches.push_back(item);
  }
  force.num_forces = static_cast<std::int32_t>(force.forces.size());
  force.num_wrenches = static_cast<std::int32_t>(force.wrenches.size());
  return force;
}

template <class Message>
std::vector<std::byte> address(Message& message, const Options& options, std::int64_t session) {
  message.utime = wall_clock_us();
  message.session = session;
  message.sender = options.sender;
  // grows from one call of this program to the next
  message.sequence = message.utime;
  return io::encode(message);
}

/// The first of a list that was given, or nothing.
std::string first_given(const CLI::App& command, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (command.count(name) > 0) return name;
  }
  return {};
}

/// Options that say two things at once. Empty: none.
std::string find_conflict(const CLI::App& command) {
  std::string other;
  if (command.count("--control") > 0) {
    other = first_given(command, {"--point", "--group", "--force", "--torque", "--axes", "--duration",
                                  "--lease", "--clear", "--slot", "--at-tick", "--late-ok"});
    if (!other.empty()) return "--control goes without " + other;
  }
  if (command.count("--clear") > 0) {
    other = first_given(command, {"--point", "--group", "--force", "--torque", "--duration", "--lease"});
    if (!other.empty()) return "--clear goes without " + other;
  }
  if (command.count("--lease") > 0 && command.count("--duration") > 0)
    return "give --duration or --lease, not both";
  return {};
}

/// Faults in the options that need no daemon. Empty: none.
std::string find_fault(const Options& options) {
  const bool is_force = !options.points.empty() || !options.groups.empty() || options.clear;
  if (!is_force && options.control.empty()) return "give --point, --group or --clear, or else --control";
  if (!options.control.empty()) {
    if (!parse_control(options.control))
      return "--control '" + options.control + "': must be run, hold, reset, stop, step=N or shapes=MODE";
    return {};
  }
  if (options.clear) return {};
  if (!options.torque.empty() && options.groups.empty())
    return "--torque acts on a --group, not on a --point";
  bool needs_force = !options.groups.empty() && options.torque.empty();
  for (const std::string& text : options.points) {
    const std::optional<PointArgument> point = parse_point(text);
    if (!point) return "--point '" + text + "': must be NAME or NAME=X,Y,Z with three numbers [N]";
    needs_force = needs_force || !point->force;
  }
  if (needs_force && options.force.empty())
    return "give --force X,Y,Z [N], or for a group --torque X,Y,Z [N m]";
  return {};
}

int print_answer(const Options& options, const freeflex_msgs::ack_t& ack) {
  const bool is_accepted = ack.reason == 0;
  const bool is_known = ack.reason >= 0 && ack.reason < io::kNumReasons;
  const std::string reason = is_known ? io::reason_name(static_cast<io::Reason>(ack.reason))
                                      : "reason " + std::to_string(ack.reason);
  if (options.json) {
    print_json({{"accepted", is_accepted},
                {"tick", ack.tick},
                {"reason", reason},
                {"text", ack.text},
                {"sequence", ack.sequence},
                {"session", ack.session}});
  } else if (is_accepted) {
    std::printf("accepted: takes effect at tick %" PRId64 "\n", ack.tick);
  } else {
    std::printf("rejected at tick %" PRId64 ": %s: %s\n", ack.tick, reason.c_str(), ack.text.c_str());
  }
  return is_accepted ? kExitOk : kExitDiffers;
}

int explain_silence(const Bus& bus, const std::string& what) {
  if (is_interrupted()) return kExitInterrupted;
  print_error(what + " (" + bus.describe() +
              ")\nIs freeflexd running there? Same LCM_DEFAULT_URL, same network namespace, same --prefix?");
  return kExitDiffers;
}

int push(const CLI::App& command, const Options& options) {
  const std::string conflict = find_conflict(command);
  const std::string fault = conflict.empty() ? find_fault(options) : conflict;
  if (!fault.empty()) return print_error(fault), kExitUsage;
  Bus bus(options.bus);
  if (!bus.error().empty()) return print_error(bus.error()), bus.is_usage_error() ? kExitUsage : kExitDiffers;

  Daemon daemon;
  bus.subscribe(options.bus.prefix + channels::kStatus, [&](const BusMessage& message) {
    status_t status;
    if (decode_message(message.bytes, status)) daemon.status = status;
  });
  bus.subscribe(options.bus.prefix + channels::kScene, [&](const BusMessage& message) {
    freeflex_msgs::scene_t page;
    if (decode_message(message.bytes, page)) daemon.scene.take(page);
  });
  std::optional<freeflex_msgs::ack_t> answer;
  std::int64_t sequence = 0;
  bus.subscribe(options.bus.prefix + channels::kAck, [&](const BusMessage& message) {
    freeflex_msgs::ack_t ack;
    if (decode_message(message.bytes, ack) && ack.sender == options.sender && ack.sequence == sequence)
      answer = ack;
  });

  const auto timeout = std::chrono::milliseconds(static_cast<std::int64_t>(options.timeout * 1000.0));
  const bool needs_scene = options.control.empty();
  const auto is_found = [&] {
    return daemon.status && (!needs_scene || (daemon.scene.is_complete() &&
                                              daemon.scene.head().session == daemon.status->session));
  };
  if (!bus.wait(timeout, is_found)) {
    return explain_silence(
        bus, daemon.status ? "a daemon is there, but its scene did not come" : "no daemon heard");
  }

  bool is_sent = false;
  if (needs_scene) {
    std::optional<force_t> force = make_force(options, daemon.scene);
    if (!force) return kExitUsage;
    const std::vector<std::byte> bytes = address(*force, options, daemon.status->session);
    sequence = force->sequence;
    is_sent = bus.publish(options.bus.prefix + channels::kForce, bytes);
  } else {
    control_t control = *parse_control(options.control);
    const std::vector<std::byte> bytes = address(control, options, daemon.status->session);
    sequence = control.sequence;
    is_sent = bus.publish(options.bus.prefix + channels::kControl, bytes);
  }
  if (!is_sent) return print_error("the command could not be sent (" + bus.describe() + ")"), kExitDiffers;
  // sent once: an answer that is lost leaves it open whether the command was taken, and a second would act
  // twice
  if (!bus.wait(timeout, [&] { return answer.has_value(); }))
    return explain_silence(bus, "sent, but no answer came");
  return print_answer(options, *answer);
}

}  // namespace

void add_push(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("push", "one command to a running daemon, acknowledged on screen");
  command
      ->add_option("--point", options->points,
                   "point to push, by --force or by its own =X,Y,Z [N]; may be repeated")
      ->type_name("NAME[=X,Y,Z]")
      ->allow_extra_args(false);
  command->add_option("--group", options->groups, "group to push and turn; may be repeated")
      ->type_name("NAME")
      ->allow_extra_args(false);
  command->add_option("--force", options->force, "force [N]")
      ->type_name("X,Y,Z")
      ->delimiter(',')
      ->expected(3);
  command->add_option("--torque", options->torque, "torque [N m], groups only")
      ->type_name("X,Y,Z")
      ->delimiter(',')
      ->expected(3);
  command->add_option("--axes", options->axes, "axes of force and torque")
      ->check(CLI::IsMember({"world", "body"}))
      ->type_name("AXES")
      ->capture_default_str();
  command->add_option("--duration", options->duration, "how long it acts [s], default 1")
      ->check(positive_time())
      ->type_name("S");
  command
      ->add_option("--lease", options->lease,
                   "instead of --duration: ends after so long [s] unless renewed by the same sender and slot")
      ->check(positive_time())
      ->type_name("S");
  command->add_flag("--clear", options->clear, "empty the slot: ends what acts there");
  command->add_option("--slot", options->slot, "0 to 63: replaces what this sender has there")
      ->type_name("N")
      ->capture_default_str();
  command->add_option("--at-tick", options->at_tick, "take effect at this tick, default at once")
      ->type_name("TICK");
  command->add_flag("--late-ok", options->late_ok,
                    "when --at-tick has passed: at once instead of a rejection");
  command
      ->add_option("--control", options->control,
                   "instead of a force: run, hold, reset, stop, step=N [ticks] or shapes=MODE")
      ->type_name("COMMAND");
  command->add_option("--sender", options->sender, "who pushes: 1 to 31 of A-Z a-z 0-9 _ . -")
      ->check([](const std::string& name) {
        return io::is_valid_sender(name) ? std::string()
                                         : "found '" + name + "', must be 1 to 31 of A-Z a-z 0-9 _ . -";
      })
      ->type_name("NAME")
      ->capture_default_str();
  command->add_option("--timeout", options->timeout, "how long to wait for the daemon and for its answer [s]")
      ->check(positive_time())
      ->type_name("S")
      ->capture_default_str();
  add_bus_options(*command, options->bus);
  command->add_flag("--json", options->json, "one JSON object on standard output");
  command->footer(
      "Examples:\n  freeflex push --point tip --force 0,0,1 --duration 0.1\n"
      "  freeflex push --point tip=0,0,1 --point hub=0,0,-1      (both in one command)\n"
      "  freeflex push --group hub --torque 0,0,5 --axes body --lease 2 --slot 3\n"
      "  freeflex push --control step=100\n"
      "The command is sent once. Exit codes: 0 accepted, 1 rejected or not answered, 2 wrong arguments or "
      "names.");
  command->callback([options, command, &exit_code] { exit_code = push(*command, *options); });
}

}  // namespace freeflex::tools
