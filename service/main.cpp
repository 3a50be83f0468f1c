// freeflexd: one free flexible structure in state, advanced at a fixed rate, on the bus.
#include <spdlog/async.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>

#include "messages/channels.hpp"
#include "service/daemon.hpp"
#include "service/ingress.hpp"

namespace {

using freeflex::service::DaemonOptions;

constexpr const char* kFooter = R"(Timing:
  realtime   one simulated second a second (default)
  scaled=K   K simulated seconds a second
  lockstep   advances only by FREEFLEX_CONTROL STEP; a STATE follows each
  asap       as fast as it goes; no STATE is skipped

Environment:
  LCM_DEFAULT_URL  bus to use when --lcm-url is not given

Exit status: 0 ended as told (signal, STOP, --until), 1 failed at run time, 2 wrong usage or scene.)";

/// Positive and finite, as a CLI11 check.
std::string check_positive(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (end == text.c_str() || *end != '\0' || !std::isfinite(value) || value <= 0.0) {
    return "found '" + text + "', must be a number > 0";
  }
  return {};
}

/// Lines go to a queue and from there to stderr: whoever logs never waits for a slow or broken terminal.
void start_log(const std::string& level) {
  spdlog::init_thread_pool(1024, 1);
  auto log = std::make_shared<spdlog::async_logger>(
      "freeflexd", std::make_shared<spdlog::sinks::stderr_color_sink_mt>(), spdlog::thread_pool(),
      spdlog::async_overflow_policy::overrun_oldest);
  log->set_pattern("%H:%M:%S.%e %n %^%l%$ %v");
  log->set_level(spdlog::level::from_str(level));
  log->set_error_handler(
      [](const std::string&) {});  // a log that cannot be written must not stop the simulation
  spdlog::set_default_logger(std::move(log));
}

}  // namespace

int main(int argc, char** argv) {
  if (const auto status = freeflex::service::run_if_ingress(argc, argv)) return *status;

  DaemonOptions options;
  std::string timing = "realtime";
  std::string level = "info";
  CLI::App app("Simulates a free flexible structure in real time, pushed and watched over LCM.", "freeflexd");
  app.footer(kFooter);
  app.set_version_flag("--version", FREEFLEX_VERSION);
  app.add_option("SCENE", options.input, "scene (YAML) or compiled plan")->required();
  app.add_option("--lcm-url", options.lcm_url, "LCM bus, udpm://ADDRESS:PORT?ttl=N");
  app.add_option("--prefix", options.prefix, "first part of every channel name")
      ->default_val(freeflex::channels::kDefaultPrefix);
  app.add_option("--rate", options.rate, "ticks per simulated second [Hz] in place of the scene's")
      ->check(check_positive);
  app.add_option("--time", timing, "realtime, scaled=K, lockstep or asap")->default_str(timing);
  app.add_option("--until", options.until, "end at this simulated time [s]")->check(check_positive);
  app.add_flag("--hold", options.starts_holding, "start holding: wait for RUN or STEP");
  app.add_option("--log-level", level, "least level that is logged")
      ->default_str(level)
      ->check(CLI::IsMember({"debug", "info", "warning", "error", "off"}));
  try {
    app.parse(argc, argv);
    const auto parsed = freeflex::service::parse_timing(timing);
    if (!parsed)
      throw CLI::ValidationError(
          "--time", "found '" + timing + "', must be realtime, scaled=K with K > 0, lockstep or asap");
    options.timing = *parsed;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? freeflex::service::kClean : freeflex::service::kUsage;
  }
  freeflex::service::SignalWatch signals;
  start_log(level);
  const int status = freeflex::service::run_daemon(options, signals);
  spdlog::shutdown();
  return status;
}
