#include "tools/bus/live_view.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <numeric>
#include <sstream>
#include <vector>

#include "core/error/validity.hpp"
#include "core/error/verdict.hpp"
#include "messages/channels.hpp"
#include "service/io/wire/decode.hpp"
#include "service/io/wire/outbound.hpp"
#include "service/io/wire/reason.hpp"
#include "service/io/wire/versions.hpp"
#include "tools/bus/message_json.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

// [us] two daemons publish if a STATUS of each arrives within this time
constexpr std::int64_t kTwoDaemons = 2'000'000;
// [s] time without a message after which the daemon is shown as silent; by default a daemon sends ten STATUS
// a second
constexpr double kSilent = 2.0;

constexpr std::size_t kMaxNotes = 6;
constexpr std::size_t kMaxModes = 6;
constexpr const char* kBold = "\033[1m";
constexpr const char* kAlarm = "\033[1;31m";  // bold red
constexpr const char* kPlain = "\033[0m";

double norm(const double (&v)[3]) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/// Returns a bar "##########" of at most 32 characters, whose length is proportional to the ratio of value to
/// largest.
std::string bar(double value, double largest) {
  constexpr double kWidth = 32.0;
  const double ratio = largest > 0.0 ? std::clamp(value / largest, 0.0, 1.0) : 0.0;
  return std::string(static_cast<std::size_t>(std::lround(ratio * kWidth)), '#');
}

std::string bold(const std::string& text) { return kBold + text + kPlain; }

/// Returns the text of a count that should stay zero, highlighted if it is not zero.
std::string alarming(const char* name, std::int64_t count) {
  const std::string text = std::string(name) + " " + std::to_string(count);
  return count == 0 ? text : kAlarm + text + kPlain;
}

std::string vector_row(const char* name, const double (&v)[3], const char* unit) {
  return format_text("%-10s x % .4e   y % .4e   z % .4e  %s\n", name, v[0], v[1], v[2], unit);
}

/// Returns the angle [deg] between body and world axes, 0 to 180.
double rotation_angle(const double (&attitude)[4]) {
  const double vector_part = std::hypot(attitude[1], attitude[2], attitude[3]);
  return 2.0 * std::atan2(vector_part, std::abs(attitude[0])) * 180.0 / std::numbers::pi;
}

}  // namespace

Screen::Screen(bool is_terminal) : is_terminal_(is_terminal) {
  // switches to the alternate screen, hides the cursor and cuts long lines instead of wrapping them
  if (is_terminal_) std::fputs("\033[?1049h\033[?25l\033[?7l", stdout);
}

Screen::~Screen() {
  if (is_terminal_) {
    std::fputs("\033[?7h\033[?25h\033[?1049l", stdout);
    std::fflush(stdout);
  }
}

int Screen::num_rows() const {
  winsize size{};
  const bool is_known = is_terminal_ && ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_row > 0;
  return is_known ? size.ws_row : 24;
}

void Screen::show(const std::string& text) {
  if (!is_terminal_) {
    std::fputs(text.c_str(), stdout);
  } else {
    // the page is drawn over the old page, and the rest of each line is cleared, so that nothing flickers.
    // The last row has no end of line, because an end of line there would scroll the page
    std::string drawn = "\033[H";
    const int rows = num_rows();
    std::istringstream lines(text);
    std::string line;
    for (int row = 0; row < rows && std::getline(lines, line); ++row)
      drawn += (row > 0 ? "\r\n" : "") + line + "\033[K";
    drawn += "\033[J";
    std::fwrite(drawn.data(), 1, drawn.size(), stdout);
  }
  std::fflush(stdout);
}

void LiveView::take(const std::string& suffix, const BusMessage& message) {
  if (suffix == channels::kStatus) {
    freeflex_msgs::status_t status;
    if (io::decode_message(message.bytes, status)) {
      for (std::string* text : {&status.fault, &status.time_mode, &status.replan, &status.validity_cause,
                                &status.worst_validity_cause})
        *text = printable(*text);
      take_status(status);
    } else
      unread_ = io::explain_unread(message.bytes);
  } else if (suffix == channels::kState) {
    freeflex_msgs::state_t state;
    if (io::decode_message(message.bytes, state) && is_of_daemon(state.session)) state_ = state;
  } else if (suffix == channels::kPoints) {
    freeflex_msgs::points_t points;
    if (io::decode_message(message.bytes, points) && is_of_daemon(points.session)) take_points(points);
  } else if (suffix == channels::kScene) {
    freeflex_msgs::scene_t scene;
    if (io::decode_message(message.bytes, scene) && is_of_daemon(scene.session))
      scene_.take(scene, message.bytes.size());
  } else if (suffix == channels::kAck || suffix == channels::kApplied) {
    note((suffix == channels::kAck ? "ack      " : "applied  ") +
         decode_by_suffix(suffix, message.bytes).summary);
  }
  last_heard_us_ = wall_clock_us();
}

bool LiveView::is_of_daemon(std::int64_t session) const { return !status_ || status_->session == session; }

void LiveView::take_status(const freeflex_msgs::status_t& status) {
  const std::int64_t now_us = wall_clock_us();
  if (status_ && status_->session != status.session) {
    // two daemons send if a session sends again shortly after another session, because after a restart the
    // old session sends no more messages
    if (now_us - other_heard_us_ < kTwoDaemons && other_session_ == status.session) sees_two_ = true;
    other_session_ = status_->session;
    other_heard_us_ = now_us;
  } else if (now_us - other_heard_us_ > kTwoDaemons) {
    sees_two_ = false;
  }
  if (status_ && status_->session == status.session && status_->mode == status.mode &&
      status.utime > status_->utime) {
    const double seconds = static_cast<double>(status.utime - status_->utime) * 1e-6;
    const double rate = static_cast<double>(status.tick - status_->tick) / seconds;
    // averages the rate over about ten STATUS, because the rate from one pair of messages would include the
    // lateness of the publisher
    measured_rate_ = measured_rate_ ? *measured_rate_ + 0.1 * (rate - *measured_rate_) : rate;
  } else {
    measured_rate_.reset();
  }
  status_ = status;
}

void LiveView::take_points(const freeflex_msgs::points_t& points) {
  if (points.tick != points_tick_) {
    points_tick_ = points.tick;
    largest_displacement_ = 0.0;
    largest_point_ = -1;
  }
  for (const auto& point : points.points) {
    const double displacement = norm(point.displacement);
    if (displacement < largest_displacement_) continue;
    largest_displacement_ = displacement;
    largest_point_ = point.point;
  }
}

void LiveView::note(const std::string& text) {
  notes_.push_back(text);
  if (notes_.size() > kMaxNotes) notes_.pop_front();
}

std::string LiveView::rate_text() const {
  return measured_rate_ ? format_text("%.1f Hz", *measured_rate_) : "not measured yet";
}

double LiveView::silence_in_seconds() const {
  return static_cast<double>(wall_clock_us() - last_heard_us_) * 1e-6;
}

std::string LiveView::header_text() const {
  const std::string name = scene_.is_complete() ? printable(scene_.head().name) : "?";
  const double silence = silence_in_seconds();
  std::string out = bold(name + ": " + mode_name(status_->mode) + ", " + status_->time_mode) +
                    format_text("   tick %lld   time %.3f s   epoch %lld\n",
                                static_cast<long long>(state_ ? state_->tick : status_->tick),
                                state_ ? state_->time : 0.0, static_cast<long long>(status_->epoch));
  if (!status_->fault.empty()) out += std::string(kAlarm) + "fault      " + status_->fault + kPlain + "\n";
  if (sees_two_)
    out += std::string(kAlarm) +
           format_text("two        daemons publish on this prefix, with sessions %lld and %lld; stop one",
                       static_cast<long long>(status_->session), static_cast<long long>(other_session_)) +
           kPlain + "\n";
  if (silence > kSilent)
    out += std::string(kAlarm) + format_text("silent     no message for %.0f s", silence) + kPlain + "\n";
  out += "rate       " + bold(rate_text()) + format_text(" of %.10g Hz   ", status_->rate) +
         alarming("overruns", status_->overruns) + "   " + alarming("slips", status_->slips) + "   " +
         alarming("ingress restarts", status_->ingress_restarts);
  std::int64_t num_lost = status_->answers_dropped + status_->sends_failed;
  for (const io::ChannelEncoder& channel : io::kEncoders) num_lost += *status_.*channel.dropped;
  if (num_lost > 0) out += "   " + alarming("not sent", num_lost);
  out += "\n\n";
  return out;
}

std::string LiveView::motion_text() const {
  if (!state_) return "(no state yet)\n\n";
  const auto& s = *state_;
  return vector_row("position", s.position, "m      centre of mass") +
         format_text("%-10s w % .6f  x % .6f  y % .6f  z % .6f  rotated %.1f deg\n", "attitude",
                     s.attitude[0], s.attitude[1], s.attitude[2], s.attitude[3], rotation_angle(s.attitude)) +
         vector_row("velocity", s.velocity, "m/s") +
         vector_row("spin", s.angular_velocity, "rad/s  body axes") + "\n";
}

std::string LiveView::elastic_text(std::size_t num_modes) const {
  std::string at;
  if (largest_point_ >= 0 && index(largest_point_) < scene_.points().size()) {
    at = " at point " + printable(scene_.points()[index(largest_point_)].name);
  }
  const double largest = largest_point_ >= 0 ? largest_displacement_ : status_->max_displacement;
  std::string out = "elastic    largest displacement " + bold(format_text("%.4e m", largest)) + at + "\n";
  if (state_) {
    // lists the modes with the largest |q|
    std::vector<std::size_t> order(state_->q.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const std::size_t shown = std::min(num_modes, order.size());
    const auto is_larger = [&](std::size_t a, std::size_t b) {
      return std::abs(state_->q[a]) > std::abs(state_->q[b]);
    };
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(shown), order.end(),
                      is_larger);
    for (std::size_t i = 0; i < shown; ++i) {
      const std::size_t mode = order[i];
      const double hertz = mode < scene_.frequencies().size() ? scene_.frequencies()[mode] : 0.0;
      out += format_text("  mode %-5zu %11.4f Hz  q % .4e m  %s\n", mode + 1, hertz, state_->q[mode],
                         bar(std::abs(state_->q[mode]), std::abs(state_->q[order[0]])).c_str());
    }
  }
  out += format_text("energy     rigid %.3e J, elastic motion %.3e J, strain %.3e J\n",
                     status_->kinetic_rigid, status_->kinetic_elastic, status_->potential);
  out += format_text("drift      energy %.1e, angular momentum %.1e, Eckart residual %.1e\n",
                     status_->energy_drift, status_->momentum_drift, status_->eckart_residual);
  if (!status_->replan.empty())
    out +=
        format_text("replan     %s is simulated again since tick %" PRId64 ", because a command needs it\n",
                    status_->replan.c_str(), status_->replan_tick);
  return out + validity_text() + "\n";
}

std::string LiveView::validity_text() const {
  const auto& s = *status_;
  const std::string verdict = validity_name(s.validity);
  const bool is_good = s.validity == freeflex_msgs::status_t::GOOD;
  std::string out = "validity   " + (is_good ? bold(verdict) : std::string(kAlarm) + verdict + kPlain);
  out += s.validity_cause.empty() ? "" : "  " + s.validity_cause;
  if (s.worst_validity > s.validity)
    out += format_text("\n           was %s at tick %" PRId64 "  ", validity_name(s.worst_validity),
                       s.worst_validity_tick) +
           s.worst_validity_cause;
  out += "\n";
  if (s.error_scale > 0.0)
    out +=
        "error      " + share_text(s.deformation_error, s.error_scale) +
        format_text(" %.2g m, the displacement it is compared with; good up to %g %%, outside above %g %%\n",
                    s.error_scale, 100.0 * kGoodElastic, 100.0 * kMostElastic);
  if (s.judged_tick >= 0)
    out += format_text("judged     tick %" PRId64 ", centre of mass %.1e m, attitude %.1e rad%s\n",
                       s.judged_tick, s.position_error, s.attitude_error,
                       s.judged_every > 1 ? format_text("; one horizon in %d", s.judged_every).c_str() : "");
  return out;
}

std::string LiveView::timing_text() const {
  const auto row = [](const char* name, const double(&v)[4], const char* meaning) {
    return format_text("%-10s %9.1f %9.1f %9.1f %9.1f  %s\n", name, v[0], v[1], v[2], v[3], meaning);
  };
  return format_text("%-10s %9s %9s %9s %9s  over %d ticks\n", "[us]", "p50", "p99", "p99.9", "max",
                     status_->window_ticks) +
         row("lateness", status_->lateness_us, "wake-up after the deadline") +
         row("compute", status_->compute_us, "one tick") +
         row("command", status_->command_latency_us, "reception to effect") + "\n";
}

std::string LiveView::commands_text() const {
  std::int64_t rejected = 0;
  std::string reasons;
  for (const auto& rejection : status_->rejections) {
    rejected += rejection.count;
    const bool is_known = rejection.reason >= 0 && rejection.reason < io::kNumReasons;
    if (rejection.count == 0) continue;
    reasons +=
        (reasons.empty() ? " (" : ", ") +
        std::string(is_known ? io::reason_name(static_cast<io::Reason>(rejection.reason)) : "unknown") + " " +
        std::to_string(rejection.count);
  }
  if (!reasons.empty()) reasons += ")";
  return format_text("commands   %lld received, %lld accepted, %lld rejected%s, %d in force\n",
                     static_cast<long long>(status_->commands_received),
                     static_cast<long long>(status_->commands_accepted), static_cast<long long>(rejected),
                     reasons.c_str(), status_->num_slots);
}

std::string LiveView::page(const std::string& bus, int num_rows) const {
  const std::string last_line = "Ctrl-C ends   " + bus + "\n";
  if (!status_) return "freeflex: " + line() + "\n" + last_line;
  const std::size_t num_modes = num_rows < 28 ? 3 : kMaxModes;
  std::string out = header_text() + motion_text() + elastic_text(num_modes) + timing_text() + commands_text();
  // the remaining lines show the latest commands and answers
  const auto left = num_rows - 1 - std::count(out.begin(), out.end(), '\n');
  for (std::size_t i = notes_.size() - std::min(notes_.size(), index(std::max(left, std::ptrdiff_t{0})));
       i < notes_.size(); ++i) {
    out += "  " + notes_[i] + "\n";
  }
  return out + last_line;
}

std::string LiveView::line() const {
  if (!status_)
    return "waiting for a daemon" + (unread_.empty() ? "" : "; a status was received that is " + unread_);
  std::string out =
      format_text("tick %lld, %s, %s, rate %s, late p99 %.0f us, overruns %lld, slips %lld",
                  static_cast<long long>(state_ ? state_->tick : status_->tick), mode_name(status_->mode),
                  validity_name(status_->validity), rate_text().c_str(), status_->lateness_us[1],
                  static_cast<long long>(status_->overruns), static_cast<long long>(status_->slips));
  if (state_) {
    out += format_text(", position %.4e %.4e %.4e m, spin %.3e rad/s", state_->position[0],
                       state_->position[1], state_->position[2], norm(state_->angular_velocity));
  }
  out += format_text(", largest displacement %.4e m",
                     largest_point_ >= 0 ? largest_displacement_ : status_->max_displacement);
  if (sees_two_) out += ", two daemons publish on this prefix";
  if (const double silence = silence_in_seconds(); silence > kSilent)
    out += format_text(", no message for %.0f s", silence);
  return out;
}

}  // namespace freeflex::tools
