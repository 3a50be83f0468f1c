#include "tools/bus/replay.hpp"

#include <algorithm>
#include <bit>
#include <cinttypes>
#include <cstdio>

#include "core/limits.hpp"
#include "core/motion.hpp"
#include "core/plan/file/plan_bytes.hpp"
#include "core/plan/rungs/rates.hpp"
#include "service/io/wire/decode.hpp"
#include "service/io/wire/outbound.hpp"
#include "tools/bus/recording.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

using freeflex_msgs::applied_t;
using freeflex_msgs::state_t;
using Result = ReplayOutcome::Result;

std::string exact(double value) {
  char text[64];
  std::snprintf(text, sizeof text, "%.17g (%016" PRIx64 ")", value, std::bit_cast<std::uint64_t>(value));
  return text;
}

/// Returns the first coordinate in which the bits of two states differ.
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
  if (recorded.num_wheels != replayed.num_wheels) {
    return Difference{recorded.tick, "num_wheels", std::to_string(recorded.num_wheels),
                      std::to_string(replayed.num_wheels)};
  }
  const auto n = static_cast<std::size_t>(recorded.num_elastic);
  const auto num_wheels = static_cast<std::size_t>(recorded.num_wheels);
  std::optional<Difference> found = values("time", &recorded.time, &replayed.time, 1);
  if (!found) found = values("position", recorded.position, replayed.position, 3);
  if (!found) found = values("attitude", recorded.attitude, replayed.attitude, 4);
  if (!found) found = values("velocity", recorded.velocity, replayed.velocity, 3);
  if (!found) found = values("angular_velocity", recorded.angular_velocity, replayed.angular_velocity, 3);
  if (!found) found = values("angular_momentum", recorded.angular_momentum, replayed.angular_momentum, 3);
  if (!found) found = values("q", recorded.q.data(), replayed.q.data(), n);
  if (!found) found = values("q_dot", recorded.q_dot.data(), replayed.q_dot.data(), n);
  if (!found) {
    found =
        values("wheel_momentum", recorded.wheel_momentum.data(), replayed.wheel_momentum.data(), num_wheels);
  }
  return found;
}

std::string slot_text(const std::string& sender, std::int32_t slot, std::int64_t sequence) {
  return printable(sender) + " slot " + std::to_string(slot) + " sequence " + std::to_string(sequence);
}

/// Compares the slots that the recording reports as ended at a tick with the slots that the step ended.
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

/// Simulates a plan with the commands of a recording.
class Replay {
 public:
  /// \param outcome  contains the warnings so far
  Replay(const Plan& plan, io::LogReader& log, const RecordedSession& session, ReplayOutcome outcome)
      : plan_(plan),
        log_(log),
        session_(session),
        feed_(log, session, plan),
        motion_(plan, session.verdicts.empty() ? kMotionAlone : Watch::kVerdict),
        outcome_(std::move(outcome)) {}

  ReplayOutcome run() {
    Progress progress("replay");
    const std::int64_t last_tick = session_.states.back().tick;
    for (const StateRecord& record : session_.states) {
      while (is_identical() && (motion_.tick() != record.tick || motion_.epoch() != record.epoch)) {
        advance(record);
        progress.update(static_cast<double>(motion_.tick()) /
                        static_cast<double>(std::max<std::int64_t>(1, last_tick)));
      }
      if (is_identical()) check(record);
      if (!is_identical()) return outcome_;
    }
    count_rest();
    return outcome_;
  }

 private:
  const State& state() const { return motion_.state(); }
  bool is_identical() const { return outcome_.result == Result::kIdentical; }
  void differ(Difference difference) {
    outcome_.result = Result::kDiffers;
    outcome_.difference = std::move(difference);
  }
  void fail(const std::string& error) {
    outcome_.result = Result::kIncomplete;
    outcome_.error = "the log is incomplete: " + error;
  }

  /// Executes one reset or one tick on the way to a recorded state.
  void advance(const StateRecord& target) {
    if (is_interrupted()) {
      outcome_.result = Result::kStopped;
      outcome_.error = "the replay was interrupted at tick " + std::to_string(motion_.tick());
      return;
    }
    if (feed_.next_kind(motion_.tick()) == applied_t::RESET) {
      feed_.take_reset();
      motion_.reset();
      return;
    }
    const std::int64_t tick = motion_.tick();
    if (tick > target.tick || motion_.epoch() > target.epoch) {
      return differ({target.tick, "epoch", std::to_string(target.epoch), std::to_string(motion_.epoch())});
    }
    const std::string error = feed_.take_commands(tick, commands_, ended_);
    if (!error.empty()) return fail(error);
    const StepReport& report = motion_.advance(commands_);
    outcome_.num_commands += static_cast<std::int64_t>(commands_.size());
    if (report.status != StepStatus::kOk) {
      if (feed_.next_kind(tick) == applied_t::RESET) return;
      return differ({tick + 1, "state", "finite", "not finite, so the step gives up"});
    }
    if (std::optional<Difference> found = compare_ends(tick, ended_, report))
      return differ(std::move(*found));
    check_verdict();
  }

  /// Compares the verdicts on the present state with the recorded ones.
  void check_verdict() {
    const Verdict& verdict = motion_.verdict();
    const std::pair now(motion_.epoch(), motion_.tick());
    for (; next_verdict_ < session_.verdicts.size(); ++next_verdict_) {
      const VerdictRecord& record = session_.verdicts[next_verdict_];
      if (std::pair(record.epoch, record.tick) > now) return;
      if (std::pair(record.epoch, record.tick) < now || verdict.tick != record.tick) continue;
      const std::array replayed{verdict.error.position, verdict.error.attitude, verdict.error.deformation,
                                verdict.scale};
      static constexpr std::array kNames{"position_error", "attitude_error", "deformation_error",
                                         "error_scale"};
      for (std::size_t k = 0; k < replayed.size(); ++k)
        if (std::bit_cast<std::uint64_t>(replayed[k]) != std::bit_cast<std::uint64_t>(record.values[k]))
          return differ({record.tick, kNames[k], exact(record.values[k]), exact(replayed[k])});
      if (static_cast<std::int32_t>(verdict.level) != record.validity)
        return differ({record.tick, "validity", std::to_string(record.validity),
                       std::to_string(static_cast<std::int32_t>(verdict.level))});
      ++outcome_.num_verdicts;
    }
  }

  void check(const StateRecord& record) {
    io::LogEvent event;
    state_t recorded;
    if (!log_.read_at(record.offset, event) || !io::decode_message(event.bytes, recorded)) {
      return fail("the state at byte " + std::to_string(record.offset) + " cannot be read again");
    }
    io::Stamp stamp;
    stamp.applied_count = feed_.num_taken();
    if (std::optional<Difference> found = compare(recorded, io::make_state_message(plan_, state(), stamp))) {
      return differ(std::move(*found));
    }
    outcome_.ticks = record.tick;
    ++outcome_.num_states;
  }

  /// Adds the numbers of messages that are not compared, and warnings about messages that are missing in the
  /// log and about records after the last state.
  void count_rest() {
    static constexpr std::array kBeside{kPointsChannel, kLoadsChannel};
    for (const std::size_t channel : kBeside)
      if (const std::size_t count = session_.pages[channel].size(); count > 0)
        outcome_.not_compared.push_back(counted(static_cast<std::int64_t>(count), "message") + " of " +
                                        (io::kEncoders[channel].suffix + 1));
    outcome_.losses = find_losses(session_, plan_);
    for (const Loss& loss : outcome_.losses)
      if (loss.num_ticks > 0) outcome_.warn(describe(loss, session_.unsent));
    if (const std::int64_t num_failed = session_.unsent.failed.size(); num_failed > 0)
      outcome_.warn(counted(num_failed, "message") +
                    " of any channel could not be sent by the daemon (sends_failed)");
    const std::int64_t num_left = static_cast<std::int64_t>(session_.applied.size()) - feed_.num_taken();
    if (num_left > 0)
      outcome_.warn(counted(num_left, "APPLIED event") + " after the last state, of tick " +
                    std::to_string(outcome_.ticks) + ", changed nothing that could be compared");
  }

  const Plan& plan_;
  io::LogReader& log_;
  const RecordedSession& session_;
  CommandFeed feed_;
  Motion motion_;
  std::size_t next_verdict_ = 0;  // of the recorded verdicts
  std::vector<ForceCommand> commands_;
  std::vector<applied_t> ended_;
  ReplayOutcome outcome_;
};

ReplayOutcome no_answer(Result result, const std::string& error) {
  ReplayOutcome outcome;
  outcome.result = result;
  outcome.error = error;
  return outcome;
}
ReplayOutcome refuse(const std::string& error) { return no_answer(Result::kError, error); }
ReplayOutcome incomplete(const std::string& error) {
  return no_answer(Result::kIncomplete, "the log is incomplete: " + error);
}

/// Returns the plan of the recording, at the recorded rate. If there is no plan, sets `outcome` to the reason
/// and returns nullopt.
std::optional<Plan> find_plan(const ReplayRequest& request, const RecordedSession& session,
                              ReplayOutcome& outcome) {
  const std::string path = request.plan.empty() ? session.plan_file : request.plan;
  if (path.empty()) {
    outcome = refuse("the log holds no " + request.prefix + channels::kScene +
                     " that names the plan; give the plan with --plan");
    return std::nullopt;
  }
  std::optional<Plan> plan = load_or_explain(path, 0.0);
  if (!plan) {
    outcome = refuse(path +
                     " is not a plan that this release reads; give the recorded one with --plan, or replay "
                     "with the release that "
                     "made the recording");
    return std::nullopt;
  }
  if (!session.plan_fingerprint) {
    outcome.warn("the log does not name its plan, which therefore is not compared with " + path);
    return plan;
  }
  // a damaged log may give a rate that no scene can have
  const bool has_rate = session.rate >= kLeastRate && session.rate <= kMostRate;
  if (plan_fingerprint(*plan) != *session.plan_fingerprint && has_rate) set_rate(*plan, session.rate);
  if (plan_fingerprint(*plan) != *session.plan_fingerprint) {
    outcome = refuse(
        path + ": its plan has fingerprint " + fingerprint_text(plan_fingerprint(*plan)) +
        ", but the recorded one has " + fingerprint_text(*session.plan_fingerprint) +
        "; the scene was changed, or the plan was set up on another machine or by another release. Replay "
        "with the recorded plan and the release that made the recording; to be independent of "
        "the machine, record from a plan ('freeflex compile')");
    return std::nullopt;
  }
  return plan;
}

}  // namespace

ReplayOutcome replay(const ReplayRequest& request) {
  io::LogReader log(request.log);
  if (!log.error().empty()) return refuse(log.error());
  Recording recording = [&] {
    const Progress progress("reading");
    return read_recording(log, request.prefix);
  }();
  if (!recording.error.empty()) return refuse(recording.error);
  std::string error;
  RecordedSession* const session = choose_session(recording, request.session, error);
  if (session == nullptr && recording.sessions.empty() && !recording.damage.empty())
    return incomplete(joined(recording.damage, error));
  if (session == nullptr) return refuse(joined(recording.damage, error));
  const std::string loss = joined(recording.damage, cut_at_gap(*session));
  if (const std::string flaw = find_flaw(*session); !flaw.empty()) return incomplete(joined(loss, flaw));
  if (session->states.empty())
    return incomplete(joined(loss, "it holds no " + request.prefix + channels::kState +
                                       (loss.empty() ? "" : " up to which all commands are known")));
  ReplayOutcome outcome;
  outcome.warning = recording.warning;
  const std::optional<Plan> plan = find_plan(request, *session, outcome);
  if (!plan) {
    if (!loss.empty()) outcome.warn(loss);
    return outcome;
  }
  const std::string time_flaw = find_time_flaw(*session, plan->period);
  if (!time_flaw.empty()) return incomplete(joined(loss, time_flaw));
  // the index is complete, so from now on records are read by offset
  outcome = Replay(*plan, log, *session, std::move(outcome)).run();
  if (loss.empty()) return outcome;
  if (outcome.result != Result::kIdentical) {
    outcome.warn(loss);
    return outcome;
  }
  outcome.result = Result::kIncomplete;
  outcome.error =
      "the log is incomplete: " + loss + "; the motion is known up to tick " + std::to_string(outcome.ticks);
  return outcome;
}

}  // namespace freeflex::tools
