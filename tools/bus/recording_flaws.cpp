// Finds contradictions in a recording before it is replayed. Most numbers of a recording follow from other
// numbers of the recording, with which they are compared.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "tools/bus/recording.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

using freeflex_msgs::applied_t;

std::string name_of(const AppliedRecord& record) {
  return "the APPLIED event with sequence " + std::to_string(record.sequence) + " at byte " +
         std::to_string(record.offset);
}
std::string name_of(const StateRecord& state) {
  return "the state at byte " + std::to_string(state.offset) + ", of tick " + std::to_string(state.tick);
}

/// The beginnings of the epochs of a session. The number of APPLIED events that a state includes gives the
/// state's epoch.
class Epochs {
 public:
  explicit Epochs(const RecordedSession& session) : begins_(1) {
    for (const AppliedRecord& record : session.applied) {
      Begin begin = begins_.back();
      if (record.kind == applied_t::RESET) begin = {begin.epoch + 1, record.tick};
      begins_.push_back(begin);
    }
  }
  std::int64_t epoch(const StateRecord& state) const { return at(state).epoch; }
  std::int64_t first_tick(const StateRecord& state) const { return at(state).tick; }

 private:
  struct Begin {
    std::int64_t epoch = 0;
    std::int64_t tick = 0;
  };
  const Begin& at(const StateRecord& state) const { return begins_[index(state.applied_count)]; }
  std::vector<Begin> begins_;
};

/// Checks that each sequence occurs once, that ticks do not decrease, and that every kind is known. Returns
/// the first error.
std::string find_applied_flaw(const RecordedSession& session) {
  std::int64_t expected = 0;
  const AppliedRecord* before = nullptr;
  for (const AppliedRecord& record : session.applied) {
    if (record.tick < 0)
      return name_of(record) + " is for tick " + std::to_string(record.tick) + ", so it is damaged";
    if (record.sequence < 0) return name_of(record) + " is damaged, because sequences count from 0";
    if (record.sequence < expected)
      return "the APPLIED event with sequence " + std::to_string(record.sequence) +
             " occurs twice with different content";
    if (record.kind < applied_t::FORCE || record.kind > applied_t::CLEARED)
      return name_of(record) + " is of unknown kind " + std::to_string(record.kind);
    if (before != nullptr && record.tick < before->tick)
      return name_of(record) + " is for tick " + std::to_string(record.tick) + ", and " + name_of(*before) +
             " for tick " + std::to_string(before->tick) + ", so one of the two ticks is damaged";
    before = &record;
    ++expected;
  }
  return {};
}

/// Checks that the APPLIED events that a state includes are for ticks before the tick of the state (a reset:
/// up to the tick of the state), and that all others are for the tick of the state or later ticks.
std::string find_order_flaw(const RecordedSession& session, const StateRecord& state) {
  const auto count = index(state.applied_count);
  const auto explain = [&](const AppliedRecord& record, const char* verb) {
    return name_of(state) + ", " + verb + " " + name_of(record) + ", for tick " +
           std::to_string(record.tick) + ", so one of the two ticks or the state's applied_count is damaged";
  };
  if (count > 0) {
    const AppliedRecord& last = session.applied[count - 1];
    // a reset takes effect at its tick, but the step that applies a command ends one tick later
    if (last.kind == applied_t::RESET ? last.tick > state.tick : last.tick >= state.tick)
      return explain(last, "includes");
  }
  if (count < session.applied.size() && session.applied[count].tick < state.tick)
    return explain(session.applied[count], "does not include");
  return {};
}

/// Returns an error if too many ticks lie between two records. Otherwise returns an empty text.
std::string find_gap(const std::string& name, std::int64_t tick, std::int64_t before) {
  if (tick - before <= kMostUnrecordedTicks) return {};
  return name + ", is " + std::to_string(tick - before) + " ticks after the record before it, but at most " +
         std::to_string(kMostUnrecordedTicks) +
         " ticks without records are replayed; its tick is damaged, or the recording did not begin at the "
         "start";
}

}  // namespace

std::string cut_at_gap(RecordedSession& session) {
  std::int64_t expected = 0;
  for (const AppliedRecord& record : session.applied) {
    if (record.sequence != expected) break;
    ++expected;
  }
  const auto num_applied = static_cast<std::int64_t>(session.applied.size());
  // a sequence that occurs twice or is below 0 is not a gap but a contradiction
  const bool has_gap = expected < num_applied && session.applied[index(expected)].sequence > expected;
  if (expected < num_applied && !has_gap) return {};
  session.applied.resize(index(expected));
  std::int64_t num_states = 0, first_tick = 0;
  std::erase_if(session.states, [&](const StateRecord& state) {
    if (state.applied_count <= expected) return false;
    if (num_states++ == 0) first_tick = state.tick;
    return true;
  });
  if (!has_gap && num_states == 0) return {};
  std::string text = "the APPLIED event with sequence " + std::to_string(expected) + " is missing, so ";
  if (has_gap) text += "the " + counted(num_applied - expected, "later APPLIED event");
  if (has_gap && num_states > 0) text += " and ";
  if (num_states > 0)
    text += "the " + counted(num_states, "state") + " that include" +
            (num_states == 1 ? "s its effect (at tick " : " its effect (the first at tick ") +
            std::to_string(first_tick) + ")";
  return text + " cannot be used";
}

std::int64_t last_known_tick(const RecordedSession& session) {
  std::int64_t last = 0;
  for (const StateRecord& state : session.states) last = std::max(last, state.tick);
  for (const AppliedRecord& applied : session.applied) last = std::max(last, applied.tick);
  return last;
}

std::string find_flaw(const RecordedSession& session) {
  if (!session.contradiction.empty()) return session.contradiction;
  if (std::string flaw = find_applied_flaw(session); !flaw.empty()) return flaw;
  const Epochs epochs(session);
  for (const StateRecord& state : session.states) {
    if (state.tick < 0 || state.applied_count < 0)
      return name_of(state) + " and with " + std::to_string(state.applied_count) +
             " APPLIED events, is damaged, because both count from 0";
    if (state.epoch != epochs.epoch(state))
      return name_of(state) + ", has epoch " + std::to_string(state.epoch) + " and includes " +
             counted(epochs.epoch(state), "reset") + ", so epoch or applied_count is damaged";
    if (std::string order = find_order_flaw(session, state); !order.empty()) return order;
  }
  return {};
}

std::string find_time_flaw(const RecordedSession& session, double period) {
  const Epochs epochs(session);
  std::int64_t before = 0;
  for (const StateRecord& state : session.states) {
    const std::int64_t first = epochs.first_tick(state);
    const double time = static_cast<double>(state.tick - first) * period;
    // if a time is wrong by less than half a tick, the comparison of states reports this error. The condition
    // is negated so that it also refuses a time that is NaN.
    if (period > 0.0 && !(std::abs(state.time - time) < 0.5 * period))
      return name_of(state) + ", has time " + format_text("%.17g s", state.time) + ", and its tick is " +
             format_text("%.17g s", time) + " after tick " + std::to_string(first) +
             ", where its epoch begins, so one of them is damaged";
    std::string gap = find_gap(name_of(state), state.tick, before);
    if (!gap.empty()) return gap;
    before = state.tick;
  }
  const std::size_t num_contained = session.states.empty() ? 0 : index(session.states.back().applied_count);
  for (std::size_t i = num_contained; i < session.applied.size(); ++i) {
    std::string gap = find_gap(name_of(session.applied[i]), session.applied[i].tick, before);
    if (!gap.empty()) return gap;
    before = session.applied[i].tick;
  }
  return {};
}

}  // namespace freeflex::tools
