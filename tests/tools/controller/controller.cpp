// Example controller: an active strut that damps vibration between two points.
//
//   controller POINT POINT GAIN
//
// It hears where the two points are (FREEFLEX_POINTS), and pushes both along the line between them against
// the speed at which the line grows:
//   force on the second point = -GAIN [N s/m] * d(length)/dt, and the opposite on the first (FREEFLEX_FORCE)
// The pair has no resultant and no moment, so it damps elastic motion and leaves the rigid motion alone.
// Feedback lags by one publication of FREEFLEX_POINTS and damps modes well below that rate.
//
// Every command is under a lease: when this program dies, its force ends after kLease. Ends with exit code 0
// when the speed stays below 1 % of what it was, with 1 after 60 s of simulated time without that.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <lcm/lcm-cpp.hpp>
#include <optional>
#include <string>
#include <utility>

#include "freeflex_msgs/ack_t.hpp"
#include "freeflex_msgs/force_t.hpp"
#include "freeflex_msgs/points_t.hpp"
#include "freeflex_msgs/scene_t.hpp"
#include "freeflex_msgs/status_t.hpp"
#include "messages/channels.hpp"

namespace {

namespace msgs = freeflex_msgs;
namespace channels = freeflex::channels;

constexpr double kLease = 0.2;   // [s] renewed by every POINTS
constexpr double kWindow = 1.0;  // [s] longer than half a period: the speed's largest value in it is compared
constexpr double kTimeLimit = 60.0;  // [s]
const std::string kPrefix = channels::kDefaultPrefix;
const std::string kSender = "example-controller";

/// A point by its name; its index comes from FREEFLEX_SCENE, its motion from FREEFLEX_POINTS.
struct End {
  std::string name;
  std::int32_t index = -1;
  std::optional<msgs::point_state_t> motion;  // of the tick at hand
};

class Controller {
 public:
  Controller(lcm::LCM& bus, std::string first, std::string second, double gain)
      : bus_(bus), first_{std::move(first), -1, {}}, second_{std::move(second), -1, {}}, gain_(gain) {
    bus_.subscribe(kPrefix + channels::kStatus, &Controller::on_status, this);
    bus_.subscribe(kPrefix + channels::kScene, &Controller::on_scene, this);
    bus_.subscribe(kPrefix + channels::kPoints, &Controller::on_points, this);
    bus_.subscribe(kPrefix + channels::kAck, &Controller::on_ack, this);
  }
  bool is_done() const { return exit_code_.has_value(); }
  int exit_code() const { return *exit_code_; }

 private:
  // which daemon is there: a command must carry its session
  void on_status(const lcm::ReceiveBuffer*, const std::string&, const msgs::status_t* status) {
    session_ = status->session;
  }

  // what the indices mean; several pages when there are many points
  void on_scene(const lcm::ReceiveBuffer*, const std::string&, const msgs::scene_t* scene) {
    rate_ = scene->rate;
    for (End* end : {&first_, &second_}) {
      for (int i = 0; i < scene->num_points; ++i) {
        if (scene->points[static_cast<std::size_t>(i)].name == end->name) end->index = scene->first_point + i;
      }
    }
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
    if (first_.motion && second_.motion) control(*first_.motion, *second_.motion);
  }

  // a rejection says what is wrong with the command
  void on_ack(const lcm::ReceiveBuffer*, const std::string&, const msgs::ack_t* ack) {
    if (ack->sender != kSender || ack->reason == 0) return;
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
    command.sender = kSender;
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
    bus_.publish(kPrefix + channels::kForce, &command);
  }

  // compares the largest speed of each window with that of the first
  void watch(double speed) {
    const double time = static_cast<double>(tick_) / rate_;
    if (start_ < 0.0) start_ = window_start_ = time;
    window_largest_ = std::max(window_largest_, speed);
    if (time < window_start_ + kWindow) return;
    if (first_largest_ < 0.0) first_largest_ = window_largest_;
    const bool is_quiet = window_largest_ <= 0.01 * first_largest_;
    if (is_quiet || time > start_ + kTimeLimit) {
      std::printf("speed along the line: %.6f m/s -> %.6f m/s after %.1f s\n", first_largest_,
                  window_largest_, time - start_);
      exit_code_ = is_quiet ? 0 : 1;
    }
    window_start_ = time;
    window_largest_ = 0.0;
  }

  lcm::LCM& bus_;
  End first_, second_;
  double gain_;  // [N s/m]
  std::int64_t session_ = 0;
  std::int64_t sequence_ = 0;
  std::int64_t tick_ = -1;
  double rate_ = 0.0;            // [Hz]
  double start_ = -1.0;          // [s]
  double window_start_ = 0.0;    // [s]
  double window_largest_ = 0.0;  // [m/s]
  double first_largest_ = -1.0;  // [m/s]
  std::optional<int> exit_code_;
};

}  // namespace

int main(int argc, char** argv) {
  const double gain = argc == 4 ? std::strtod(argv[3], nullptr) : 0.0;
  if (!(gain > 0.0)) {
    std::fprintf(stderr, "usage: controller POINT POINT GAIN      (GAIN in N s/m, > 0)\n");
    return 2;
  }
  lcm::LCM bus;
  if (!bus.good()) {
    std::fprintf(stderr, "controller: no LCM network\n");
    return 1;
  }
  Controller controller(bus, argv[1], argv[2], gain);
  while (!controller.is_done()) {
    if (bus.handleTimeout(10'000) <= 0) {
      std::fprintf(stderr, "controller: nothing heard for 10 s\n");
      return 1;
    }
  }
  return controller.exit_code();
}
