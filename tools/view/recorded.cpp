// Converts recordings for the page. This file also contains the page itself.
#include <algorithm>
#include <cmath>
#include <string>

#include "freeflex_msgs/loads_t.hpp"
#include "freeflex_msgs/state_t.hpp"
#include "freeflex_msgs/status_t.hpp"
#include "messages/channels.hpp"
#include "service/io/wire/decode.hpp"
#include "service/io/wire/log.hpp"
#include "tools/bus/message_json.hpp"
#include "tools/bus/recording.hpp"
#include "tools/terminal/console.hpp"
#include "tools/view/live.hpp"

// the page as tools/view/page/make_page.py built it
__asm__(
    ".section .rodata\n"
    ".global freeflex_page_begin, freeflex_page_end\n"
    "freeflex_page_begin: .incbin \"" FREEFLEX_PAGE
    "\"\n"
    "freeflex_page_end:\n"
    ".previous\n");
extern "C" {
extern const char freeflex_page_begin[], freeflex_page_end[];
}

namespace freeflex::tools {
namespace {

constexpr double kMostFrames = 60.0;                             // frames per second of simulated time
constexpr std::size_t kMostMotionBytes = std::size_t{64} << 20;  // of elastic coordinates
constexpr double kMostStatuses = 5.0;                            // statuses per second of simulated time
constexpr std::string_view kDataMark = "@DATA@";

/// Collects the motion of one session for the page.
struct Motion {
  explicit Motion(const Body& body) : peaks(body) {}
  std::vector<double> clock, tick, time, position, attitude, spin, wheels;
  std::vector<float> q;
  std::vector<double> load_clock;
  std::vector<float> loads;
  ModePeaks peaks;
  Json statuses = Json::array();

  void take(const freeflex_msgs::state_t& state, const Body& body) {
    clock.push_back(static_cast<double>(state.tick) * body.plan.period);
    tick.push_back(static_cast<double>(state.tick));
    time.push_back(state.time);
    position.insert(position.end(), state.position, state.position + 3);
    attitude.insert(attitude.end(), state.attitude, state.attitude + 4);
    spin.insert(spin.end(), state.angular_velocity, state.angular_velocity + 3);
    wheels.insert(wheels.end(), state.wheel_momentum.begin(), state.wheel_momentum.end());
    wheels.resize(clock.size() * body.plan.wheels.size());
    peaks.take(state);
    for (std::size_t l = 0; l < index(body.num_modes); ++l) q.push_back(shown_coordinate(body, state, l));
  }
};

std::string base64(const std::vector<std::byte>& bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    unsigned group = 0;
    for (std::size_t j = 0; j < 3; ++j)
      group = group << 8 | (k + j < bytes.size() ? std::to_integer<unsigned>(bytes[k + j]) : 0U);
    for (std::size_t j = 0; j < 4; ++j)
      text += k + j <= bytes.size() ? kDigits[group >> (18 - 6 * j) & 63] : '=';
  }
  return text;
}

const RecordedSession* session_of(io::LogReader& log, const std::string& prefix,
                                  std::optional<std::int64_t> session, Recording& recording,
                                  std::string& error) {
  recording = read_recording(log, prefix);
  error = recording.error;
  const RecordedSession* chosen = error.empty() ? choose_session(recording, session, error) : nullptr;
  if (chosen != nullptr && !chosen->contradiction.empty()) {
    error = "the log contradicts itself, because " + chosen->contradiction;
    chosen = nullptr;
  }
  if (chosen == nullptr) error = joined(recording.damage, error);
  return chosen;
}

/// Returns the states that are shown: at most kMostFrames per second of simulated time, and at most as many
/// as fit in kMostMotionBytes.
std::vector<StateRecord> shown_states(const RecordedSession& session, double period, int num_modes) {
  const std::size_t of_one = sizeof(float) * index(std::max(1, num_modes));
  const double most = static_cast<double>(kMostMotionBytes) / static_cast<double>(of_one);
  const double duration =
      static_cast<double>(session.states.back().tick - session.states.front().tick) * period;
  const double interval = std::max(1.0 / kMostFrames, duration / most);
  std::vector<StateRecord> shown;
  for (const StateRecord& state : session.states) {
    const bool is_last = &state == &session.states.back();
    if (!shown.empty() && state.tick == shown.back().tick) continue;
    if (shown.empty() || is_last ||
        static_cast<double>(state.tick - shown.back().tick) * period >= interval * 0.999)
      shown.push_back(state);
  }
  return shown;
}

/// Adds LOADS and STATUS of the session to the motion.
void take_loads_and_status(const Body& body, const std::string& path, const std::string& prefix,
                           std::int64_t session, Motion& motion) {
  io::LogReader log(path);
  io::LogEvent event;
  LoadFigures figures(body);
  double last_status = -1e300;
  while (log.next(event)) {
    if (event.channel == prefix + channels::kLoads) {
      freeflex_msgs::loads_t page;
      if (!io::decode_message(event.bytes, page) || page.session != session) continue;
      const bool is_whole = figures.take(page, event.bytes.size());
      const double clock = static_cast<double>(page.tick) * body.plan.period;
      if (!is_whole || (!motion.load_clock.empty() && clock - motion.load_clock.back() < 1.0 / kMostFrames))
        continue;
      motion.load_clock.push_back(clock);
      motion.loads.insert(motion.loads.end(), figures.figures().begin(), figures.figures().end());
    } else if (event.channel == prefix + channels::kStatus) {
      freeflex_msgs::status_t status;
      if (!io::decode_message(event.bytes, status) || status.session != session) continue;
      const double clock = static_cast<double>(status.tick) * body.plan.period;
      if (clock - last_status < 1.0 / kMostStatuses) continue;
      last_status = clock;
      Json fields = decode_by_suffix(channels::kStatus, event.bytes).fields;
      fields["clock"] = clock;
      motion.statuses.push_back(std::move(fields));
    }
  }
}

}  // namespace

std::string recorded_plan(const std::string& path, const std::string& prefix,
                          std::optional<std::int64_t> session, std::string& error) {
  io::LogReader log(path);
  Recording recording;
  const RecordedSession* const chosen = session_of(log, prefix, session, recording, error);
  if (chosen == nullptr) return {};
  if (chosen->plan_file.empty())
    error = path + " contains no " + prefix + channels::kScene +
            " that names the scene; give the scene with --plan";
  return chosen->plan_file;
}

std::vector<std::byte> recorded_motion(Body& body, const std::string& path, const std::string& prefix,
                                       std::optional<std::int64_t> session, std::string& error,
                                       std::string& damage) {
  io::LogReader log(path);
  Recording recording;
  const RecordedSession* const chosen = session_of(log, prefix, session, recording, error);
  if (chosen == nullptr) return {};
  damage = recording.damage;
  if (chosen->plan_fingerprint && !take_rate(body, *chosen->plan_fingerprint, chosen->rate)) {
    error = path + " was recorded with a plan of fingerprint " + fingerprint_text(*chosen->plan_fingerprint) +
            ", but " + body.plan_file + " has " + fingerprint_text(body.fingerprint) +
            "; give the recorded scene or plan with --plan";
    return {};
  }
  if (chosen->states.empty()) {
    error = path + " contains no " + prefix + channels::kState;
    return {};
  }
  if (!chosen->plan_fingerprint)
    print_warning(path + " does not name its plan, so " + body.plan_file + " is not checked");
  Motion motion(body);
  io::LogEvent event;
  const StateRecord* before = nullptr;
  double time_before = 0.0;
  const std::vector<StateRecord> shown = shown_states(*chosen, body.plan.period, body.num_modes);
  for (const StateRecord& record : shown) {
    freeflex_msgs::state_t state;
    if (!log.read_at(record.offset, event) || !io::decode_message(event.bytes, state)) {
      error = path + ": the state at byte " + std::to_string(record.offset) + " cannot be read again";
      return {};
    }
    if (state.num_elastic != body.plan.num_elastic &&
        (body.plan.fallback.empty() || state.num_elastic != body.plan.fallback[0].num_elastic)) {
      error = path + " has a state of " + counted(state.num_elastic, "elastic coordinate") + ", but " +
              body.plan_file + " has " + std::to_string(body.plan.num_elastic) +
              "; give the recorded scene or plan with --plan";
      return {};
    }
    if (before != nullptr && before->epoch == record.epoch) {
      const double ticks = static_cast<double>(record.tick - before->tick) * body.plan.period;
      if (std::abs(state.time - time_before - ticks) > 1e-6 * ticks + 1e-9 * std::abs(state.time)) {
        error = path + " was recorded at another rate than that of " + body.plan_file + ", which is " +
                format_text("%g Hz", 1.0 / body.plan.period) +
                "; give the recorded scene or plan with --plan";
        return {};
      }
    }
    before = &record;
    time_before = state.time;
    motion.take(state, body);
  }
  take_loads_and_status(body, path, prefix, chosen->session, motion);
  Blob blob({{"statuses", std::move(motion.statuses)},
             {"modes", motion.peaks.largest()},
             {"linksPerTick", body.published_links.size()},
             {"shownStates", motion.tick.size()},
             {"allStates", chosen->states.size()}});
  blob.add("clock", motion.clock);
  blob.add("tick", motion.tick);
  blob.add("time", motion.time);
  blob.add("position", motion.position);
  blob.add("attitude", motion.attitude);
  blob.add("spin", motion.spin);
  blob.add("wheels", motion.wheels);
  blob.add("q", motion.q);
  blob.add("loadClock", motion.load_clock);
  blob.add("loads", motion.loads);
  return blob.finish();
}

std::string_view plain_page() {
  return {freeflex_page_begin, index(freeflex_page_end - freeflex_page_begin)};
}

std::string page_with(const std::vector<std::byte>& body, const std::vector<std::byte>& motion) {
  std::string page(plain_page());
  std::string data = "<script>window.freeflexData = {body: \"" + base64(body) + "\"";
  if (!motion.empty()) data += ", motion: \"" + base64(motion) + "\"";
  const std::size_t mark = page.find(kDataMark);
  if (mark != std::string::npos) page.replace(mark, kDataMark.size(), data + "};</script>");
  return page;
}

}  // namespace freeflex::tools
