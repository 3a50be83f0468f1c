// Example controller: an active strut that damps vibration between two points.
//
//   controller POINT POINT GAIN [KEYFILE]
//
// It hears where the two points are (FREEFLEX_POINTS), and pushes both along the line between them against
// the speed at which the line grows:
//   force on the second point = -GAIN [N s/m] * d(length)/dt, and the opposite on the first (FREEFLEX_FORCE)
// The pair has no resultant and no moment, so it damps elastic motion and leaves the rigid motion alone.
// Feedback lags by one publication of FREEFLEX_POINTS and damps modes well below that rate.
//
// With a key file of `freeflex keygen` it seals its commands, as a daemon wants them that requires keys.
//
// Every command is under a lease: when this program dies, its force ends after kLease. It may be started
// again at any time, and takes up a daemon that is started again. Ends with exit code 0 when the speed stays
// below 1 % of what it was, with 1 after 60 s of simulated time without that or 10 s without the points, with
// 2 when there are no such points.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "freeflex_msgs/ack_t.hpp"
#include "freeflex_msgs/force_t.hpp"
#include "freeflex_msgs/points_t.hpp"
#include "freeflex_msgs/scene_t.hpp"
#include "freeflex_msgs/status_t.hpp"
#include "messages/channels.hpp"
#include "messages/seal.hpp"

namespace {

namespace msgs = freeflex_msgs;
namespace channels = freeflex::channels;
using Clock = std::chrono::steady_clock;

constexpr double kLease = 0.2;   // [s] renewed by every POINTS
constexpr double kWindow = 1.0;  // [s] longer than half a period: the speed's largest value in it is compared
constexpr double kTimeLimit = 60.0;            // [s]
constexpr std::chrono::seconds kPatience{10};  // without the points
constexpr std::int32_t kWrongSession = 3;      // ack_t.reason
const std::string kPrefix = channels::kDefaultPrefix;
constexpr std::int64_t kValidity = 2'000'000;  // [us] of a sealed command: its way to the daemon
const std::string kSender = "example-controller";

/// What a key file says: lines "id: NAME" and "secret: 64 hexadecimal digits". Empty when it does not.
std::optional<freeflex::SealingKey> read_key(const char* path) {
  freeflex::SealingKey key;
  std::size_t size = 0;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("id: ")) key.id = line.substr(4);
    if (line.starts_with("secret: "))
      sodium_hex2bin(key.secret.data(), key.secret.size(), line.data() + 8, line.size() - 8, nullptr, &size,
                     nullptr);
  }
  if (key.id.empty() || size != key.secret.size()) return std::nullopt;
  return key;
}

/// A point by its name; its index comes from FREEFLEX_SCENE, its motion from FREEFLEX_POINTS.
struct End {
  std::string name;
  std::int32_t index = -1;
  std::optional<msgs::point_state_t> motion;  // of the tick at hand
};

/// Speed along the line, by windows of kWindow.
struct Windows {
  double start = -1.0;          // [s] of the first
  double now_start = 0.0;       // [s] of the one at hand
  double now_largest = 0.0;     // [m/s] in it
  double first_largest = -1.0;  // [m/s]
};

/// [us] since 1970. Commands are numbered from here upwards: a sequence must grow within a session, and this
/// program may be started twice in one.
std::int64_t wall_clock_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

class Controller {
 public:
  Controller(lcm::LCM& bus, std::string first, std::string second, double gain,
             std::optional<freeflex::SealingKey> key)
      : bus_(bus),
        first_{std::move(first), -1, {}},
        second_{std::move(second), -1, {}},
        gain_(gain),
        key_(std::move(key)),
        sender_(key_ ? key_->id : kSender) {
    bus_.subscribe(kPrefix + channels::kStatus, &Controller::on_status, this);
    bus_.subscribe(kPrefix + channels::kScene, &Controller::on_scene, this);
    bus_.subscribe(kPrefix + channels::kPoints, &Controller::on_points, this);
    bus_.subscribe(kPrefix + channels::kAck, &Controller::on_ack, this);
  }
  bool is_done() const { return exit_code_.has_value(); }
  int exit_code() const { return *exit_code_; }
  /// How long the two points have not been heard of.
  Clock::duration silence() const { return Clock::now() - heard_; }

 private:
  // which daemon is there: a command must carry its session, and another one may hold another scene
  void on_status(const lcm::ReceiveBuffer*, const std::string&, const msgs::status_t* status) {
    if (status->session == session_) return;
    session_ = status->session;
    points_.clear();
    pages_.clear();
    first_.index = second_.index = -1;
    tick_ = -1;
    windows_ = {};
  }

  // what the indices mean; several pages when there are many points
  void on_scene(const lcm::ReceiveBuffer*, const std::string&, const msgs::scene_t* scene) {
    if (scene->session != session_ || first_.index >= 0) return;
    if (scene->first_point < 0 || scene->first_point + scene->num_points > scene->total_points) return;
    rate_ = scene->rate;
    points_.resize(static_cast<std::size_t>(scene->total_points));
    std::copy(scene->points.begin(), scene->points.end(), points_.begin() + scene->first_point);
    pages_.insert(scene->page);
    if (static_cast<std::int32_t>(pages_.size()) < scene->num_pages) return;
    find(first_);
    find(second_);
  }

  // a point that is not there, or whose motion is not published, would be waited for in vain
  void find(End& end) {
    constexpr int kShown = 20;
    std::string known;
    int num_known = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (points_[i].is_published == 0) continue;
      if (points_[i].name == end.name) {
        end.index = static_cast<std::int32_t>(i);
        return;
      }
      if (num_known++ < kShown) known += (known.empty() ? "" : ", ") + points_[i].name;
    }
    if (num_known > kShown) known += " and " + std::to_string(num_known - kShown) + " more";
    std::fprintf(stderr, "controller: no point '%s' is published; there are: %s\n", end.name.c_str(),
                 known.empty() ? "none" : known.c_str());
    exit_code_ = 2;
  }

  void on_points(const lcm::ReceiveBuffer*, const std::string&, const msgs::points_t* points) {
    if (session_ == 0 || points->session != session_ || first_.index < 0 || second_.index < 0) return;
    // the pages of one tick belong together
    if (points->tick != tick_) first_.motion = second_.motion = std::nullopt;
    tick_ = points->tick;
    for (const msgs::point_state_t& point : points->points) {
      if (point.point == first_.index) first_.motion = point;
      if (point.point == second_.index) second_.motion = point;
    }
    if (!first_.motion || !second_.motion) return;
    heard_ = Clock::now();
    control(*first_.motion, *second_.motion);
  }

  // a rejection says what is wrong with the command; the daemon that it was meant for may be gone
  void on_ack(const lcm::ReceiveBuffer*, const std::string&, const msgs::ack_t* ack) {
    if (ack->sender != sender_ || ack->reason == 0 || ack->reason == kWrongSession) return;
    std::fprintf(stderr, "controller: rejected: %s\n", ack->text.c_str());
    exit_code_ = 1;
  }

  void control(const msgs::point_state_t& first, const msgs::point_state_t& second) {
    double line[3];
    double length_squared = 0.0;
    for (int k = 0; k < 3; ++k) {
      line[k] = second.position[k] - first.position[k];
      length_squared += line[k] * line[k];
    }
    const double length = std::sqrt(length_squared);
    double speed = 0.0;  // [m/s] d(length)/dt
    for (int k = 0; k < 3; ++k) speed += line[k] / length * (second.velocity[k] - first.velocity[k]);
    watch(std::abs(speed));
    if (is_done()) return;

    msgs::force_t command{};
    command.session = session_;
    command.sender = sender_;
    command.sequence = ++sequence_;
    command.axes = 0;         // world
    command.start_tick = -1;  // at once
    command.lease_ticks = static_cast<std::int64_t>(kLease * rate_);
    msgs::point_force_t on_first{};
    msgs::point_force_t on_second{};
    on_first.point = first.point;
    on_second.point = second.point;
    for (int k = 0; k < 3; ++k) {
      on_second.force[k] = -gain_ * speed * line[k] / length;
      on_first.force[k] = -on_second.force[k];
    }
    command.forces = {on_first, on_second};
    command.num_forces = 2;
    publish(command);
  }

  void publish(const msgs::force_t& command) {
    const std::string channel = kPrefix + channels::kForce;
    if (!key_) {
      bus_.publish(channel, &command);
      return;
    }
    const auto sealed = freeflex::seal(command, channel, *key_, wall_clock_us() + kValidity);
    bus_.publish(channel, sealed.data(), static_cast<unsigned>(sealed.size()));
  }

  // compares the largest speed of each window with that of the first
  void watch(double speed) {
    Windows& w = windows_;
    const double time = static_cast<double>(tick_) / rate_;
    if (w.start < 0.0) w.start = w.now_start = time;
    w.now_largest = std::max(w.now_largest, speed);
    if (time < w.now_start + kWindow) return;
    if (w.first_largest < 0.0) w.first_largest = w.now_largest;
    const bool is_quiet = w.now_largest <= 0.01 * w.first_largest;
    if (is_quiet || time > w.start + kTimeLimit) {
      std::printf("speed along the line: %.6f m/s -> %.6f m/s after %.1f s\n", w.first_largest, w.now_largest,
                  time - w.start);
      exit_code_ = is_quiet ? 0 : 1;
    }
    w.now_start = time;
    w.now_largest = 0.0;
  }

  lcm::LCM& bus_;
  End first_, second_;
  double gain_;  // [N s/m]
  std::optional<freeflex::SealingKey> key_;
  std::string sender_;
  std::int64_t session_ = 0;
  std::vector<msgs::scene_point_t> points_;  // of the session, as far as its pages came
  std::set<std::int32_t> pages_;
  std::int64_t sequence_ = wall_clock_us();
  std::int64_t tick_ = -1;
  double rate_ = 0.0;  // [Hz]
  Windows windows_;
  Clock::time_point heard_ = Clock::now();
  std::optional<int> exit_code_;
};

}  // namespace

int main(int argc, char** argv) {
  const double gain = argc == 4 || argc == 5 ? std::strtod(argv[3], nullptr) : 0.0;
  if (!(gain > 0.0) || std::string(argv[1]) == argv[2]) {
    std::fprintf(stderr,
                 "usage: controller POINT POINT GAIN [KEYFILE]    (two points; GAIN in N s/m, > 0)\n");
    return 2;
  }
  std::optional<freeflex::SealingKey> key;
  if (argc == 5 && !(key = read_key(argv[4]))) {
    std::fprintf(stderr, "controller: no key in %s: make one with freeflex keygen\n", argv[4]);
    return 2;
  }
  lcm::LCM bus;
  if (!bus.good()) {
    std::fprintf(stderr, "controller: no LCM network\n");
    return 1;
  }
  Controller controller(bus, argv[1], argv[2], gain, std::move(key));
  while (!controller.is_done()) {
    if (bus.handleTimeout(1'000) >= 0 && controller.silence() < kPatience) continue;
    std::fprintf(stderr,
                 "controller: the two points were not heard for 10 s: is freeflexd there, and does its scene "
                 "publish points?\n");
    return 1;
  }
  return controller.exit_code();
}
