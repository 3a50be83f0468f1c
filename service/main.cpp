// freeflexd simulates one free flexible structure at a fixed rate and publishes its motion on the bus.
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
  realtime   one simulated second per second of wall clock (default)
  scaled=K   K simulated seconds per second of wall clock
  lockstep   advances only by FREEFLEX_CONTROL STEP; a STATE follows each STEP
  asap       as fast as possible; no STATE is skipped

Environment:
  LCM_DEFAULT_URL  bus to use if --lcm-url is not given

Exit codes:
  0 ended as requested (SIGINT, SIGTERM, SIGHUP, STOP, --until), 1 failed at run time,
  2 wrong usage or scene)";

/// Opens descriptors 0, 1 and 2 if they are closed. Otherwise a socket or the shared block could get one of
/// these numbers and receive printed text.
void fill_standard_descriptors() {
  for (int fd = STDIN_FILENO; fd <= STDERR_FILENO; ++fd) {
    if (fcntl(fd, F_GETFD) < 0) open("/dev/null", O_RDWR);
  }
}

/// Reads the command line. If the process is to end at once, prints the reason or the help and returns the
/// exit status. Otherwise returns nullopt.
std::optional<int> read_arguments(int argc, char** argv, DaemonOptions& options, std::string& level) {
  std::string timing = "realtime";
  CLI::App app("Simulates a free flexible structure in real time, controlled and observed over LCM.",
               "freeflexd");
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
                 "path of the socket for commands of this user, in addition to the bus; none: no\n"
                 "socket. Default: freeflexd-PREFIX.sock in the first of $XDG_RUNTIME_DIR,\n"
                 "/run/user/UID and /run/freeflex that belongs to this user alone, else\n"
                 "/tmp/freeflexd-UID/PREFIX.sock")
      ->type_name("PATH");
  app.add_option("--rate", options.rate, "ticks per simulated second [Hz], instead of the scene's rate")
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
                 "user of the process that reads the network; default if started by root: nobody")
      ->type_name("NAME");
  app.add_flag("--take-over", options.takes_over,
               "start even if another freeflexd seems to use the prefix, whose messages may be forged");
  std::string verdict = "auto";
  app.add_option("--verdict", verdict,
                 "on: judge the motion on a thread; off: do not; auto: if there are 3 processors or more")
      ->type_name("MODE")
      ->default_str(verdict)
      ->check(freeflex::service::one_of({"auto", "on", "off"}));
  std::string keys;
  CLI::Option* const has_keys = app.add_option(
      "--keys", keys, "accept only commands sealed with these keys: a key file, or a folder of *.key");
  has_keys->type_name("FILE|FOLDER");
  app.add_option("--log-level", level, "lowest level that is logged: debug, info, warning, error or off")
      ->type_name("LEVEL")
      ->default_str(level)
      ->check(freeflex::service::one_of({"debug", "info", "warning", "error", "off"}));
  try {
    app.parse(argc, argv);
    const auto parsed = freeflex::service::parse_timing(timing);
    if (!parsed)
      throw CLI::ValidationError(
          "--time",
          "the value is '" + timing + "', but must be realtime, scaled=K with K > 0, lockstep or asap");
    options.timing = *parsed;
    if (verdict != "auto") options.judges = verdict == "on";
    // `--keys ""`, as from an unset variable, is an error and does not mean "no keys"
    if (has_keys->count() > 0) options.keys = keys;
  } catch (const CLI::ParseError& error) {
    // --help and --version are handled here too
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
  // this function is called first, so that it also applies to the ingress and to errors of the command line
  freeflex::service::ignore_signals_of_writing();
  fill_standard_descriptors();
  if (const auto status = freeflex::service::run_if_ingress(argc, argv)) return *status;
  try {
    return run(argc, argv);
  } catch (const std::system_error& fault) {
    // the thread of the log could not be started
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
