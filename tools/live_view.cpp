#include "tools/live_view.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <vector>

#include "messages/channels.hpp"
#include "service/io/reason.hpp"
#include "tools/console.hpp"
#include "tools/message_json.hpp"
#include "tools/wire_layout.hpp"

namespace freeflex::tools {
namespace {

constexpr std::size_t kNotes = 5;
constexpr std::size_t kModesShown = 5;

double norm(const double (&v)[3]) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/// "##########....." for a value between zero and largest.
std::string bar(double value, double largest) {
  constexpr int kWidth = 24;
  const double share = largest > 0.0 ? std::clamp(value / largest, 0.0, 1.0) : 0.0;
  const auto filled = static_cast<std::size_t>(std::lround(share * kWidth));
  return std::string(filled, '#') + std::string(kWidth - filled, '.');
}

}  // namespace

Screen::Screen(bool is_terminal) : is_terminal_(is_terminal) {
  // alternate screen, cursor hidden
  if (is_terminal_) std::fputs("\033[?1049h\033[?25l", stdout);
}

Screen::~Screen() {
  if (is_terminal_) {
    std::fputs("\033[?25h\033[?1049l", stdout);
    std::fflush(stdout);
  }
}

void Screen::show(const std::string& text) {
  if (!is_terminal_) {
    std::fputs(text.c_str(), stdout);
  } else {
    std::string drawn = "\033[H";
    for (const char c : text) drawn += c == '\n' ? std::string("\033[K\n") : std::string(1, c);
    drawn += "\033[J";
    std::fputs(drawn.c_str(), stdout);
  }
  std::fflush(stdout);
}

void LiveView::take(const std::string& suffix, const BusMessage& message) {
  if (suffix == channels::kStatus) {
    freeflex_msgs::status_t status;
    if (decode_message(message.bytes, status)) take_status(status);
  } else if (suffix == channels::kState) {
    freeflex_msgs::state_t state;
    if (decode_message(message.bytes, state)) state_ = state;
  } else if (suffix == channels::kPoints) {
    freeflex_msgs::points_t points;
    if (decode_message(message.bytes, points)) take_points(points);
  } else if (suffix == channels::kScene) {
    freeflex_msgs::scene_t scene;
    if (decode_message(message.bytes, scene)) scene_.take(scene);
  } else if (suffix == channels::kAck || suffix == channels::kApplied) {
    note((suffix == channels::kAck ? "ack      " : "applied  ") +
         decode_by_suffix(suffix, message.bytes).summary);
  }
  last_heard_us_ = wall_clock_us();
}

void LiveView::take_status(const freeflex_msgs::status_t& status) {
  if (status_ && status_->session == status.session && status_->mode == status.mode &&
      status.utime > status_->utime) {
    const double seconds = static_cast<double>(status.utime - status_->utime) * 1e-6;
    const double rate = static_cast<double>(status.tick - status_->tick) / seconds;
    // over about a second: a single pair would show the lateness of the publisher
    measured_rate_ = measured_rate_ == 0.0 ? rate : measured_rate_ + 0.1 * (rate - measured_rate_);
  } else {
    measured_rate_ = 0.0;
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
  if (notes_.size() > kNotes) notes_.pop_front();
}

std::string LiveView::header_text(const std::string& bus) const {
  const std::string name = scene_.is_complete() ? scene_.head().name : "?";
  const double silence = static_cast<double>(wall_clock_us() - last_heard_us_) * 1e-6;
  std::string out = format_text("freeflex  %s  %s, %s  (%s)\n", name.c_str(), mode_name(status_->mode),
                                status_->time_mode.c_str(), bus.c_str());
  if (!status_->fault.empty()) out += "FAULT     " + status_->fault + "\n";
  if (silence > 2.0) out += format_text("SILENT    for %.0f s\n", silence);
  out += format_text("tick      %-12lld epoch %-6lld time %.3f s\n", static_cast<long long>(status_->tick),
                     static_cast<long long>(status_->epoch), state_ ? state_->time : 0.0);
  out += format_text("rate      %.1f Hz of %.10g Hz wanted\n\n", measured_rate_, status_->rate);
  return out;
}

std::string LiveView::motion_text() const {
  if (!state_) return "(no state yet)\n\n";
  const auto& s = *state_;
  std::string out =
      format_text("position  % .6e % .6e % .6e m\n", s.position[0], s.position[1], s.position[2]);
  out += format_text("attitude  % .6f % .6f % .6f % .6f (w x y z)\n", s.attitude[0], s.attitude[1],
                     s.attitude[2], s.attitude[3]);
  out += format_text("velocity  % .6e % .6e % .6e m/s\n", s.velocity[0], s.velocity[1], s.velocity[2]);
  out += format_text("spin      % .6e % .6e % .6e rad/s, body axes\n\n", s.angular_velocity[0],
                     s.angular_velocity[1], s.angular_velocity[2]);
  return out;
}

std::string LiveView::elastic_text() const {
  std::string at;
  if (largest_point_ >= 0 && static_cast<std::size_t>(largest_point_) < scene_.points().size()) {
    at = " at " + scene_.points()[static_cast<std::size_t>(largest_point_)].name;
  }
  const double largest = largest_point_ >= 0 ? largest_displacement_ : status_->max_displacement;
  std::string out = format_text("elastic   largest displacement %.6e m%s\n", largest, at.c_str());
  if (state_) {
    // the modes that move most, by the size of q
    std::vector<std::size_t> order(state_->q.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const std::size_t shown = std::min(kModesShown, order.size());
    const auto is_larger = [&](std::size_t a, std::size_t b) {
      return std::abs(state_->q[a]) > std::abs(state_->q[b]);
    };
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(shown), order.end(),
                      is_larger);
    for (std::size_t i = 0; i < shown; ++i) {
      const std::size_t mode = order[i];
      const double hertz = mode < scene_.frequencies().size() ? scene_.frequencies()[mode] : 0.0;
      out += format_text("  mode %-5zu %12.4f Hz  q % .4e m  %s\n", mode + 1, hertz, state_->q[mode],
                         bar(std::abs(state_->q[mode]), std::abs(state_->q[order[0]])).c_str());
    }
  }
  out += format_text("energy    rigid %.4e J, elastic %.4e + %.4e J\n", status_->kinetic_rigid,
                     status_->kinetic_elastic, status_->potential);
  out += format_text("drift     energy %.1e, momentum %.1e, Eckart %.1e\n", status_->energy_drift,
                     status_->momentum_drift, status_->eckart_residual);
  out += format_text("validity  displacement ratio %.1e, spin ratio %.1e (both must be small)\n\n",
                     status_->displacement_ratio, status_->spin_ratio);
  return out;
}

std::string LiveView::timing_text() const {
  const auto row = [](const char* name, const double(&v)[4]) {
    return format_text("%-9s %10.1f %10.1f %10.1f %10.1f\n", name, v[0], v[1], v[2], v[3]);
  };
  std::string out = format_text("%-9s %10s %10s %10s %10s  over %d ticks\n", "[us]", "p50", "p99", "p99.9",
                                "max", status_->window_ticks);
  out += row("lateness", status_->lateness_us) + row("compute", status_->compute_us) +
         row("command", status_->command_latency_us);
  out += format_text("overruns  %lld, slips %lld, ingress restarts %lld\n\n",
                     static_cast<long long>(status_->overruns), static_cast<long long>(status_->slips),
                     static_cast<long long>(status_->ingress_restarts));
  return out;
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
  std::string out = format_text("commands  %lld received, %lld accepted, %lld rejected%s, %d in force\n",
                                static_cast<long long>(status_->commands_received),
                                static_cast<long long>(status_->commands_accepted),
                                static_cast<long long>(rejected), reasons.c_str(), status_->num_slots);
  for (const std::string& text : notes_) out += "  " + text + "\n";
  return out;
}

std::string LiveView::page(const std::string& bus) const {
  if (!status_) return "freeflex  waiting for a daemon (" + bus + ")\nCtrl-C ends\n";
  return header_text(bus) + motion_text() + elastic_text() + timing_text() + commands_text() +
         "\nCtrl-C ends\n";
}

std::string LiveView::line() const {
  if (!status_) return "waiting for a daemon";
  std::string out =
      format_text("tick %lld, %s, %.1f Hz, late p99 %.0f us, overruns %lld, slips %lld",
                  static_cast<long long>(status_->tick), mode_name(status_->mode), measured_rate_,
                  status_->lateness_us[1], static_cast<long long>(status_->overruns),
                  static_cast<long long>(status_->slips));
  if (state_) {
    out += format_text(", position %.4e %.4e %.4e m, spin %.3e rad/s", state_->position[0],
                       state_->position[1], state_->position[2], norm(state_->angular_velocity));
  }
  return out + format_text(", largest displacement %.4e m",
                           largest_point_ >= 0 ? largest_displacement_ : status_->max_displacement);
}

}  // namespace freeflex::tools
