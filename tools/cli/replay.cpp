// freeflex replay checks whether the step reproduces a recording bit for bit.
#include "tools/bus/replay.hpp"

#include <CLI/App.hpp>
#include <array>
#include <cinttypes>
#include <cstdio>
#include <memory>
#include <string>

#include "tools/cli/commands.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

struct ReplayOptions {
  ReplayRequest request;
  bool json = false;
};

constexpr const char* kReplayFooter = R"(Example:
  lcm-logger -c '^FREEFLEX_.*' flight.log      (then push, then Ctrl-C)
  freeflex replay flight.log --plan rotor.plan
JSON fields:
  log          the file;  result: identical, differs, incomplete, interrupted or error
  ticks, states, verdicts, commands
               numbers of ticks replayed, states and verdicts compared and commands applied, also for an incomplete log
  missing      for each of STATE, POINTS and LOADS that the log contains: ticks (published by the daemon, not in the
               log), first (of these), before (the log begins), unsent (as the daemon's status counts),
               lost_in_transit
  not_compared other contents of the log, as texts
  difference   the first difference: tick, what, recorded, replayed (with the bits, 16 hexadecimal digits)
  error, warning
               texts, if any
A log that is damaged or lacks a command is replayed up to the last state whose commands are all known; the error
gives that tick and the place of the damage.
Exit codes: 0 identical to the bit, 1 differs (first tick, coordinate and both values are printed), 2 wrong
arguments, plan or no log at all, 3 log damaged or incomplete, 130 interrupted.)";

struct ResultName {
  const char* name;  // in JSON
  int exit_code;
};
/// Names and exit codes, in the order of ReplayOutcome::Result.
constexpr std::array<ResultName, 5> kResults{{{"identical", kExitOk},
                                              {"differs", kExitDiffers},
                                              {"incomplete", kExitIncomplete},
                                              {"interrupted", kExitInterrupted},
                                              {"error", kExitUsage}}};

int report(const ReplayOptions& options, const ReplayOutcome& outcome) {
  const ResultName& result = kResults[static_cast<std::size_t>(outcome.result)];
  if (options.json) {
    Json out{{"log", options.request.log},       {"result", result.name},
             {"ticks", outcome.ticks},           {"states", outcome.num_states},
             {"verdicts", outcome.num_verdicts}, {"commands", outcome.num_commands}};
    out["missing"] = Json::object();
    for (const Loss& loss : outcome.losses)
      out["missing"][loss.channel] = {{"ticks", loss.num_ticks},
                                      {"first", loss.num_ticks > 0 ? Json(loss.first_tick) : Json()},
                                      {"before", loss.num_before},
                                      {"unsent", loss.num_unsent},
                                      {"lost_in_transit", loss.num_lost_in_transit()}};
    if (outcome.difference) {
      out["difference"] = {{"tick", outcome.difference->tick},
                           {"what", outcome.difference->what},
                           {"recorded", outcome.difference->recorded},
                           {"replayed", outcome.difference->replayed}};
    }
    out["not_compared"] = outcome.not_compared;
    if (!outcome.error.empty()) out["error"] = outcome.error;
    if (!outcome.warning.empty()) out["warning"] = outcome.warning;
    print_json(out);
    return result.exit_code;
  }
  if (!outcome.warning.empty()) print_warning(outcome.warning);
  if (result.exit_code == kExitOk) {
    std::printf("identical to the bit over %" PRId64 " ticks (%s and %s compared, %s applied)\n",
                outcome.ticks, counted(outcome.num_states, "state").c_str(),
                counted(outcome.num_verdicts, "verdict").c_str(),
                counted(outcome.num_commands, "command").c_str());
    for (const std::string& what : outcome.not_compared)
      std::printf("not compared: %s, which follow from the state\n", what.c_str());
  } else if (outcome.difference) {
    std::printf("differs at tick %" PRId64 ": %s is recorded as %s, but replayed as %s\n",
                outcome.difference->tick, outcome.difference->what.c_str(),
                outcome.difference->recorded.c_str(), outcome.difference->replayed.c_str());
  } else {
    print_error(outcome.error);
    // the states that were compared are identical
    if (outcome.num_states > 0)
      std::printf("the states up to tick %" PRId64 " are as recorded, to the bit (%s compared, %s applied)\n",
                  outcome.ticks, counted(outcome.num_states, "state").c_str(),
                  counted(outcome.num_commands, "command").c_str());
  }
  return result.exit_code;
}

}  // namespace

void add_replay(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ReplayOptions>();
  ReplayRequest& request = options->request;
  CLI::App* command = app.add_subcommand(
      "replay", "apply recorded commands and compare the states with the recorded ones bit for bit");
  command->add_option("LOG", request.log, "LCM event log, as lcm-logger or freeflex run writes it")
      ->required();
  command
      ->add_option("--plan", request.plan,
                   "plan or scene that was recorded; default: the file that the log names")
      ->type_name("FILE");
  command->add_option("--session", request.session, "session to replay, if the log contains several")
      ->check(whole_number(0, kMost<std::int64_t>))
      ->type_name("N");
  command->add_option("--prefix", request.prefix, "first part of the channel names")
      ->check(channel_prefix())
      ->type_name("NAME")
      ->capture_default_str();
  command->add_flag("--json", options->json, "one JSON object on standard output");
  command->footer(kReplayFooter);
  command->callback([options, &exit_code] { exit_code = report(*options, replay(options->request)); });
}

}  // namespace freeflex::tools
