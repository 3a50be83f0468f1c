// Example controller: brakes a drifting structure to rest.
//
// Listens to FREEFLEX_STATUS (which session, which rate), FREEFLEX_SCENE (what the indices mean) and
// FREEFLEX_STATE, and commands FREEFLEX_FORCE on the group named as its first argument: F = -gain M v, in
// world axes. Each command is under a lease, so the force ends by itself when this program dies. Ends with
// exit code 0 when the speed is below 1 % of what it was, with 1 after 20 s of simulated time without that.
#include <cmath>
#include <cstdio>
#include <lcm/lcm-cpp.hpp>
#include <string>

#include "freeflex_msgs/force_t.hpp"
#include "freeflex_msgs/scene_t.hpp"
#include "freeflex_msgs/state_t.hpp"
#include "freeflex_msgs/status_t.hpp"
#include "messages/channels.hpp"

namespace {

namespace msgs = freeflex_msgs;
namespace channels = freeflex::channels;

constexpr double kGain = 2.0;        // [1/s]
constexpr double kLease = 0.2;       // [s] renewed by every STATE
constexpr double kTimeLimit = 20.0;  // [s] simulated
const std::string kPrefix = channels::kDefaultPrefix;

class Controller {
 public:
  Controller(lcm::LCM& bus, std::string group) : bus_(bus), group_name_(std::move(group)) {
    bus_.subscribe(kPrefix + channels::kStatus, &Controller::on_status, this);
    bus_.subscribe(kPrefix + channels::kScene, &Controller::on_scene, this);
    bus_.subscribe(kPrefix + channels::kState, &Controller::on_state, this);
  }
  bool is_done() const { return is_done_; }
  int exit_code() const { return exit_code_; }

 private:
  void on_status(const lcm::ReceiveBuffer*, const std::string&, const msgs::status_t* status) {
    session_ = status->session;
  }

  void on_scene(const lcm::ReceiveBuffer*, const std::string&, const msgs::scene_t* scene) {
    rate_ = scene->rate;
    mass_ = scene->mass;
    for (int i = 0; i < scene->num_groups; ++i) {
      if (scene->groups[static_cast<std::size_t>(i)].name == group_name_) group_ = scene->first_group + i;
    }
  }

  void on_state(const lcm::ReceiveBuffer*, const std::string&, const msgs::state_t* state) {
    if (session_ == 0 || group_ < 0) return;
    const double* v = state->velocity;
    const double speed = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    if (first_speed_ < 0.0) first_speed_ = speed, first_time_ = state->time;
    const bool is_at_rest = speed <= 0.01 * first_speed_;
    if (is_at_rest || state->time > first_time_ + kTimeLimit) {
      std::printf("speed %.6f m/s -> %.6f m/s after %.3f s\n", first_speed_, speed,
                  state->time - first_time_);
      is_done_ = true;
      exit_code_ = is_at_rest ? 0 : 1;
      return;
    }
    msgs::wrench_t wrench{};
    wrench.group = group_;
    for (int k = 0; k < 3; ++k) wrench.force[k] = -kGain * mass_ * v[k];
    msgs::force_t force{};
    force.utime = state->utime;
    force.session = session_;
    force.sender = "example-controller";
    force.sequence = ++sequence_;
    force.start_tick = -1;
    force.lease_ticks = static_cast<std::int64_t>(kLease * rate_);
    force.num_wrenches = 1;
    force.wrenches.push_back(wrench);
    bus_.publish(kPrefix + channels::kForce, &force);
  }

  lcm::LCM& bus_;
  std::string group_name_;
  std::int64_t session_ = 0;
  std::int64_t sequence_ = 0;
  std::int32_t group_ = -1;
  double rate_ = 0.0;          // [Hz]
  double mass_ = 0.0;          // [kg]
  double first_speed_ = -1.0;  // [m/s]
  double first_time_ = 0.0;    // [s]
  bool is_done_ = false;
  int exit_code_ = 1;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: controller GROUP\n");
    return 2;
  }
  lcm::LCM bus;
  if (!bus.good()) {
    std::fprintf(stderr, "controller: no LCM network\n");
    return 1;
  }
  Controller controller(bus, argv[1]);
  while (!controller.is_done()) {
    if (bus.handleTimeout(10'000) <= 0) {
      std::fprintf(stderr, "controller: nothing heard for 10 s\n");
      return 1;
    }
  }
  return controller.exit_code();
}
