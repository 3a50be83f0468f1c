// freeflex view shows the structure in a browser, live or from a recording.
#include <CLI/App.hpp>
#include <cstdio>
#include <fstream>
#include <memory>
#include <optional>
#include <string>

#include "messages/channels.hpp"
#include "service/io/wire/decode.hpp"
#include "service/io/wire/log.hpp"
#include "service/keys.hpp"
#include "tools/bus/recording.hpp"
#include "tools/cli/commands.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/usage.hpp"
#include "tools/view/live.hpp"

namespace freeflex::tools {
namespace {

struct ViewOptions {
  BusOptions bus;
  std::string file;  // scene, plan or recording, empty for the scene of the daemon
  std::string plan;  // plan of a recording
  std::string html;
  std::string key;
  std::optional<std::int64_t> session;
  int port = 0;
};

constexpr const char* kViewFooter = R"(Examples:
  freeflex view                                (the running daemon, with the scene that it names)
  freeflex view satellite.yaml                 (before a daemon runs: its modes; then its motion)
  freeflex view flight.log
  freeflex view flight.log --html flight.html  (one file that needs nothing else)
The page is at the printed address, on this machine only; whoever has the address may look and push. From another
machine: ssh -L PORT:127.0.0.1:PORT, with --port PORT.
Drag to rotate, shift and drag to move, turn the wheel to zoom, drag a point that takes commands to push it.
If a recording is damaged, its intact part is shown, and the error describes the damage.
Exit codes: 0 ended by Ctrl-C, or the file is written, 1 no server, no bus, no daemon or not written, 2 wrong arguments,
scene or plan, 3 LOG damaged or incomplete.)";

/// Returns the path of the scene or plan file that a daemon names on the bus. If no daemon does, prints an
/// error and returns an empty text.
std::string file_of_daemon(const BusOptions& options) {
  constexpr std::chrono::milliseconds kPatience{3000};
  std::string file;
  Bus bus(options);
  bus.subscribe(options.prefix + channels::kScene, [&file](const BusMessage& message) {
    freeflex_msgs::scene_t page;
    if (io::decode_message(message.bytes, page)) file = page.plan_file;
  });
  if (!bus.wait(kPatience, [&file] { return !file.empty() || is_interrupted(); }) && !is_interrupted())
    print_error("no message of a daemon has come (" + bus.describe() +
                "); start freeflexd, or name a scene, a plan or a recording");
  return file;
}

/// Writes the page with all its data.
int write_html(const ViewOptions& options, const Body& body, const std::vector<std::byte>& motion) {
  io::PartialFile target(options.html);
  std::ofstream file(target.working_path(), std::ios::binary);
  file << page_with(bytes_of(body), motion);
  file.close();
  if (file.fail())
    return print_error("cannot write '" + options.html + "': " + std::strerror(errno)), kExitDiffers;
  if (const std::string error = target.commit(); !error.empty()) return print_error(error), kExitDiffers;
  std::printf("%s\n", options.html.c_str());
  return kExitOk;
}

/// Serves the page until Ctrl-C.  \param bus  null if a recording is shown
int serve(const ViewOptions& options, Body& body, std::vector<std::byte> motion, Bus* bus,
          std::optional<SealingKey> key) {
  constexpr std::chrono::milliseconds kLook{20};
  std::optional<Live> live;
  if (bus != nullptr) live.emplace(body, *bus, options.bus.prefix, std::move(key));
  PageServer page({std::string(plain_page()), bytes_of(body), std::move(motion)}, options.port,
                  [&](std::string_view text) {
                    if (live) live->take_text(text);
                  });
  if (!page.error().empty()) return print_error(page.error()), kExitDiffers;
  if (live) live->serve(page);
  std::printf("%s: %s\n", body.plan.name.c_str(), page.url().c_str());
  std::fflush(stdout);
  while (!is_interrupted()) {
    if (bus == nullptr) {
      std::this_thread::sleep_for(kLook);
      continue;
    }
    bus->wait(kLook, [] { return is_interrupted(); });
    live->push();
  }
  return kExitOk;
}

bool is_recording(const std::string& path) {
  io::LogReader log(path);
  io::LogEvent event;
  return log.next(event) || log.is_damaged();
}

int view_recording(const ViewOptions& options) {
  std::string error;
  const std::string plan = options.plan.empty()
                               ? recorded_plan(options.file, options.bus.prefix, options.session, error)
                               : options.plan;
  if (plan.empty()) return print_error(error), kExitIncomplete;
  if (would_overwrite(options.file, options.html)) return kExitUsage;
  std::optional<Body> body = make_body(plan, options.html);
  if (!body) return kExitUsage;
  std::string damage;
  std::vector<std::byte> motion =
      recorded_motion(*body, options.file, options.bus.prefix, options.session, error, damage);
  if (motion.empty()) return print_error(joined(damage, error)), kExitIncomplete;
  if (!damage.empty()) print_error(damage + "; the rest is shown");
  const int exit_code = options.html.empty() ? serve(options, *body, std::move(motion), nullptr, {})
                                             : write_html(options, *body, motion);
  return exit_code == kExitOk && !damage.empty() ? kExitIncomplete : exit_code;
}

int view(const CLI::App& command, const ViewOptions& options) {
  if (command.count("--html") > 0 && command.count("--port") > 0)
    return print_error("--html cannot be used with --port, because nothing is served"), kExitUsage;
  std::optional<SealingKey> key;
  if (!options.key.empty()) {
    const service::KeysResult result = service::load_key(options.key);
    if (!result.faults.empty()) return std::fprintf(stderr, "%s\n", result.faults.c_str()), kExitUsage;
    key = result.keys.front().sealing;
  }
  if (!options.file.empty() && is_recording(options.file)) return view_recording(options);
  if (!options.plan.empty() || options.session)
    return print_error("--plan and --session need a recording"), kExitUsage;
  if (!options.html.empty()) {
    if (options.file.empty()) return print_error("--html needs a scene, a plan or a recording"), kExitUsage;
    const std::optional<Body> body = make_body(options.file, options.html);
    return body ? write_html(options, *body, {}) : kExitUsage;
  }
  Bus bus(options.bus);
  if (!bus.error().empty()) return print_error(bus.error()), bus.is_usage_error() ? kExitUsage : kExitDiffers;
  const std::string file = options.file.empty() ? file_of_daemon(options.bus) : options.file;
  if (file.empty()) return is_interrupted() ? kExitOk : kExitDiffers;
  std::optional<Body> body = make_body(file);
  if (!body) return kExitUsage;
  return serve(options, *body, {}, &bus, std::move(key));
}

}  // namespace

void add_view(CLI::App& app, int& exit_code) {
  constexpr int kMostPort = 65535;
  auto options = std::make_shared<ViewOptions>();
  CLI::App* command = app.add_subcommand("view", "the structure in a browser: live, or a recording");
  command->add_option("FILE", options->file,
                      "scene, plan or recording; default: the scene that the daemon names");
  command
      ->add_option("--plan", options->plan, "scene or plan of a recording; default: the file that it names")
      ->type_name("FILE");
  command->add_option("--session", options->session, "session of a recording, if it contains several")
      ->check(whole_number(0, kMost<std::int64_t>))
      ->type_name("N");
  command->add_option("--port", options->port, "port on loopback; 0: any that is free")
      ->check(whole_number(0, kMostPort))
      ->type_name("N")
      ->capture_default_str();
  command->add_option("--html", options->html, "write the page with all its data into this file, and end")
      ->check(file_name(".html"))
      ->type_name("FILE");
  command->add_option("--key", options->key, "key file for pushes, if the daemon requires keys")
      ->type_name("FILE");
  add_bus_options(*command, options->bus);
  command->footer(kViewFooter);
  command->callback([command, options, &exit_code] { exit_code = view(*command, *options); });
}

}  // namespace freeflex::tools
