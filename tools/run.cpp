// freeflex run: the step without the bus, as fast as it goes, to a log or a table.
#include <CLI/App.hpp>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/model/compile.hpp"
#include "messages/channels.hpp"
#include "tools/commands.hpp"
#include "tools/console.hpp"
#include "tools/recording.hpp"
#include "tools/run_output.hpp"
#include "tools/usage.hpp"

namespace freeflex::tools {
namespace {

using freeflex_msgs::applied_t;

struct Options {
  std::string input;
  std::string log;
  std::string out;
  std::string prefix = channels::kDefaultPrefix;
  std::optional<std::int64_t> session;
  std::optional<double> until;  // [s]
  double rate = 0.0;            // [Hz] 0: the scene's
  bool json = false;
};

struct Commands {
  std::unique_ptr<io::LogReader> log;
  Recording recording;
  const RecordedSession* session = nullptr;
  std::unique_ptr<CommandFeed> feed;
};

/// Opens the log that commands come from. An exit code other than kExitOk is explained.
int open_commands(const Options& options, const Plan& plan, Commands& commands) {
  commands.log = std::make_unique<io::LogReader>(options.log);
  if (!commands.log->error().empty()) return print_error(commands.log->error()), kExitUsage;
  commands.recording = read_recording(*commands.log, options.prefix);
  if (!commands.recording.is_readable) return print_error(commands.recording.error), kExitUsage;
  if (!commands.recording.error.empty())
    return print_error("log incomplete: " + commands.recording.error), kExitIncomplete;
  std::string error;
  commands.session = choose_session(commands.recording, options.session, error);
  if (commands.session == nullptr) return print_error(error), kExitUsage;
  const std::string missing = find_missing(*commands.session);
  if (!missing.empty()) return print_error("log incomplete: " + missing), kExitIncomplete;
  if (commands.session->plan_fingerprint && *commands.session->plan_fingerprint != plan_fingerprint(plan)) {
    std::fprintf(stderr, "freeflex: warning: the commands were recorded with another plan\n");
  }
  commands.feed = std::make_unique<CommandFeed>(*commands.log, *commands.session, plan);
  return kExitOk;
}

/// Last tick to reach, or nullopt (explained).
std::optional<std::int64_t> last_tick(const Options& options, const Plan& plan, const Commands& commands) {
  if (options.until) {
    const double ticks = std::round(*options.until / plan.period);
    if (ticks <= 9e15) return static_cast<std::int64_t>(ticks);
    print_error("--until is too far ahead");
    return std::nullopt;
  }
  if (commands.session == nullptr) {
    print_error("--until T is needed (or --log, whose last state then is the end)");
    return std::nullopt;
  }
  std::int64_t last = 0;
  for (const StateRecord& state : commands.session->states) last = std::max(last, state.tick);
  for (const AppliedRecord& applied : commands.session->applied) last = std::max(last, applied.tick);
  return last;
}

struct Result {
  int exit_code = kExitOk;
  std::string error;
  std::int64_t ticks = 0;
};

/// Steps to the last tick, applies what the feed holds, hands everything to the output.
Result simulate(const Plan& plan, CommandFeed* feed, std::int64_t last, RunOutput& output) {
  State state = make_state(plan);
  Workspace workspace = make_workspace(plan);
  StepReport report;
  std::vector<ForceCommand> commands;
  std::vector<applied_t> ended;
  Progress progress("run");
  output.publish(state, true);
  while (state.tick < last && !output.has_error()) {
    if (is_interrupted()) return {kExitInterrupted, "", state.tick};
    const std::int64_t tick = state.tick;
    commands.clear();
    if (feed != nullptr) {
      while (feed->next_kind(tick) == applied_t::RESET) {
        feed->take_reset();
        reset_state(plan, state);
        output.applied_reset(tick);
        output.publish(state, true);
      }
      const std::string error = feed->take_commands(tick, commands, ended);
      if (!error.empty()) return {kExitIncomplete, "log incomplete: " + error, tick};
    }
    step(plan, state, Inputs{commands}, workspace, report);
    if (report.status != StepStatus::kOk) {
      if (feed != nullptr && feed->next_kind(tick) == applied_t::RESET) continue;
      return {kExitDiffers, "the state after tick " + std::to_string(tick) + " is not finite", tick};
    }
    output.applied_step(tick, report, commands);
    output.publish(state, state.tick == last);
    progress.update(static_cast<double>(state.tick) / static_cast<double>(last));
  }
  return {kExitOk, "", state.tick};
}

int run(const Options& options) {
  if (would_overwrite(options.input, options.out)) return kExitUsage;
  if (!options.log.empty() && would_overwrite(options.log, options.out)) return kExitUsage;
  const std::optional<Plan> plan = load_or_explain(options.input, options.rate);
  if (!plan) return kExitUsage;
  Commands commands;
  if (!options.log.empty()) {
    if (const int exit_code = open_commands(options, *plan, commands); exit_code != kExitOk) return exit_code;
  }
  const std::optional<std::int64_t> last = last_tick(options, *plan, commands);
  if (!last) return kExitUsage;

  const std::unique_ptr<RunOutput> output =
      make_run_output(*plan, options.input, options.prefix, options.out);
  Result result;
  if (!output->has_error()) result = simulate(*plan, commands.feed.get(), *last, *output);
  const bool is_kept = result.exit_code == kExitInterrupted;
  const std::string error = is_kept || result.exit_code == kExitOk ? output->close(is_kept) : std::string();
  if (!result.error.empty()) return print_error(result.error + "; nothing was written"), result.exit_code;
  if (!error.empty()) return print_error(error), kExitDiffers;
  const std::string file = is_kept ? output->working_path() : options.out;
  const double seconds = static_cast<double>(result.ticks) * plan->period;
  if (options.json) {
    print_json({{"output", file}, {"ticks", result.ticks}, {"time", seconds}, {"complete", !is_kept}});
  } else if (is_kept) {
    std::fprintf(stderr, "freeflex: interrupted: %s holds %" PRId64 " of %" PRId64 " ticks\n", file.c_str(),
                 result.ticks, *last);
  } else {
    std::printf("%s: %s, %.10g s\n", file.c_str(), counted(result.ticks, "tick").c_str(), seconds);
  }
  return result.exit_code;
}

}  // namespace

void add_run(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("run", "the same step without the bus, as fast as it goes");
  command->add_option("SCENE", options->input, "scene or plan file")->required();
  command->add_option("--log", options->log, "LCM log whose commands are applied at their recorded ticks")
      ->check(file_name())
      ->type_name("FILE");
  command->add_option("--session", options->session, "session of that log when it holds several")
      ->type_name("N");
  command->add_option("--until", options->until, "simulated time to stop at [s], to the nearest tick")
      ->check(must_be("a number >= 0 [s]", [](double time) { return time >= 0.0 && std::isfinite(time); }))
      ->type_name("S");
  command->add_option("--rate", options->rate, "ticks per second [Hz] instead of the scene's")
      ->check(rate_in_hertz())
      ->type_name("HZ");
  command->add_option("--out", options->out, "file to write: NAME.csv is a table, any other name an LCM log")
      ->required()
      ->check(file_name())
      ->type_name("FILE");
  command->add_option("--prefix", options->prefix, "first part of the channel names")
      ->check(channel_prefix())
      ->type_name("NAME")
      ->capture_default_str();
  command->add_flag("--json", options->json, "one JSON object on standard output");
  command->footer(
      "Example:\n  freeflex run service/scenes/rotor.yaml --until 10 --out rotor.log\n"
      "  freeflex run rotor.plan --log flight.log --out flight.csv\n"
      "A log holds STATE, POINTS, LOADS, APPLIED and SCENE at the scene's rates, time stamps in simulated "
      "time.\n"
      "Columns of a CSV file, one row a STATE: tick; time [s]; x y z [m] and vx vy vz [m/s] of the centre of "
      "mass,\n"
      "world axes; qw qx qy qz; wx wy wz [rad/s], body axes; hx hy hz [kg m^2/s], world axes; q1.. [m]; "
      "q_dot1.. [m/s];\n"
      "NAME.x NAME.y NAME.z [m], world axes, of each published point; NAME [N] of each published spring or "
      "bar,\n"
      "NAME.1 to NAME.12 [N, N m] of each published beam.\n"
      "Exit codes: 0 written, 1 not written, 2 wrong arguments, scene or plan, 3 --log damaged or "
      "incomplete,\n"
      "130 interrupted: what was done stands in FILE.partial.");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace freeflex::tools
