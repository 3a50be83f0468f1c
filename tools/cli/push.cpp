// freeflex push sends one command and prints the acknowledgement.
#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <chrono>
#include <cinttypes>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/step/command.hpp"
#include "messages/channels.hpp"
#include "service/io/wire/codec.hpp"
#include "service/io/wire/decode.hpp"
#include "service/io/wire/operator_address.hpp"
#include "service/io/wire/reason.hpp"
#include "service/io/wire/versions.hpp"
#include "service/keys.hpp"
#include "tools/bus/bus.hpp"
#include "tools/bus/operator_link.hpp"
#include "tools/bus/push_command.hpp"
#include "tools/bus/push_words.hpp"
#include "tools/cli/commands.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

using freeflex_msgs::control_t;
using freeflex_msgs::force_t;
using freeflex_msgs::status_t;

constexpr const char* kPushFooter = R"(Examples:
  freeflex push --point tip --force 0,0,1 --duration 0.1
  freeflex push --point tip=0,0,1 --point hub=0,0,-1      (both in one command)
  freeflex push --group hub --torque 0,0,5 --axes body --lease 2 --slot 3
  freeflex push --control step=100
  freeflex push --control stop --key operator.key         (to a daemon that was started with --keys)
  freeflex push --socket --control stop                   (as the daemon's user, even if the bus is flooded)
  freeflex push --socket --clear-sender guidance          (ends the pushes of that sender)
JSON fields:
  accepted     true or false;  tick: at which it takes effect, or was rejected
  reason       accepted, or a name of messages/README.md, section 6;  text: the reason as a sentence
  sequence, session
               of the command and of the daemon that answered
The command is sent once.
Exit codes: 0 accepted, 1 rejected or not answered, 2 wrong arguments or names.)";

/// What is known about the daemon, and the daemon's answer to the command.
struct Exchange {
  std::optional<std::int64_t> session;
  std::string unread;  // reason why the last STATUS could not be read
  SceneCatalogue scene;
  std::optional<SealingKey> key;  // from --key
  std::int64_t sequence = 0;      // of the command
  std::int64_t sent_to = 0;       // session in the command
  std::optional<freeflex_msgs::ack_t> answer;
  // the answer is from another session, which belongs to a restarted daemon or to a second daemon on the
  // prefix
  std::optional<freeflex_msgs::ack_t> answer_of_other;
};

/// A connection to a daemon, over the bus or over the operator's socket.
struct Line {
  std::function<bool(std::chrono::milliseconds, const std::function<bool()>&)> wait;
  std::function<bool(const char* suffix, std::span<const std::byte>)> publish;
  std::string description;
  std::string advice;  // advice for the user if nobody answers
};

/// Fills in time, session, sender and sequence. Returns the message as bytes, which are sealed if there is a
/// key.
template <class Message>
std::vector<std::byte> address(Message& message, const PushOptions& options,
                               const std::optional<SealingKey>& key, const std::string& channel,
                               std::int64_t session) {
  constexpr std::int64_t kValidity =
      10'000'000;  // [us] time for the transfer to the daemon, and for a small clock error
  message.utime = wall_clock_us();
  message.session = session;
  message.sender = options.sender;
  // the sequence must increase from one call of this program to the next, as the time of the clock does
  message.sequence = message.utime;
  return key ? seal(message, channel, *key, message.utime + kValidity) : io::encode(message);
}

/// Reads the key of --key, whose id becomes the sender. If the key cannot be read, prints the errors and
/// returns false.
bool read_key(PushOptions& options, std::optional<SealingKey>& key) {
  if (options.key.empty()) return true;
  const service::KeysResult result = service::load_key(options.key);
  if (!result.faults.empty()) return std::fprintf(stderr, "%s\n", result.faults.c_str()), false;
  key = result.keys.front().sealing;
  options.sender = key->id;
  return true;
}

/// Returns the name of a point, group or wheel with this index in the scene, or an empty text if it is not
/// listed.
std::string name_in(const SceneCatalogue& scene, std::string_view kind, std::int64_t index) {
  const auto name_at = [index](const auto& items) {
    const auto at = static_cast<std::size_t>(index);
    return at < items.size() ? items[at].name : std::string{};
  };
  if (!scene.is_complete()) return {};
  if (kind == "point") return name_at(scene.points());
  return kind == "group" ? name_at(scene.groups()) : name_at(scene.head().wheels);
}

int print_answer(const PushOptions& options, const freeflex_msgs::ack_t& ack, const SceneCatalogue& scene) {
  const auto name_of = [&scene](std::string_view kind, std::int64_t index) {
    return name_in(scene, kind, index);
  };
  const std::string text = printable(in_push_words(ack.text, name_of));
  const bool is_accepted = ack.reason == 0;
  const bool is_known = ack.reason >= 0 && ack.reason < io::kNumReasons;
  const std::string reason = is_known ? io::reason_name(static_cast<io::Reason>(ack.reason))
                                      : "reason " + std::to_string(ack.reason);
  if (options.json) {
    print_json({{"accepted", is_accepted},
                {"tick", ack.tick},
                {"reason", reason},
                {"text", text},
                {"sequence", ack.sequence},
                {"session", ack.session}});
  } else if (is_accepted) {
    // The scene is named only for a socket, which may belong to any daemon of the user. On the bus, the
    // prefix identifies one daemon
    const std::string who = options.socket && scene.is_complete()
                                ? " by the daemon of scene '" + printable(scene.head().name) + "'"
                                : "";
    std::printf("accepted%s: takes effect at tick %" PRId64 "\n", who.c_str(), ack.tick);
  } else {
    std::printf("rejected at tick %" PRId64 " (%s): %s\n", ack.tick, reason.c_str(), text.c_str());
  }
  return is_accepted ? kExitOk : kExitDiffers;
}

int explain_silence(const Line& line, const std::string& what, bool has_key = false) {
  if (is_interrupted()) return kExitInterrupted;
  constexpr const char* kOfKey =
      "\nDo the daemon's --keys contain this key, with this secret? The daemon's log lists refused keys.";
  print_error(what + " (" + line.description + ")\n" + line.advice + (has_key ? kOfKey : ""));
  return kExitDiffers;
}

/// Waits for the daemon, sends the command once and waits for its answer.
int push_over(const Line& line, const PushOptions& options, Exchange& known) {
  const auto timeout = std::chrono::milliseconds(static_cast<std::int64_t>(options.timeout * 1000.0));
  const bool needs_scene = !is_control(options);
  const auto is_found = [&] {
    return known.session &&
           (!needs_scene || (known.scene.is_complete() && known.scene.head().session == *known.session));
  };
  if (!line.wait(timeout, is_found)) {
    const std::string unread = known.unread.empty()
                                   ? "no message of a daemon has come"
                                   : "a daemon is running, but its STATUS is " + known.unread;
    return explain_silence(line, known.session ? "a daemon is there, but its scene did not arrive" : unread);
  }
  bool is_sent = false;
  known.sent_to = *known.session;
  if (needs_scene) {
    std::optional<force_t> force = make_force(options, known.scene);
    if (!force) return kExitUsage;
    if (const std::string rounded = rounded_duration(options, known.scene.head().rate); !rounded.empty())
      print_warning(rounded);
    const std::string channel = options.bus.prefix + channels::kForce;
    const std::vector<std::byte> bytes = address(*force, options, known.key, channel, *known.session);
    known.sequence = force->sequence;
    is_sent = line.publish(channels::kForce, bytes);
  } else {
    control_t control = make_control(options);
    const std::string channel = options.bus.prefix + channels::kControl;
    const std::vector<std::byte> bytes = address(control, options, known.key, channel, *known.session);
    known.sequence = control.sequence;
    is_sent = line.publish(channels::kControl, bytes);
  }
  if (!is_sent)
    return print_error("the command could not be sent (" + line.description + "); check the network"),
           kExitDiffers;
  // the command is sent only once, because the daemon may have accepted the command even if no answer comes,
  // and a second command would act again
  if (!line.wait(timeout, [&] { return known.answer.has_value(); }) && known.answer_of_other)
    return print_answer(options, *known.answer_of_other, known.scene);
  if (!known.answer)
    return explain_silence(line, "the command was sent, but no answer came", known.key.has_value());
  return print_answer(options, *known.answer, known.scene);
}

void take_answer(std::span<const std::byte> bytes, const PushOptions& options, Exchange& known) {
  freeflex_msgs::ack_t ack;
  if (!io::decode_message(bytes, ack) || ack.sender != options.sender || ack.sequence != known.sequence)
    return;
  (ack.session == known.sent_to ? known.answer : known.answer_of_other) = ack;
}

int push_over_bus(PushOptions options) {
  Exchange known;
  if (!read_key(options, known.key)) return kExitUsage;
  Bus bus(options.bus);
  if (!bus.error().empty()) return print_error(bus.error()), bus.is_usage_error() ? kExitUsage : kExitDiffers;
  bus.subscribe(options.bus.prefix + channels::kStatus, [&](const BusMessage& message) {
    status_t status;
    if (io::decode_message(message.bytes, status))
      known.session = status.session;
    else
      known.unread = io::explain_unread(message.bytes);
  });
  bus.subscribe(options.bus.prefix + channels::kScene, [&](const BusMessage& message) {
    freeflex_msgs::scene_t page;
    if (io::decode_message(message.bytes, page) && page.session == known.session.value_or(page.session))
      known.scene.take(page, message.bytes.size());
  });
  bus.subscribe(options.bus.prefix + channels::kAck,
                [&](const BusMessage& message) { take_answer(message.bytes, options, known); });
  const Line line{[&](auto time, const auto& done) { return bus.wait(time, done); },
                  [&](const char* suffix, std::span<const std::byte> bytes) {
                    return bus.publish(options.bus.prefix + suffix, bytes);
                  },
                  bus.describe(),
                  "Is freeflexd running, with the same LCM_DEFAULT_URL, network namespace and --prefix? The "
                  "daemon's own user can reach it with --socket, which does not need the bus."};
  return push_over(line, options, known);
}

int push_over_socket(const PushOptions& options) {
  OperatorLink link(options.socket->empty() ? service::operator_places(options.bus.prefix)
                                            : service::OperatorPlaces{{*options.socket}, ""});
  if (!link.error().empty()) return print_error(link.error()), kExitDiffers;
  Exchange known;
  const auto take = [&](std::span<const std::byte> bytes) {
    freeflex_msgs::scene_t page;
    if (!io::decode_message(bytes, page)) return take_answer(bytes, options, known);
    known.scene.take(page, bytes.size());
    known.session = page.session;
  };
  const Line line{[&](auto time, const auto& done) { return link.wait(time, done, take); },
                  [&](const char*, std::span<const std::byte> bytes) { return link.send(bytes); },
                  link.path(), "Is the daemon stopped? It accepts at most eight such connections."};
  return push_over(line, options, known);
}

int push(const CLI::App& command, PushOptions options) {
  const std::string fault = find_push_fault(command, options);
  if (!fault.empty()) return print_error(fault), kExitUsage;
  if (options.sender.empty()) options.sender = options.socket ? "local.push" : "push";
  return options.socket ? push_over_socket(options) : push_over_bus(options);
}

/// Adds the options of loads and their timing.
void add_force_options(CLI::App& command, PushOptions& options) {
  command
      .add_option("--point", options.points,
                  "point to push, by --force or by its own =X,Y,Z [N]; may be repeated")
      ->type_name("NAME[=X,Y,Z]")
      ->allow_extra_args(false);
  command.add_option("--group", options.groups, "group to which --force and --torque apply; may be repeated")
      ->type_name("NAME")
      ->allow_extra_args(false);
  command.add_option("--wheel", options.wheels, "torque of a wheel's motor [N m]; may be repeated")
      ->type_name("NAME=TORQUE")
      ->allow_extra_args(false);
  add_vector(command, "--force", options.force, "force [N]", "newton");
  add_vector(command, "--torque", options.torque, "torque [N m] on groups and bodies", "newton metre");
  command.add_option("--axes", options.axes, "axes of force and torque: world or body")
      ->check(one_of({"world", "body"}))
      ->type_name("AXES")
      ->capture_default_str();
  command.add_option("--duration", options.duration, "how long the loads act [s], default 1")
      ->check(positive_time())
      ->type_name("S");
  command
      .add_option("--lease", options.lease,
                  "instead of --duration; the loads end after this time [s] unless the same sender renews "
                  "them in the same slot")
      ->check(positive_time())
      ->type_name("S");
  command.add_flag("--clear", options.clear, "clear the slot, which ends its loads");
  command
      .add_option("--slot", options.slot,
                  "slot from 0 to 63, in which the loads replace those of this sender")
      ->check(whole_number(0, kMaxSlotNumber))
      ->type_name("N")
      ->capture_default_str();
  command.add_option("--at-tick", options.at_tick, "take effect at this tick, default at once")
      ->check(whole_number(0, kMost<std::int64_t>))
      ->type_name("TICK");
  command.add_flag("--late-ok", options.late_ok,
                   "if --at-tick has passed, take effect at once instead of being rejected");
}

/// Adds the options of sender, key, bus and waiting time.
void add_exchange_options(CLI::App& command, PushOptions& options) {
  command
      .add_option("--sender", options.sender,
                  "who pushes: 1 to 31 of A-Z a-z 0-9 _ . -; default push, over --socket local.push")
      ->check([](const std::string& name) {
        return io::is_valid_sender(name)
                   ? std::string()
                   : "the value is '" + name + "', but must be 1 to 31 of A-Z a-z 0-9 _ . -";
      })
      ->type_name("NAME");
  command.add_option("--key", options.key, "key file to seal the command with; its id is the sender")
      ->check(file_name())
      ->type_name("FILE");
  command.add_option("--timeout", options.timeout, "how long to wait for the daemon and for its answer [s]")
      ->check(positive_time())
      ->type_name("S")
      ->capture_default_str();
  add_bus_options(command, options.bus);
  command
      .add_option_function<std::vector<std::string>>(
          "--socket",
          [&options](const std::vector<std::string>& path) {
            options.socket = path.empty() ? "" : path.front();
          },
          "use, instead of the bus, the daemon's socket for its own user, which nobody else can reach or "
          "flood; without PATH the default socket of --prefix")
      ->type_name("[PATH]")
      ->expected(0, 1);
  command.add_flag("--json", options.json, "one JSON object on standard output");
}

}  // namespace

void add_push(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<PushOptions>();
  CLI::App* command = app.add_subcommand("push", "send one command to a running daemon and print its answer");
  add_force_options(*command, *options);
  command
      ->add_option("--control", options->control,
                   "instead of a force: run, hold, reset, stop, step=N, shapes=MODE, scene or scene=PAGE")
      ->type_name("COMMAND");
  command
      ->add_option(
          "--clear-sender", options->clear_sender,
          "instead of a force: end all pushes of this sender, and drop its waiting commands; '*' means those "
          "of every sender of the bus. Needs --socket, or a key that permits it")
      ->type_name("NAME");
  add_exchange_options(*command, *options);
  command->footer(kPushFooter);
  command->callback([options, command, &exit_code] { exit_code = push(*command, *options); });
}

}  // namespace freeflex::tools
