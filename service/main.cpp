// freeflexd: one free flexible structure in state, advanced at a fixed rate, on the bus.
#include <fcntl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <new>
#include <optional>
#include <string>
#include <system_error>

#include "messages/channels.hpp"
#include "service/daemon.hpp"
#include "service/ingress.hpp"
#include "service/limits.hpp"
#include "service/log.hpp"
#include "service/signals.hpp"
#include "service/usage.hpp"

namespace {

using freeflex::service::DaemonOptions;

constexpr const char* kFooter = R"(Timing:
  realtime   one simulated second a second (default)
  scaled=K   K simulated seconds a second
  lockstep   advances only by FREEFLEX_CONTROL STEP; a STATE follows each
  asap       as fast as it goes; no STATE is skipped

Environment:
  LCM_DEFAULT_URL  bus to use when --lcm-url is not given

Exit codes:
  0 ended as told (SIGINT, SIGTERM, SIGHUP, STOP, --until), 1 failed at run time, 2 wrong usage or scene)";

/// A socket or a shared block must not become descriptor 0, 1 or 2: whatever prints would write into it.
void fill_standard_descriptors() {
  for (int fd = STDIN_FILENO; fd <= STDERR_FILENO; ++fd) {
    if (fcntl(fd, F_GETFD) < 0) open("/dev/null", O_RDWR);
  }
}

/// The exit status where the process is to end at once, with its reason or the help printed.
std::optional<int> read_arguments(int argc, char** argv, DaemonOptions& options, std::string& level) {
  std::string timing = "realtime";
  CLI::App app("Simulates a free flexible structure in real time, pushed and watched over LCM.", "freeflexd");
  app.footer(kFooter);
  app.set_help_flag("-h,--help", "this text");
  app.set_version_flag("--version", "freeflexd " FREEFLEX_VERSION, "name and version");
  app.add_option("SCENE", options.input, "scene (YAML) or compiled plan")->required()->type_name("");
  freeflex::service::add_settings(app, options.settings);
  app.add_option("--lcm-url", options.lcm_url, "LCM bus, udpm://ADDRESS:PORT?ttl=N")->type_name("URL");
  app.add_option("--prefix", options.prefix, "first part of every channel name")
      ->type_name("NAME")
      ->default_val(freeflex::channels::kDefaultPrefix)
      ->check(freeflex::service::channel_prefix());
  app.add_option("--socket", options.socket,
                 "where this user's commands are taken beside the bus; none: nowhere. Default\n"
                 "freeflexd-PREFIX.sock in the first of $XDG_RUNTIME_DIR, /run/user/UID and\n"
                 "/run/freeflex that is this user's alone, else /tmp/freeflexd-UID/PREFIX.sock")
      ->type_name("PATH");
  app.add_option("--rate", options.rate, "ticks per simulated second [Hz] in place of the scene's")
      ->type_name("HZ")
      ->check(freeflex::service::rate_in_hertz());
  app.add_option("--time", timing, "realtime, scaled=K, lockstep or asap")
      ->type_name("MODE")
      ->default_str(timing);
  app.add_option("--until", options.until, "end at this simulated time [s]")
      ->type_name("S")
      ->check(freeflex::service::must_be("a number > 0 [s]", [](double time) { return time > 0.0; }));
  app.add_flag("--hold", options.starts_holding, "start holding: wait for RUN or STEP");
  app.add_option("--ingress-user", options.ingress_user,
                 "user whose rights the process has that reads the network; where root starts it: nobody")
      ->type_name("NAME");
  app.add_flag("--take-over", options.takes_over,
               "start although another freeflexd is heard on the prefix: it may be a stranger's invention");
  std::string keys;
  CLI::Option* const has_keys =
      app.add_option("--keys", keys, "take commands under these keys only: a key file, or a folder of *.key");
  has_keys->type_name("FILE|FOLDER");
  app.add_option("--log-level", level, "least level that is logged: debug, info, warning, error or off")
      ->type_name("LEVEL")
      ->default_str(level)
      ->check(freeflex::service::one_of({"debug", "info", "warning", "error", "off"}));
  try {
    app.parse(argc, argv);
    const auto parsed = freeflex::service::parse_timing(timing);
    if (!parsed)
      throw CLI::ValidationError(
          "--time", "found '" + timing + "', must be realtime, scaled=K with K > 0, lockstep or asap");
    options.timing = *parsed;
    // an empty name, of a variable that is not set, is one that cannot be read, and not no keys
    if (has_keys->count() > 0) options.keys = keys;
  } catch (const CLI::ParseError& error) {
    // --help and --version come this way too
    if (error.get_exit_code() == 0) return app.exit(error), freeflex::service::kClean;
    std::fprintf(stderr, "freeflexd: error: %s\n", freeflex::service::explain(app, error).c_str());
    if (argc == 1) std::fprintf(stderr, "\n%s", app.help().c_str());
    return freeflex::service::kUsage;
  }
  return std::nullopt;
}

int run(int argc, char** argv) {
  DaemonOptions options;
  std::string level = "info";
  if (const auto status = read_arguments(argc, argv, options, level)) return *status;
  freeflex::service::SignalWatch signals;
  freeflex::service::start_log(level);
  const int status = freeflex::service::run_daemon(options, signals);
  freeflex::service::end_log(status);
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  // first, for the ingress too, and for what is wrong with the command line
  freeflex::service::ignore_signals_of_writing();
  fill_standard_descriptors();
  if (const auto status = freeflex::service::run_if_ingress(argc, argv)) return *status;
  try {
    return run(argc, argv);
  } catch (const std::system_error& fault) {
    // no thread for the log
    std::fprintf(stderr, "freeflexd: error: no thread can be started: %s%s\n", fault.code().message().c_str(),
                 freeflex::service::explain_limits(fault.code().value()).c_str());
    return freeflex::service::kRuntimeFailure;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "freeflexd: error: memory ran out%s\n",
                 freeflex::service::explain_limits(ENOMEM).c_str());
    return freeflex::service::kRuntimeFailure;
  } catch (const std::exception& fault) {
    std::fprintf(stderr, "freeflexd: %s\n", fault.what());
    return freeflex::service::kRuntimeFailure;
  }
}
