#include "tools/bus/recording.hpp"

#include <algorithm>
#include <cstddef>
#include <tuple>
#include <unordered_map>

#include "freeflex_msgs/loads_t.hpp"
#include "freeflex_msgs/points_t.hpp"
#include "freeflex_msgs/scene_t.hpp"
#include "freeflex_msgs/state_t.hpp"
#include "messages/channels.hpp"
#include "service/io/wire/decode.hpp"
#include "service/io/wire/versions.hpp"
#include "tools/bus/strays.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

using freeflex_msgs::applied_t;

constexpr std::size_t kMostNamed = 20;  // largest number of sessions that a message lists

/// Builds the index of a log.
class Indexer {
 public:
  Indexer(Recording& recording, const std::string& prefix)
      : recording_(recording),
        applied_(prefix + channels::kApplied),
        state_(prefix + channels::kState),
        scene_(prefix + channels::kScene),
        points_(prefix + channels::kPoints),
        loads_(prefix + channels::kLoads),
        status_(prefix + channels::kStatus),
        strays_(prefix) {}

  /// Adds a message to the index, but skips a message that does not decode. If the message is of another
  /// version, sets the error and returns false.
  bool take(const io::LogEvent& event);
  /// Removes sessions that have nothing to replay or exist only because a number is damaged, and sets damage
  /// and warning.
  void finish(const std::string& damage_of_file);

 private:
  /// Counts messages that do not decode.
  struct Unread {
    std::int64_t count = 0;
    std::string first;
    void take(const io::LogEvent& event);
    std::string text() const;
  };
  bool read(const io::LogEvent& event);
  RecordedSession& session_of(std::int64_t session);
  RecordedSession& own_session_of(const io::LogEvent& event, std::int64_t session);
  template <class Message>
  bool take_pages(const io::LogEvent& event, std::size_t channel);
  bool take_other(const io::LogEvent& event);

  Recording& recording_;
  std::string applied_, state_, scene_, points_, loads_, status_;  // channel names
  Unread of_motion_, of_others_;  // unread messages on APPLIED, STATE, SCENE, and on POINTS, LOADS, STATUS
  StrayFinder strays_;
  std::unordered_map<std::int64_t, std::size_t> indices_;  // index of each session in the recording
};

RecordedSession& Indexer::own_session_of(const io::LogEvent& event, std::int64_t session) {
  strays_.take_own(event, session);
  return session_of(session);
}

RecordedSession& Indexer::session_of(std::int64_t session) {
  const auto [found, is_new] = indices_.try_emplace(session, recording_.sessions.size());
  if (is_new) recording_.sessions.emplace_back().session = session;
  return recording_.sessions[found->second];
}

/// Records a contradiction if a message has a value that differs from the value in earlier messages.
void expect_one(const io::LogEvent& event, const std::string& what, const std::string& found,
                const std::string& before, RecordedSession& session) {
  if (found == before || !session.contradiction.empty()) return;
  session.contradiction = "the message on " + event.channel + " at byte " + std::to_string(event.offset) +
                          " names the " + what + " " + printable(found) +
                          ", but the messages before it "
                          "name " +
                          printable(before) + "; a session must have one " + what;
}

void take_fingerprint(const io::LogEvent& event, std::int64_t fingerprint, RecordedSession& session) {
  const auto found = static_cast<std::uint64_t>(fingerprint);
  if (!session.plan_fingerprint) session.plan_fingerprint = found;
  if (found == *session.plan_fingerprint) return;
  expect_one(event, "plan", fingerprint_text(found), fingerprint_text(*session.plan_fingerprint), session);
}

void take_scene(const io::LogEvent& event, const freeflex_msgs::scene_t& message, RecordedSession& session) {
  if (!session.has_scene) {
    session.has_scene = true;
    session.plan_file = message.plan_file;
    session.rate = message.rate;
  }
  expect_one(event, "file", message.plan_file, session.plan_file, session);
  expect_one(event, "rate", format_text("%.17g Hz", message.rate), format_text("%.17g Hz", session.rate),
             session);
  take_fingerprint(event, message.plan_fingerprint, session);
}

void Indexer::Unread::take(const io::LogEvent& event) {
  if (count++ == 0)
    first = "the message on " + event.channel + " at byte " + std::to_string(event.offset) + " is " +
            io::explain_unread(event.bytes);
}

std::string Indexer::Unread::text() const {
  return count > 1 ? first + ", and so are " + counted(count - 1, "other") : first;
}

bool Indexer::take(const io::LogEvent& event) {
  if (read(event)) return true;
  of_motion_.take(event);
  if (io::find_earlier(event.bytes) == nullptr) return true;
  recording_.error = of_motion_.first + "; replay it with the release that recorded it";
  return false;
}

bool Indexer::read(const io::LogEvent& event) {
  if (event.channel == applied_) {
    applied_t message;
    if (!io::decode_message(event.bytes, message)) return false;
    RecordedSession& session = own_session_of(event, message.session);
    session.applied.push_back({message.applied_sequence, message.tick, message.kind, event.offset});
    take_fingerprint(event, message.plan_fingerprint, session);
  } else if (event.channel == state_) {
    freeflex_msgs::state_t message;
    if (!io::decode_message(event.bytes, message)) return false;
    RecordedSession& session = own_session_of(event, message.session);
    session.states.push_back(
        {message.epoch, message.tick, message.time, message.applied_count, event.offset});
    session.pages[kStateChannel].push_back({message.tick, message.epoch, 0, 1});
  } else if (event.channel == scene_) {
    freeflex_msgs::scene_t message;
    if (!io::decode_message(event.bytes, message)) return false;
    take_scene(event, message, own_session_of(event, message.session));
  } else if (!take_other(event)) {
    strays_.take_foreign(event);
  }
  return true;
}

template <class Message>
bool Indexer::take_pages(const io::LogEvent& event, std::size_t channel) {
  Message message;
  if (!io::decode_message(event.bytes, message)) return false;
  session_of(message.session)
      .pages[channel]
      .push_back({message.tick, message.epoch, message.page, message.num_pages});
  return true;
}

/// Takes messages on POINTS, LOADS and STATUS, on which a motion does not depend. Returns false for any other
/// channel.
bool Indexer::take_other(const io::LogEvent& event) {
  bool is_read = false;
  if (event.channel == points_) {
    is_read = take_pages<freeflex_msgs::points_t>(event, kPointsChannel);
  } else if (event.channel == loads_) {
    is_read = take_pages<freeflex_msgs::loads_t>(event, kLoadsChannel);
  } else if (event.channel == status_) {
    freeflex_msgs::status_t status;
    is_read = io::decode_message(event.bytes, status);
    if (is_read) {
      RecordedSession& session = session_of(status.session);
      session.unsent.take(status);
      if (status.validity != freeflex_msgs::status_t::NOT_JUDGED)
        session.verdicts.push_back(
            {status.epoch,
             status.judged_tick,
             status.validity,
             {status.position_error, status.attitude_error, status.deformation_error, status.error_scale}});
    }
  } else {
    return false;
  }
  if (!is_read) of_others_.take(event);
  return true;
}

void Indexer::finish(const std::string& damage_of_file) {
  recording_.damage = joined(damage_of_file, of_motion_.text());
  const std::vector<StrayFinder::Stray> strays = strays_.find();
  if (!strays.empty()) {
    recording_.damage = joined(recording_.damage, strays.front().text);
    if (strays.size() > 1)
      recording_.damage += ", and " + counted(static_cast<std::int64_t>(strays.size()) - 1, "message") +
                           (strays.size() == 2 ? " more is" : " more are") + " damaged in the same way";
  }
  std::erase_if(recording_.sessions, [&](const RecordedSession& session) {
    const auto is_stray = [&](const StrayFinder::Stray& stray) { return stray.session == session.session; };
    return (session.applied.empty() && session.states.empty() && !session.has_scene) ||
           std::any_of(strays.begin(), strays.end(), is_stray);
  });
  recording_.warning = of_others_.text();
}

}  // namespace

Recording read_recording(io::LogReader& log, const std::string& prefix) {
  Recording recording;
  Indexer indexer(recording, prefix);
  io::LogEvent event;
  while (log.next(event))
    if (!indexer.take(event)) return recording;
  recording.error = log.error();
  indexer.finish(log.damage());
  for (RecordedSession& session : recording.sessions) {
    std::stable_sort(session.applied.begin(), session.applied.end(),
                     [](const AppliedRecord& a, const AppliedRecord& b) { return a.sequence < b.sequence; });
    // removes repeated records, because the network may deliver a packet twice
    const auto repeats = std::unique(
        session.applied.begin(), session.applied.end(), [](const AppliedRecord& a, const AppliedRecord& b) {
          return std::tie(a.sequence, a.tick, a.kind) == std::tie(b.sequence, b.tick, b.kind);
        });
    session.applied.erase(repeats, session.applied.end());
    std::ranges::stable_sort(session.verdicts, {},
                             [](const VerdictRecord& each) { return std::pair(each.epoch, each.tick); });
    std::stable_sort(session.states.begin(), session.states.end(),
                     [](const StateRecord& a, const StateRecord& b) {
                       return std::tie(a.epoch, a.tick) < std::tie(b.epoch, b.tick);
                     });
  }
  return recording;
}

std::string joined(const std::string& a, const std::string& b) {
  return a.empty() || b.empty() ? a + b : a + "; " + b;
}

RecordedSession* choose_session(Recording& recording, std::optional<std::int64_t> session,
                                std::string& error) {
  auto& sessions = recording.sessions;
  if (sessions.empty()) {
    error = "the log contains no message of a session; check --prefix";
    return nullptr;
  }
  if (!session && sessions.size() == 1) return &sessions.front();
  const auto chosen = std::find_if(sessions.begin(), sessions.end(), [&](const RecordedSession& candidate) {
    return candidate.session == session;
  });
  if (chosen != sessions.end()) return &*chosen;
  std::vector<std::string> known;
  known.reserve(sessions.size());
  for (const RecordedSession& candidate : sessions) known.push_back(std::to_string(candidate.session));
  error = session ? "the log holds no session " + std::to_string(*session) + "; it holds "
                  : "the log contains several sessions; choose one with --session: ";
  error += listed(known, kMostNamed);
  return nullptr;
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
      return "the APPLIED event with sequence " + std::to_string(record.sequence) + " is damaged";
    // a cleared slot is recorded as a command without loads
    if (kind == applied_t::FORCE || kind == applied_t::CLEARED) {
      const io::Admission admission = io::from_message(message.command, names_, commands.emplace_back());
      if (admission.reason != io::Reason::kAccepted) {
        return "the APPLIED event with sequence " + std::to_string(record.sequence) +
               " does not fit the plan: " + admission.text.data();
      }
    } else {
      ended.push_back(message);
    }
  }
  if (next_tick() && *next_tick() < tick) {
    return "the APPLIED event with sequence " + std::to_string(session_.applied[next_].sequence) +
           " is for tick " + std::to_string(*next_tick()) + ", which is over";
  }
  return {};
}

}  // namespace freeflex::tools
