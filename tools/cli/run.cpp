// freeflex run simulates a scene or plan without the bus, as fast as possible, and writes a log or a table.
#include <CLI/App.hpp>
#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/error/validity.hpp"
#include "core/motion.hpp"
#include "core/plan/explain.hpp"
#include "core/plan/file/plan_bytes.hpp"
#include "core/structure/structure.hpp"
#include "messages/channels.hpp"
#include "tools/bus/recording.hpp"
#include "tools/cli/commands.hpp"
#include "tools/cli/run_output.hpp"
#include "tools/plot/motion_plot.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

using freeflex_msgs::applied_t;

struct RunOptions {
  std::string input;
  io::Settings settings;
  std::string log;
  std::string out;   // empty: no file
  std::string plot;  // empty: no picture
  std::string prefix = channels::kDefaultPrefix;
  std::optional<std::int64_t> session;
  std::optional<double> until;  // [s]
  double rate = 0.0;            // [Hz] 0: the scene's rate
  bool json = false;
  bool explains = false;
};

constexpr const char* kRunFooter = R"(Example:
  freeflex run service/scenes/rotor.yaml --until 10        (prints only the verdict at the end)
  freeflex run service/scenes/rotor.yaml --until 10 --out rotor.log
  freeflex run rotor.plan --log flight.log --out flight.csv
  freeflex run boom.yaml --set points.hub.mass=41 --set 'links.*.GJ=6e4' --until 1 --out heavy.log
  freeflex run boom.yaml --until 1 --out - | cut -d, -f 2-5
A log holds STATE, POINTS, LOADS, STATUS, APPLIED and SCENE at the scene's rates, time stamps in simulated time.
Columns of a table, one row a STATE: tick; time [s]; x y z [m] and vx vy vz [m/s] of the centre of mass, world axes;
qw qx qy qz; wx wy wz [rad/s], body axes; hx hy hz [kg m^2/s], world axes; q1.. [m]; q_dot1.. [m/s];
wheel.NAME.momentum [N m s]; of each published point point.NAME.x y z [m], vx vy vz [m/s], ax ay az [m/s^2], world
axes, and of one with inertia qw qx qy qz, wx wy wz [rad/s] in its own axes; of each published group group.NAME.x y
z, qw qx qy qz, vx vy vz, and wx wy wz in body axes; link.NAME.axial [N] of each published spring, bar, dashpot or
rigid link; link.NAME.moment [N m] of each published bending or torsion spring; link.NAME.1 .. of each other
published link: 12 of a beam, 6 of a plate, three a point of a matrix or a rigid body (messages/README.md, section
7).
JSON fields:
  output       the file, null where none is asked for;  ticks, time [s]: how far it went;  complete: whether it
               reached --until, or without it the end of --log, with all commands before that
  displacement_ratio, spin_ratio
               orders of magnitude, kept for older scripts: see validity and the errors; null when no points
               are published
  validity     0 good, 1 watch, 2 outside, at judged_tick, the last tick that was judged; null if none was;  cause:
               why not good;  worst: validity, tick and cause of the worst verdict since the start
  position_error [m], attitude_error [rad], deformation_error, shadow_error, scale [m]
               the estimated errors, by how much the estimate may be wrong, and what the verdict compares it with;
               null: not known
  effects      with --explain, of each effect that the motion lacks: effect, deformation [m], attitude [rad],
               position [m], remedy; the largest first
Exit codes: 0 written, 1 not written or the state stopped being finite, 2 wrong arguments, scene or plan,
3 --log damaged or incomplete, 130 interrupted. After an interrupt, or when the disk is full, FILE.partial holds
the run so far, and replay takes it.)";

struct Commands {
  std::unique_ptr<io::LogReader> log;
  Recording recording;
  RecordedSession* session = nullptr;
  std::unique_ptr<CommandFeed> feed;
  bool is_foreign = false;  // true if the log was recorded with another plan
  std::string loss;         // text that says which part of the log cannot be used; empty if all of it can be
                            // used
};

/// Keeps the largest displacement and the largest spin of a run, because the method assumes that both are
/// small.
class Extremes {
 public:
  explicit Extremes(const Plan& plan) : plan_(plan), validity_(plan) {}

  void take(const State& state) {
    displacement_ = std::max(displacement_, validity_.max_displacement(state));
    spin_ = std::max(spin_, norm(angular_velocity(plan_, state)));
  }
  double size() const { return validity_.size(); }  // [m] max |r|
  /// Returns false if the scene publishes no points, because displacements are then not read.
  bool is_known() const { return !plan_.published_points.empty(); }
  double displacement_ratio() const { return validity_.displacement_ratio(displacement_); }
  /// Returns the ratio computed from the largest spin and the largest displacement of the whole run. A single
  /// tick does not suffice, because a vibration may pass through zero.
  double spin_ratio() const { return validity_.spin_ratio(spin_, displacement_); }

 private:
  const Plan& plan_;
  Validity validity_;
  double displacement_ = 0.0;  // [m]
  double spin_ = 0.0;          // [rad/s]
};

/// [ticks] between two updates of the extremes. An update reads every point, which takes many times as long
/// as a tick.
constexpr std::int64_t kLookEvery = 16;

/// Prints a warning if a run was outside the validity of its rung at any tick.
void warn_beyond_limits(const Plan& plan, const Verdict& worst) {
  if (worst.level != Verdict::Level::kOutside) return;
  print_warning(text_of(plan, worst) +
                "; the run left the validity of this rung (README, 'When not to trust it')");
}

/// Returns an error if an option has no effect, or if two options write to one file. Otherwise returns an
/// empty text.
std::string find_idle_option(const CLI::App& command, const RunOptions& options) {
  if (options.json && is_standard_output(options.out))
    return "--json needs a file for --out, because with --out - the table is written to standard output";
  if (!options.log.empty()) return {};
  if (options.session) return "--session needs --log, because it chooses a session of that log";
  if (command.count("--prefix") > 0 && (options.out.empty() || is_table(options.out)))
    return "--prefix needs --log, or an --out that is a log, because a table and a picture have no channels";
  return {};
}

/// If a table would have no row, prints an error and returns false. If a log would have no STATE, prints a
/// warning.
bool has_states(const Plan& plan, const std::string& out) {
  if (plan.rates[kStateChannel] > 0.0) return true;
  const std::string what = "the scene publishes no state ('publish: {state: 0}')";
  const std::string remedy = "set 'publish: state' to a rate [Hz]";
  if (is_table(out)) return print_error(what + ", so the table would have no row; " + remedy), false;
  print_warning(what + ", so the log contains no STATE and cannot be replayed; " + remedy);
  return true;
}

/// Opens the log from which commands are read. Returns the exit code, and prints the error if the code is not
/// kExitOk.
int open_commands(const RunOptions& options, const Plan& plan, Commands& commands) {
  commands.log = std::make_unique<io::LogReader>(options.log);
  if (!commands.log->error().empty()) return print_error(commands.log->error()), kExitUsage;
  {
    const Progress progress("reading");
    commands.recording = read_recording(*commands.log, options.prefix);
  }
  if (!commands.recording.error.empty()) return print_error(commands.recording.error), kExitUsage;
  std::string error;
  const std::string& damage = commands.recording.damage;
  commands.session = choose_session(commands.recording, options.session, error);
  if (commands.session == nullptr) {
    const bool is_all_lost = commands.recording.sessions.empty() && !damage.empty();
    return print_error(joined(damage, error)), is_all_lost ? kExitIncomplete : kExitUsage;
  }
  commands.loss = joined(damage, cut_at_gap(*commands.session));
  const std::string flaw = find_flaw(*commands.session);
  if (!flaw.empty())
    return print_error("the log is incomplete: " + joined(commands.loss, flaw)), kExitIncomplete;
  const std::uint64_t recorded = commands.session->plan_fingerprint.value_or(plan_fingerprint(plan));
  commands.is_foreign = recorded != plan_fingerprint(plan);
  if (commands.is_foreign) {
    print_warning("the commands were recorded with another plan (fingerprint " + fingerprint_text(recorded) +
                  " instead of " + fingerprint_text(plan_fingerprint(plan)) +
                  "), so they act on the points and groups that have the same numbers in this plan");
  }
  // if the log was recorded with another plan, only the log gives the period
  const double rate = commands.session->rate;
  const double foreign_period = rate > 0.0 ? 1.0 / rate : 0.0;
  const std::string time_flaw =
      find_time_flaw(*commands.session, commands.is_foreign ? foreign_period : plan.period);
  if (!time_flaw.empty())
    return print_error("the log is incomplete: " + joined(commands.loss, time_flaw)), kExitIncomplete;
  commands.feed = std::make_unique<CommandFeed>(*commands.log, *commands.session, plan);
  return kExitOk;
}

/// Returns the tick at which the run ends. On an error, prints the error and returns nullopt. If a part of
/// the log cannot be used, the run ends no later than the last tick for which all commands are known.
std::optional<std::int64_t> last_tick(const RunOptions& options, const Plan& plan, const Commands& commands) {
  std::optional<std::int64_t> last;
  if (options.until) {
    const double ticks = std::round(*options.until / plan.period);
    if (ticks > 9e15)
      return print_error("--until is too far ahead; at most 9e15 ticks can be run"), std::nullopt;
    last = static_cast<std::int64_t>(ticks);
  }
  if (commands.session == nullptr) {
    if (!last) print_error("--until S is needed, or --log, which then ends the run at its last state");
    return last;
  }
  const std::int64_t known = last_known_tick(*commands.session);
  return last && (commands.loss.empty() || *last < known) ? last : known;
}

struct Result {
  int exit_code = kExitOk;
  std::string error;
  std::int64_t ticks = 0;
  Verdict verdict = {}, worst = {};      // verdict at the end, and worst verdict of the last epoch
  std::vector<EffectSize> effects = {};  // what the motion lacks, if --explain asks for it
};

/// Returns the result if a record of the log does not fit the plan.
Result refuse_record(const std::string& error, bool is_foreign, std::int64_t tick) {
  if (!is_foreign) return {kExitIncomplete, "the log is incomplete: " + error, tick};
  return {
      kExitUsage,
      "the log belongs to another plan, because " + error + "; name the scene or plan it was recorded with",
      tick};
}

/// Steps to the last tick, applies the commands of the log and passes every state to the output.
Result simulate(const Plan& plan, Commands& log, std::int64_t last, RunOutput& output, Extremes& extremes,
                MotionPlot* plot, Explanation* explanation) {
  CommandFeed* const feed = log.feed.get();
  Motion motion(plan);
  std::vector<ForceCommand> commands;
  std::vector<applied_t> ended;
  Progress progress("run");
  output.publish(motion, true);
  if (plot != nullptr) plot->take(motion.state());
  extremes.take(motion.state());
  output.judge(motion, true);
  if (explanation != nullptr) explanation->take(motion.state());
  while (motion.tick() < last && !output.has_error()) {
    const std::int64_t tick = motion.tick();
    if (is_interrupted()) return {kExitInterrupted, "", tick, motion.verdict(), motion.worst(), {}};
    commands.clear();
    if (feed != nullptr) {
      while (feed->next_kind(tick) == applied_t::RESET) {
        feed->take_reset();
        motion.reset();
        output.applied_reset(tick);
        output.publish(motion, true);
        output.judge(motion, true);
        if (explanation != nullptr) explanation->take(motion.state());
      }
      const std::string error = feed->take_commands(tick, commands, ended);
      if (!error.empty()) return refuse_record(error, log.is_foreign, tick);
    }
    if (explanation != nullptr) explanation->command(tick, commands);
    const StepReport& report = motion.advance(commands);
    if (report.status != StepStatus::kOk) {
      if (feed != nullptr && feed->next_kind(tick) == applied_t::RESET) continue;
      extremes.take(motion.state());
      if (report.status != StepStatus::kOk && report.status != StepStatus::kNotFinite)
        return {kExitDiffers, lost_shape_text(plan, report, tick), tick};
      return {kExitDiffers,
              "the state after tick " + std::to_string(tick) + " is not finite (the verdict before it was " +
                  describe(plan, motion.worst().tick < 0 ? motion.verdict() : motion.worst()) +
                  "), because " + (plan.feedbacks.empty() ? "" : "the feedback is unstable, or ") +
                  (plan.attractor_mu > 0.0 ? "the body came too close to the attractor, or " : "") +
                  "loads or spin are far too large for this structure; check the units of loads, masses and "
                  "stiffnesses" +
                  (plan.feedbacks.empty() ? "" : " and the signs and sizes of gains, set a higher rate,") +
                  " and use smaller loads",
              tick};
    }
    output.applied_step(tick, report, commands);
    const bool is_last = tick + 1 == last, is_looked_at = (tick + 1) % kLookEvery == 0;
    output.publish(motion, is_last);
    if (explanation != nullptr) {
      explanation->take(motion.state());
      if (is_looked_at) output.set_effect(explanation->leading());
    }
    output.judge(motion, is_last);
    if (plot != nullptr) plot->take(motion.state());
    if (is_looked_at || is_last) extremes.take(motion.state());
    progress.update(static_cast<double>(tick + 1) / static_cast<double>(last));
  }
  Result result{kExitOk, "", motion.tick()};
  result.verdict = motion.verdict();
  result.worst = motion.worst();
  return result;
}

/// Returns the estimated error and the limits of the verdicts.
std::string error_line(const Plan& plan, const Verdict& verdict) {
  return error_text(plan, verdict) +
         format_text("; good up to %g %%, outside above %g %%", 100.0 * kGoodElastic, 100.0 * kMostElastic);
}

/// Returns when the motion was judged last, if that is not the end of the run.
std::string judged_last(const Plan& plan, std::int64_t tick, std::int64_t last) {
  const PlanShadow& shadow = plan.verdict.shadows.front();
  if (last - tick < shadow.ticks) return {};
  return format_text(", judged last at %.6g s", static_cast<double>(tick) * plan.period) +
         (shadow.every > 1 ? format_text(" (one horizon in %" PRId64 " is judged)", shadow.every) : "");
}

/// Prints the verdict at the end of a run and its estimated error, and the worst verdict if it is worse.
/// \param last  the last tick of the run
void print_verdict(std::FILE* to, const Plan& plan, const Verdict& verdict, const Verdict& worst,
                   std::int64_t last) {
  if (verdict.tick < 0)
    return static_cast<void>(std::fprintf(to, "verdict at the end: %s\n", describe(plan, verdict).c_str()));
  std::fprintf(to, "verdict at the end%s: %s\n", judged_last(plan, verdict.tick, last).c_str(),
               describe(plan, verdict).c_str());
  const bool is_at_end = judged_last(plan, verdict.tick, last).empty();
  const std::string when =
      is_at_end ? "the end" : format_text("%.6g s", static_cast<double>(verdict.tick) * plan.period);
  std::fprintf(to, "estimated error at %s: %s\n", when.c_str(), error_line(plan, verdict).c_str());
  if (std::isfinite(verdict.error.position))
    std::fprintf(
        to, "  centre of mass %.1e m (good up to %g of the size), attitude %.1e rad (good up to %g rad)\n",
        verdict.error.position, kGoodPosition, verdict.error.attitude, kGoodAttitude);
  if (worst.level > verdict.level)
    std::fprintf(to, "worst verdict, at %.6g s: %s\n", static_cast<double>(worst.tick) * plan.period,
                 describe(plan, worst).c_str());
}

/// Prints what a motion lacks.
void print_effects(std::FILE* to, const Plan& plan, const std::vector<EffectSize>& effects) {
  if (effects.empty()) return;
  std::fprintf(to, "what the motion lacks (largest distance over the run):\n");
  for (const EffectSize& each : effects) {
    if (!std::isfinite(each.most.deformation)) {
      std::fprintf(to, "  %-32s with it the motion stops; %s\n", name_of(each.effect),
                   remedy_of(each.effect, plan).c_str());
      continue;
    }
    const bool is_absent = std::max({each.most.deformation, each.most.attitude, each.most.position}) == 0.0;
    std::fprintf(to, "  %-32s deformation %.1e m, attitude %.1e rad, position %.1e m%s\n",
                 name_of(each.effect), each.most.deformation, each.most.attitude, each.most.position,
                 is_absent ? "" : ("; " + remedy_of(each.effect, plan)).c_str());
  }
}

Json effects_json(const Plan& plan, const std::vector<EffectSize>& effects) {
  Json all = Json::array();
  for (const EffectSize& each : effects)
    all.push_back({{"effect", name_of(each.effect)},
                   {"deformation", each.most.deformation},
                   {"attitude", each.most.attitude},
                   {"position", each.most.position},
                   {"remedy", remedy_of(each.effect, plan)}});
  return all;
}

/// Prints the result of a run and its verdict.
void report(const RunOptions& options, const std::string& name, const Result& result, std::int64_t last,
            const Plan& plan, const Extremes& extremes) {
  const bool is_complete = result.exit_code == kExitOk;
  const bool is_to_end = is_complete || result.exit_code == kExitIncomplete;
  const double seconds = static_cast<double>(result.ticks) * plan.period;
  if (options.json) {
    const auto level = [&](const Verdict& verdict) {
      return result.verdict.tick < 0 ? Json() : Json(static_cast<int>(verdict.level));
    };
    // null: nothing is judged, or the shadow stopped
    const auto error = [&](double size) { return result.verdict.tick < 0 ? Json() : Json(size); };
    const auto known = [&](double ratio) { return extremes.is_known() ? Json(ratio) : Json(); };
    print_json({{"output", options.out.empty() && options.plot.empty() ? Json() : Json(name)},
                {"ticks", result.ticks},
                {"time", seconds},
                {"complete", is_complete},
                {"displacement_ratio", known(extremes.displacement_ratio())},
                {"spin_ratio", known(extremes.spin_ratio())},
                {"validity", level(result.verdict)},
                {"cause", result.verdict.tick < 0 ? not_judged_text(plan) : text_of(plan, result.verdict)},
                {"judged_tick", result.verdict.tick},
                {"position_error", error(result.verdict.error.position)},
                {"attitude_error", error(result.verdict.error.attitude)},
                {"deformation_error", error(result.verdict.error.deformation)},
                {"shadow_error", error(result.verdict.own_error)},
                {"scale", error(result.verdict.scale)},
                {"worst",
                 {{"validity", level(result.worst)},
                  {"tick", result.worst.tick},
                  {"cause", text_of(plan, result.worst)}}},
                {"effects", effects_json(plan, result.effects)}});
  } else if (is_to_end) {
    std::FILE* const to = is_standard_output(options.out) ? stderr : stdout;
    std::fprintf(to, "%s: %s, %.10g s\n", name.c_str(), counted(result.ticks, "tick").c_str(), seconds);
    print_verdict(to, plan, result.verdict, result.worst, result.ticks);
    print_effects(to, plan, result.effects);
  } else if (result.exit_code == kExitInterrupted) {
    const char* const verb = options.out.empty() ? "did" : "holds";
    std::fprintf(stderr, "freeflex: interrupted: %s %s %" PRId64 " of %" PRId64 " ticks\n", name.c_str(),
                 verb, result.ticks, last);
    print_verdict(stderr, plan, result.verdict, result.worst, result.ticks);
  }
  warn_beyond_limits(plan, result.worst);
}

/// Returns the file to which the run was written, or the name of the scene if there is no file.
std::string name_of(const RunOptions& options, const Plan& plan, const RunOutput& output, bool is_partial) {
  if (options.out.empty()) return options.plot.empty() ? plan.name : options.plot;
  return is_partial || is_standard_output(options.out) ? output.working_path() : options.out;
}

/// Closes the output, draws the picture, prints the result and its verdict.
int finish(const RunOptions& options, const Plan& plan, const Commands& commands, std::int64_t last,
           RunOutput& output, Result& result, const Extremes& extremes, const MotionPlot* plot) {
  const bool is_piped = is_standard_output(options.out);
  const bool is_interrupt = result.exit_code == kExitInterrupted;
  if (!result.error.empty())
    return print_error(result.error + (is_piped ? "; the table ends there" : "; nothing was written")),
           result.exit_code;
  if (const std::string error = output.close(is_interrupt); !error.empty()) {
    // an error of standard output is not printed here, because every command prints such an error when it
    // ends
    const std::optional<std::int64_t> kept = output.kept_tick();
    if (!is_piped && !kept) print_error(error);
    if (!kept) return kExitDiffers;
    print_error(error + "; the file is kept and contains the run up to tick " + std::to_string(*kept) +
                " of " + std::to_string(last) + "; make room and run again, or use it as it is");
    result.exit_code = kExitDiffers;
    result.ticks = *kept;
  }
  // the picture is also drawn if the run did not reach its end
  const std::string plot_error = plot != nullptr ? plot->write(options.plot) : std::string();
  if (!plot_error.empty() && options.out.empty()) return print_error(plot_error), kExitDiffers;
  const std::string name = name_of(options, plan, output, result.exit_code != kExitOk);
  if (result.exit_code == kExitOk && !commands.loss.empty()) {
    print_error("the log is incomplete: " + commands.loss + "; the run ends at tick " +
                std::to_string(result.ticks) + ", the last tick whose commands are all known");
    result.exit_code = kExitIncomplete;
  }
  report(options, name, result, last, plan, extremes);
  if (!plot_error.empty()) return print_error(plot_error), kExitDiffers;
  return result.exit_code;
}

/// Makes the explanation of a motion from the scene of its plan. If this is not possible, prints the reason
/// and returns false.
bool explain(const RunOptions& options, const Plan& plan, std::optional<Explanation>& explanation) {
  if (io::is_plan_file(options.input))
    return print_error("--explain needs the scene, from which it makes other plans; name the scene"), false;
  if (plan.verdict.shadows.empty())
    return print_error("--explain has nothing to compare with, because " + not_judged_text(plan)), false;
  io::SceneResult read = io::read_scene(options.input, options.settings);
  std::optional<Structure> structure;
  if (read.scene) structure = build_structure(*read.scene, read.faults);
  if (!structure) return print_error("the scene cannot be read again"), false;
  if (options.rate > 0.0) read.scene->rate = options.rate;
  explanation.emplace(*read.scene, *structure, plan);
  return true;
}

int run(const CLI::App& command, const RunOptions& options) {
  const std::string idle = find_idle_option(command, options);
  if (!idle.empty()) return print_error(idle), kExitUsage;
  for (const std::string& written : {options.out, options.plot})
    if (!options.log.empty() && would_overwrite(options.log, written)) return kExitUsage;
  const std::optional<Plan> plan =
      load_or_explain(options.input, options.rate, {options.out, options.plot}, options.settings);
  if (!plan || (!options.out.empty() && !has_states(*plan, options.out))) return kExitUsage;
  std::optional<Explanation> explanation;
  if (options.explains && !explain(options, *plan, explanation)) return kExitUsage;
  Commands commands;
  if (!options.log.empty()) {
    if (const int exit_code = open_commands(options, *plan, commands); exit_code != kExitOk) return exit_code;
  }
  const std::optional<std::int64_t> last = last_tick(options, *plan, commands);
  if (!last) return kExitUsage;

  // from now on, an interrupt leaves the run so far in NAME.partial
  if (is_interrupted()) return std::fputs(kInterrupted, stderr), kExitInterrupted;
  const std::unique_ptr<RunOutput> output =
      make_run_output(*plan, options.input, options.prefix, options.out);
  Result result;
  Extremes extremes(*plan);
  std::optional<MotionPlot> plot;
  if (!options.plot.empty()) plot.emplace(*plan);
  if (!output->has_error())
    result = simulate(*plan, commands, *last, *output, extremes, plot ? &*plot : nullptr,
                      explanation ? &*explanation : nullptr);
  if (explanation) result.effects = explanation->effects();
  return finish(options, *plan, commands, *last, *output, result, extremes, plot ? &*plot : nullptr);
}

}  // namespace

void add_run(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command = app.add_subcommand("run", "runs a scene or plan without the bus, as fast as possible");
  command->add_option("SCENE", options->input, "scene or plan file")->required();
  add_settings(*command, options->settings);
  command->add_option("--log", options->log, "LCM log whose commands are applied at their recorded ticks")
      ->check(file_name())
      ->type_name("FILE");
  command->add_option("--session", options->session, "session of that log, if it contains several")
      ->check(whole_number(0, kMost<std::int64_t>))
      ->type_name("N");
  command->add_option("--until", options->until, "simulated time to stop at [s], to the nearest tick")
      ->check(must_be("a number >= 0 [s]", [](double time) { return time >= 0.0 && std::isfinite(time); }))
      ->type_name("S");
  command->add_option("--rate", options->rate, "ticks per simulated second [Hz], instead of the scene's rate")
      ->check(rate_in_hertz())
      ->type_name("HZ");
  command->add_option("--out", options->out, std::string("what to write: ") + kOutputs)
      ->check([](const std::string& path) {
        return is_output(path) ? std::string() : "the value is '" + path + "', but must be " + kOutputs;
      })
      ->type_name("FILE");
  command->add_option("--plot", options->plot, std::string("curves over time: ") + kPictures)
      ->check([](const std::string& path) {
        return is_picture(path) ? std::string() : "the value is '" + path + "', but must be " + kPictures;
      })
      ->type_name("FILE");
  command->add_option("--prefix", options->prefix, "first part of the channel names")
      ->check(channel_prefix())
      ->type_name("NAME")
      ->capture_default_str();
  command->add_flag(
      "--explain", options->explains,
      "which effects the motion lacks, in metres: runs it on better plans too, some ten times as long");
  command->add_flag("--json", options->json, "one JSON object on standard output");
  command->footer(kRunFooter);
  command->callback([options, command, &exit_code] { exit_code = run(*command, *options); });
}

}  // namespace freeflex::tools
