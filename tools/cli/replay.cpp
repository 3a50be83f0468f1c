// freeflex replay: whether a recording is what the step does, in words.
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
  ticks, states, commands
               over how many ticks, how many states compared, how many commands fed back, also where
               incomplete
  missing      of each of STATE, POINTS and LOADS that the log holds: ticks that the daemon publishes and the log
               does not hold, first, before (the log begins), unsent (as the daemon's status counts), on_the_way
  not_compared what the log holds beside the states, in words
  difference   where it differs: tick, what, recorded, replayed (with the bits, 16 hexadecimal digits)
  error, warning
               in words, where there is one
Of a log that is damaged or lacks a command, what is whole is replayed up to the last state whose commands are all
known; the error tells where it is damaged and which tick that is.
Exit codes: 0 identical to the bit, 1 differs (first tick, coordinate and both values are printed), 2 wrong
arguments, plan or no log at all, 3 log damaged or incomplete, 130 interrupted.)";

struct ResultWord {
  const char* name;  // in JSON
  int exit_code;
};
/// In the order of ReplayOutcome::Result.
constexpr std::array<ResultWord, 5> kResults{{{"identical", kExitOk},
                                              {"differs", kExitDiffers},
                                              {"incomplete", kExitIncomplete},
                                              {"interrupted", kExitInterrupted},
                                              {"error", kExitUsage}}};

int report(const ReplayOptions& options, const ReplayOutcome& outcome) {
  const ResultWord& word = kResults[static_cast<std::size_t>(outcome.result)];
  if (options.json) {
    Json out{{"log", options.request.log},
             {"result", word.name},
             {"ticks", outcome.ticks},
             {"states", outcome.num_states},
             {"commands", outcome.num_commands}};
    out["missing"] = Json::object();
    for (const Loss& loss : outcome.losses)
      out["missing"][loss.channel] = {{"ticks", loss.num_ticks},
                                      {"first", loss.num_ticks > 0 ? Json(loss.first_tick) : Json()},
                                      {"before", loss.num_before},
                                      {"unsent", loss.num_unsent},
                                      {"on_the_way", loss.num_on_way()}};
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
    return word.exit_code;
  }
  if (!outcome.warning.empty()) print_warning(outcome.warning);
  if (word.exit_code == kExitOk) {
    std::printf("identical to the bit over %" PRId64 " ticks (%s compared, %s fed back)\n", outcome.ticks,
                counted(outcome.num_states, "state").c_str(),
                counted(outcome.num_commands, "command").c_str());
    for (const std::string& what : outcome.not_compared)
      std::printf("not compared: %s, which follow from the state\n", what.c_str());
  } else if (outcome.difference) {
    std::printf("differs at tick %" PRId64 ": %s: recorded %s, replayed %s\n", outcome.difference->tick,
                outcome.difference->what.c_str(), outcome.difference->recorded.c_str(),
                outcome.difference->replayed.c_str());
  } else {
    print_error(outcome.error);
    // the states in front of what is missing
    if (outcome.num_states > 0)
      std::printf("up to tick %" PRId64 " as recorded, to the bit (%s compared, %s fed back)\n",
                  outcome.ticks, counted(outcome.num_states, "state").c_str(),
                  counted(outcome.num_commands, "command").c_str());
  }
  return word.exit_code;
}

}  // namespace

void add_replay(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ReplayOptions>();
  ReplayRequest& request = options->request;
  CLI::App* command =
      app.add_subcommand("replay", "recorded commands fed back, recorded states compared bit for bit");
  command->add_option("LOG", request.log, "LCM event log, as lcm-logger or freeflex run writes it")
      ->required();
  command->add_option("--plan", request.plan, "plan or scene that was recorded; else the file the log names")
      ->type_name("FILE");
  command->add_option("--session", request.session, "session to replay when the log holds several")
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
