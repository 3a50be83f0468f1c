#include "tools/bus/recording.hpp"

#include <algorithm>
#include <tuple>

#include "messages/channels.hpp"
#include "service/io/wire/decode.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

using freeflex_msgs::applied_t;

RecordedSession& session_of(Recording& recording, std::int64_t session) {
  for (RecordedSession& known : recording.sessions) {
    if (known.session == session) return known;
  }
  RecordedSession& added = recording.sessions.emplace_back();
  added.session = session;
  return added;
}

/// All messages of a session name one plan.
void take_fingerprint(const io::LogEvent& event, std::int64_t fingerprint, RecordedSession& session) {
  const auto found = static_cast<std::uint64_t>(fingerprint);
  if (!session.plan_fingerprint) session.plan_fingerprint = found;
  if (*session.plan_fingerprint == found || !session.contradiction.empty()) return;
  session.contradiction = "the message on " + event.channel + " at byte " + std::to_string(event.offset) +
                          " names the plan " + fingerprint_text(found) + ", those before it " +
                          fingerprint_text(*session.plan_fingerprint) + "; a session has one plan";
}

/// Takes one message into the index. False when it does not decode.
bool index_event(const io::LogEvent& event, const std::string& prefix, Recording& recording) {
  if (event.channel == prefix + channels::kApplied) {
    applied_t message;
    if (!io::decode_message(event.bytes, message)) return false;
    RecordedSession& session = session_of(recording, message.session);
    session.applied.push_back({message.applied_sequence, message.tick, message.kind, event.offset});
    take_fingerprint(event, message.plan_fingerprint, session);
  } else if (event.channel == prefix + channels::kState) {
    freeflex_msgs::state_t message;
    if (!io::decode_message(event.bytes, message)) return false;
    session_of(recording, message.session)
        .states.push_back({message.epoch, message.tick, message.applied_count, event.offset});
  } else if (event.channel == prefix + channels::kScene) {
    freeflex_msgs::scene_t message;
    if (!io::decode_message(event.bytes, message)) return false;
    RecordedSession& session = session_of(recording, message.session);
    session.scene_name = message.name;
    session.plan_file = message.plan_file;
    session.rate = message.rate;
    take_fingerprint(event, message.plan_fingerprint, session);
  }
  return true;
}

}  // namespace

Recording read_recording(io::LogReader& log, const std::string& prefix) {
  Recording recording;
  io::LogEvent event;
  while (log.next(event)) {
    if (!index_event(event, prefix, recording)) {
      recording.error = "message on " + event.channel + " at byte " + std::to_string(event.offset) +
                        " is damaged or of another version";
      return recording;
    }
  }
  recording.error = log.error();
  recording.is_readable = log.error().empty() || log.is_damaged();
  for (RecordedSession& session : recording.sessions) {
    std::stable_sort(session.applied.begin(), session.applied.end(),
                     [](const AppliedRecord& a, const AppliedRecord& b) { return a.sequence < b.sequence; });
    // the network may deliver a packet twice
    const auto repeats = std::unique(
        session.applied.begin(), session.applied.end(), [](const AppliedRecord& a, const AppliedRecord& b) {
          return std::tie(a.sequence, a.tick, a.kind) == std::tie(b.sequence, b.tick, b.kind);
        });
    session.applied.erase(repeats, session.applied.end());
    std::stable_sort(session.states.begin(), session.states.end(),
                     [](const StateRecord& a, const StateRecord& b) {
                       return std::tie(a.epoch, a.tick) < std::tie(b.epoch, b.tick);
                     });
  }
  return recording;
}

const RecordedSession* choose_session(const Recording& recording, std::optional<std::int64_t> session,
                                      std::string& error) {
  std::string known;
  for (const RecordedSession& candidate : recording.sessions) {
    if (session && candidate.session == *session) return &candidate;
    known += (known.empty() ? "" : ", ") + std::to_string(candidate.session);
  }
  if (recording.sessions.empty()) {
    error = "the log holds no message of a session (other channel prefix? see --prefix)";
  } else if (session) {
    error = "the log holds no session " + std::to_string(*session) + "; it holds " + known;
  } else if (recording.sessions.size() > 1) {
    error = "the log holds several sessions, choose one with --session: " + known;
  } else {
    return &recording.sessions.front();
  }
  return nullptr;
}

std::string find_flaw(const RecordedSession& session) {
  if (!session.contradiction.empty()) return session.contradiction;
  std::int64_t expected = 0;
  for (const AppliedRecord& record : session.applied) {
    if (record.sequence < expected) {
      return "applied sequence " + std::to_string(record.sequence) + " occurs twice with different content";
    }
    if (record.sequence > expected) return "applied sequence " + std::to_string(expected) + " missing";
    ++expected;
  }
  for (const StateRecord& state : session.states) {
    if (state.applied_count > expected) {
      return "applied sequence " + std::to_string(expected) + " missing: the state at tick " +
             std::to_string(state.tick) + " contains " + std::to_string(state.applied_count) +
             " applied commands";
    }
  }
  return {};
}

CommandFeed::CommandFeed(io::LogReader& log, const RecordedSession& session, const Plan& plan)
    : log_(log), session_(session) {
  io::fill_name_table(plan, names_);
}

std::optional<std::int64_t> CommandFeed::next_tick() const {
  if (next_ == session_.applied.size()) return std::nullopt;
  return session_.applied[next_].tick;
}

std::int32_t CommandFeed::next_kind(std::int64_t tick) const {
  return next_tick() == tick ? session_.applied[next_].kind : 0;
}

std::string CommandFeed::take_commands(std::int64_t tick, std::vector<ForceCommand>& commands,
                                       std::vector<applied_t>& ended) {
  commands.clear();
  ended.clear();
  for (std::int32_t kind = next_kind(tick); kind != 0 && kind != applied_t::RESET; kind = next_kind(tick)) {
    io::LogEvent event;
    applied_t message;
    const AppliedRecord& record = session_.applied[next_++];
    if (!log_.read_at(record.offset, event)) return log_.error();
    if (!io::decode_message(event.bytes, message))
      return "applied sequence " + std::to_string(record.sequence) + " is damaged";
    if (kind == applied_t::FORCE) {
      const io::Admission admission = io::from_message(message.command, names_, commands.emplace_back());
      if (admission.reason != io::Reason::kAccepted) {
        return "applied sequence " + std::to_string(record.sequence) +
               " does not fit the plan: " + admission.text.data();
      }
    } else if (kind == applied_t::EXPIRED || kind == applied_t::LEASE_LOST) {
      ended.push_back(message);
    } else {
      return "applied sequence " + std::to_string(record.sequence) + " is of unknown kind " +
             std::to_string(kind);
    }
  }
  if (next_tick() && *next_tick() < tick) {
    return "applied sequence " + std::to_string(session_.applied[next_].sequence) + " is for tick " +
           std::to_string(*next_tick()) + ", which is over";
  }
  return {};
}

}  // namespace freeflex::tools
