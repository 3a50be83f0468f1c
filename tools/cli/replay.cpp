// freeflex replay: the recorded commands fed back at their ticks, every recorded state compared bit for bit.
#include <CLI/App.hpp>
#include <bit>
#include <cinttypes>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "core/plan/plan_bytes.hpp"
#include "core/plan/rates.hpp"
#include "messages/channels.hpp"
#include "service/io/wire/decode.hpp"
#include "service/io/wire/outbound.hpp"
#include "tools/bus/recording.hpp"
#include "tools/cli/commands.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

using freeflex_msgs::applied_t;
using freeflex_msgs::state_t;

struct ReplayOptions {
  std::string log;
  std::string plan;
  std::string prefix = channels::kDefaultPrefix;
  std::optional<std::int64_t> session;
  bool json = false;
};

constexpr const char* kReplayFooter = R"(Example:
  lcm-logger -c '^FREEFLEX_.*' flight.log      (then push, then Ctrl-C)
  freeflex replay flight.log --plan rotor.plan
JSON fields:
  log          the file;  result: identical, differs, incomplete, interrupted or error
  ticks, states, commands
               over how many ticks, how many states compared, how many commands fed back
  difference   where it differs: tick, what, recorded, replayed (with the bits, 16 hexadecimal digits)
  error, warning
               in words, where there is one
Exit codes: 0 identical to the bit, 1 differs (first tick, coordinate and both values are printed), 2 wrong
arguments, plan or no log at all, 3 log damaged or incomplete, 130 interrupted.)";

/// The first thing that is not as recorded.
struct Difference {
  std::int64_t tick = 0;
  std::string what;  // "q[3]", "expired slots"
  std::string recorded, replayed;
};

struct ReplayOutcome {
  int exit_code = kExitOk;
  std::string error;  // why there is no answer: exit 2 or 3
  std::optional<Difference> difference;
  std::int64_t ticks = 0;
  std::int64_t num_states = 0;
  std::int64_t num_commands = 0;
  std::string warning;
};

std::string exact(double value) {
  char text[64];
  std::snprintf(text, sizeof text, "%.17g (%016" PRIx64 ")", value, std::bit_cast<std::uint64_t>(value));
  return text;
}

/// First coordinate of two states that is not the same to the bit.
std::optional<Difference> compare(const state_t& recorded, const state_t& replayed) {
  const auto values = [&](const char* name, const double* a, const double* b,
                          std::size_t size) -> std::optional<Difference> {
    for (std::size_t i = 0; i < size; ++i) {
      if (std::bit_cast<std::uint64_t>(a[i]) == std::bit_cast<std::uint64_t>(b[i])) continue;
      const std::string index = size > 1 ? "[" + std::to_string(i) + "]" : "";
      return Difference{recorded.tick, name + index, exact(a[i]), exact(b[i])};
    }
    return std::nullopt;
  };
  if (recorded.num_elastic != replayed.num_elastic) {
    return Difference{recorded.tick, "num_elastic", std::to_string(recorded.num_elastic),
                      std::to_string(replayed.num_elastic)};
  }
  if (recorded.applied_count != replayed.applied_count) {
    return Difference{recorded.tick, "applied_count", std::to_string(recorded.applied_count),
                      std::to_string(replayed.applied_count)};
  }
  const auto n = static_cast<std::size_t>(recorded.num_elastic);
  std::optional<Difference> found = values("time", &recorded.time, &replayed.time, 1);
  if (!found) found = values("position", recorded.position, replayed.position, 3);
  if (!found) found = values("attitude", recorded.attitude, replayed.attitude, 4);
  if (!found) found = values("velocity", recorded.velocity, replayed.velocity, 3);
  if (!found) found = values("angular_velocity", recorded.angular_velocity, replayed.angular_velocity, 3);
  if (!found) found = values("angular_momentum", recorded.angular_momentum, replayed.angular_momentum, 3);
  if (!found) found = values("q", recorded.q.data(), replayed.q.data(), n);
  if (!found) found = values("q_dot", recorded.q_dot.data(), replayed.q_dot.data(), n);
  return found;
}

std::string slot_text(const std::string& sender, std::int32_t slot, std::int64_t sequence) {
  return sender + " slot " + std::to_string(slot) + " sequence " + std::to_string(sequence);
}

/// Slots that ended at a tick: the recording against what the step did.
std::optional<Difference> compare_ends(std::int64_t tick, const std::vector<applied_t>& recorded,
                                       const StepReport& report) {
  std::string wanted;
  std::string found;
  for (const applied_t& end : recorded) {
    wanted += (end.kind == applied_t::LEASE_LOST ? "; lease of " : "; ") +
              slot_text(end.command.sender, end.command.slot, end.command.sequence);
  }
  for (std::int32_t i = 0; i < report.num_expiries; ++i) {
    const Expiry& end = report.expiries[static_cast<std::size_t>(i)];
    found += (end.was_lease ? "; lease of " : "; ") + slot_text(end.sender.data(), end.slot, end.sequence);
  }
  if (wanted == found) return std::nullopt;
  const auto text = [](const std::string& list) {
    return list.empty() ? std::string("none") : list.substr(2);
  };
  return Difference{tick, "slots that ended", text(wanted), text(found)};
}

/// A plan under simulation, driven by a recording.
class Replay {
 public:
  Replay(const Plan& plan, io::LogReader& log, const RecordedSession& session)
      : plan_(plan),
        log_(log),
        session_(session),
        feed_(log, session, plan),
        state_(make_state(plan)),
        workspace_(make_workspace(plan)) {}

  ReplayOutcome run() {
    Progress progress("replay");
    const std::int64_t last_tick = session_.states.back().tick;
    for (const StateRecord& record : session_.states) {
      while (outcome_.exit_code == kExitOk && (state_.tick != record.tick || state_.epoch != record.epoch)) {
        advance(record);
        progress.update(static_cast<double>(state_.tick) /
                        static_cast<double>(std::max<std::int64_t>(1, last_tick)));
      }
      if (outcome_.exit_code == kExitOk) check(record);
      if (outcome_.exit_code != kExitOk) break;
    }
    return outcome_;
  }

 private:
  void differ(Difference difference) {
    outcome_.exit_code = kExitDiffers;
    outcome_.difference = std::move(difference);
  }
  void fail(const std::string& error) {
    outcome_.exit_code = kExitIncomplete;
    outcome_.error = "log incomplete: " + error;
  }

  /// One reset or one tick towards a recorded state.
  void advance(const StateRecord& target) {
    if (is_interrupted()) {
      outcome_.exit_code = kExitInterrupted;
      outcome_.error = "interrupted at tick " + std::to_string(state_.tick);
      return;
    }
    if (feed_.next_kind(state_.tick) == applied_t::RESET) {
      feed_.take_reset();
      reset_state(plan_, state_);
      return;
    }
    const std::int64_t tick = state_.tick;
    if (tick > target.tick || state_.epoch > target.epoch) {
      return differ({target.tick, "epoch", std::to_string(target.epoch), std::to_string(state_.epoch)});
    }
    const std::string error = feed_.take_commands(tick, commands_, ended_);
    if (!error.empty()) return fail(error);
    step(plan_, state_, Inputs{commands_}, workspace_, report_);
    outcome_.num_commands += static_cast<std::int64_t>(commands_.size());
    if (report_.status != StepStatus::kOk) {
      if (feed_.next_kind(tick) == applied_t::RESET) return;
      return differ({tick + 1, "state", "finite", "not finite: the step gives up"});
    }
    if (std::optional<Difference> found = compare_ends(tick, ended_, report_)) differ(std::move(*found));
  }

  void check(const StateRecord& record) {
    io::LogEvent event;
    state_t recorded;
    if (!log_.read_at(record.offset, event) || !io::decode_message(event.bytes, recorded)) {
      return fail("the state at byte " + std::to_string(record.offset) + " cannot be read again");
    }
    io::Stamp stamp;
    stamp.applied_count = feed_.num_taken();
    if (std::optional<Difference> found = compare(recorded, io::make_state_message(plan_, state_, stamp))) {
      return differ(std::move(*found));
    }
    outcome_.ticks = record.tick;
    ++outcome_.num_states;
  }

  const Plan& plan_;
  io::LogReader& log_;
  const RecordedSession& session_;
  CommandFeed feed_;
  State state_;
  Workspace workspace_;
  StepReport report_;
  std::vector<ForceCommand> commands_;
  std::vector<applied_t> ended_;
  ReplayOutcome outcome_;
};

ReplayOutcome no_answer(int exit_code, const std::string& error) {
  ReplayOutcome outcome;
  outcome.exit_code = exit_code;
  outcome.error = error;
  return outcome;
}
ReplayOutcome usage(const std::string& error) { return no_answer(kExitUsage, error); }
ReplayOutcome incomplete(const std::string& error) {
  return no_answer(kExitIncomplete, "log incomplete: " + error);
}

/// The plan of the recording at its rate, or why it is not.
std::optional<Plan> find_plan(const ReplayOptions& options, const RecordedSession& session,
                              ReplayOutcome& outcome) {
  const std::string path = options.plan.empty() ? session.plan_file : options.plan;
  if (path.empty()) {
    outcome = usage("the log holds no " + options.prefix + channels::kScene +
                    " that names the plan: give it with --plan");
    return std::nullopt;
  }
  std::optional<Plan> plan = load_or_explain(path, 0.0);
  if (!plan) {
    outcome = usage(path + ": no plan; give the one that was recorded with --plan");
    return std::nullopt;
  }
  if (!session.plan_fingerprint) {
    outcome.warning = "the log does not say which plan was recorded; taken on trust: " + path;
    return plan;
  }
  if (plan_fingerprint(*plan) != *session.plan_fingerprint && session.rate > 0.0)
    set_rate(*plan, session.rate);
  if (plan_fingerprint(*plan) != *session.plan_fingerprint) {
    outcome = usage(path + ": its plan has fingerprint " + fingerprint_text(plan_fingerprint(*plan)) +
                    ", the recorded one " + fingerprint_text(*session.plan_fingerprint) +
                    "; the scene was changed, or its set-up was done on another machine: record from a plan "
                    "('freeflex compile') and replay with that");
    return std::nullopt;
  }
  return plan;
}

ReplayOutcome replay(const ReplayOptions& options) {
  io::LogReader log(options.log);
  if (!log.error().empty()) return usage(log.error());
  const Recording recording = [&] {
    const Progress progress("reading");
    return read_recording(log, options.prefix);
  }();
  if (!recording.is_readable) return usage(recording.error);
  if (!recording.error.empty()) return incomplete(recording.error);
  std::string error;
  const RecordedSession* session = choose_session(recording, options.session, error);
  if (session == nullptr) return usage(error);
  const std::string flaw = find_flaw(*session);
  if (!flaw.empty()) return incomplete(flaw);
  if (session->states.empty()) return incomplete("it holds no " + options.prefix + channels::kState);
  ReplayOutcome outcome;
  const std::optional<Plan> plan = find_plan(options, *session, outcome);
  if (!plan) return outcome;
  // reading the index ended at the end of the file; from here on records are read by offset
  ReplayOutcome result = Replay(*plan, log, *session).run();
  result.warning = outcome.warning;
  return result;
}

int report(const ReplayOptions& options, const ReplayOutcome& outcome) {
  if (options.json) {
    const char* result = outcome.exit_code == kExitOk            ? "identical"
                         : outcome.exit_code == kExitDiffers     ? "differs"
                         : outcome.exit_code == kExitIncomplete  ? "incomplete"
                         : outcome.exit_code == kExitInterrupted ? "interrupted"
                                                                 : "error";
    Json out{{"log", options.log},
             {"result", result},
             {"ticks", outcome.ticks},
             {"states", outcome.num_states},
             {"commands", outcome.num_commands}};
    if (outcome.difference) {
      out["difference"] = {{"tick", outcome.difference->tick},
                           {"what", outcome.difference->what},
                           {"recorded", outcome.difference->recorded},
                           {"replayed", outcome.difference->replayed}};
    }
    if (!outcome.error.empty()) out["error"] = outcome.error;
    if (!outcome.warning.empty()) out["warning"] = outcome.warning;
    print_json(out);
    return outcome.exit_code;
  }
  if (!outcome.warning.empty()) print_warning(outcome.warning);
  if (outcome.exit_code == kExitOk) {
    std::printf("identical to the bit over %" PRId64 " ticks (%s compared, %s fed back)\n", outcome.ticks,
                counted(outcome.num_states, "state").c_str(),
                counted(outcome.num_commands, "command").c_str());
  } else if (outcome.difference) {
    std::printf("differs at tick %" PRId64 ": %s: recorded %s, replayed %s\n", outcome.difference->tick,
                outcome.difference->what.c_str(), outcome.difference->recorded.c_str(),
                outcome.difference->replayed.c_str());
  } else {
    print_error(outcome.error);
  }
  return outcome.exit_code;
}

}  // namespace

void add_replay(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App* command =
      app.add_subcommand("replay", "recorded commands fed back, recorded states compared bit for bit");
  command->add_option("LOG", options->log, "LCM event log, as lcm-logger or freeflex run writes it")
      ->required();
  command->add_option("--plan", options->plan, "plan or scene that was recorded; else the file the log names")
      ->type_name("FILE");
  command->add_option("--session", options->session, "session to replay when the log holds several")
      ->check(whole_number(0, kMost<std::int64_t>))
      ->type_name("N");
  command->add_option("--prefix", options->prefix, "first part of the channel names")
      ->check(channel_prefix())
      ->type_name("NAME")
      ->capture_default_str();
  command->add_flag("--json", options->json, "one JSON object on standard output");
  command->footer(kReplayFooter);
  command->callback([options, &exit_code] { exit_code = report(*options, replay(*options)); });
}

}  // namespace freeflex::tools
