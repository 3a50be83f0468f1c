#include "service/client/client.hpp"

#include <sys/random.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <utility>

#include "freeflex_msgs/control_t.hpp"
#include "freeflex_msgs/force_t.hpp"
#include "messages/channels.hpp"
#include "service/client/heard.hpp"
#include "service/client/key_file.hpp"
#include "service/io/wire/codec.hpp"
#include "service/io/wire/lcm_url.hpp"
#include "service/io/wire/reason.hpp"

namespace freeflex::client {
namespace {

using freeflex_msgs::ack_t, freeflex_msgs::control_t, freeflex_msgs::force_t, freeflex_msgs::state_t;
using Clock = std::chrono::steady_clock;

/// The name of an expected message, and a question for the user if the message does not arrive.
struct Awaited {
  std::string what, question;
};
const Awaited kStatus{"STATUS", "Is freeflexd running?"};
// [us] time within which a sealed command must reach the daemon
constexpr std::int64_t kValidity = 10'000'000;

std::int64_t wall_clock_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// Generates a sender name that no other controller uses.
std::string own_name() {
  std::uint32_t number = 0;
  if (getrandom(&number, sizeof number, 0) != sizeof number)
    number = static_cast<std::uint32_t>(wall_clock_us());
  return "client-" + std::to_string(getpid()) + "-" + std::to_string(number);
}

std::string seconds(std::chrono::milliseconds time) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g s", static_cast<double>(time.count()) * 1e-3);
  return text.data();
}

std::string rejection(const ack_t& ack) {
  const bool is_known = ack.reason >= 0 && ack.reason < io::kNumReasons;
  return "rejected: " +
         (is_known ? std::string(io::reason_name(static_cast<io::Reason>(ack.reason)))
                   : "reason " + std::to_string(ack.reason)) +
         ": " + ack.text;
}

/// Throws UnknownName with a text such as "there is no point 'nose'; the scene has a, b and 3 more".
template <class Names>
[[noreturn]] void refuse_name(const char* kind, std::string_view name, const Names& names) {
  constexpr std::size_t kShown = 20;
  std::string listed;
  std::size_t count = 0;
  for (const std::string& each : names) {
    if (each.empty()) continue;
    if (count++ < kShown) listed += (listed.empty() ? "" : ", ") + each;
  }
  if (count > kShown) listed += " and " + std::to_string(count - kShown) + " more";
  throw UnknownName("there is no " + std::string(kind) + " '" + std::string(name) + "'; the scene has " +
                    (listed.empty() ? "none" : listed));
}

template <class Items>
std::vector<std::string> names_of(const Items& items) {
  std::vector<std::string> names;
  names.reserve(items.size());
  for (const auto& item : items) names.push_back(item.name);
  return names;
}

template <class Items, class Index>
const auto& find_item(const Items& items, Index index, std::int32_t wanted, const char* kind,
                      const char* channel) {
  const auto found = std::lower_bound(items.begin(), items.end(), wanted,
                                      [&](const auto& item, std::int32_t at) { return item.*index < at; });
  if (found == items.end() || (*found).*index != wanted)
    throw UnknownName(std::string(kind) + " " + std::to_string(wanted) + " is not on " + channel +
                      "; publish it in the scene");
  return *found;
}

}  // namespace

Rejected::Rejected(ack_t answer) : Error(rejection(answer)), ack(std::move(answer)) {}

const freeflex_msgs::point_state_t& PointsTick::at(std::int32_t point) const {
  return find_item(points, &freeflex_msgs::point_state_t::point, point, "point", "POINTS");
}
const freeflex_msgs::link_load_t& LoadsTick::at(std::int32_t link) const {
  return find_item(links, &freeflex_msgs::link_load_t::link, link, "link", "LOADS");
}

/// The connection to the daemon: receives into `heard` and sends commands.
class Daemon::Line {
 public:
  Line(Options options, Heard& heard) : options_(std::move(options)), heard_(heard) {
    if (!options_.key_file.empty()) {
      key_.emplace();
      if (const std::string fault = read_key_file(options_.key_file, *key_); !fault.empty())
        throw NoBus(fault);
      options_.sender = key_->id;
    }
    if (options_.sender.empty()) options_.sender = own_name();
    if (!io::is_valid_sender(options_.sender))
      throw NoBus("sender '" + options_.sender + "' must be 1 to 31 of A-Z a-z 0-9 _ . -");
    heard_.sender = options_.sender;
    options_.url = service::choose_url(options_.url);
    std::string fault = service::check_lcm_url(options_.url);
    if (fault.empty()) fault = service::find_network_fault(options_.url);
    if (fault.empty()) fault = connection_.open(options_.url);
    if (!fault.empty()) throw NoBus(fault);
  }

  const Options& options() const { return options_; }

  /// Receives messages until `holds` returns true. Throws NoAnswer if it still returns false after
  /// Options::timeout.
  void wait(const std::function<bool()>& holds, const Awaited& awaited) {
    const Clock::time_point end = Clock::now() + options_.timeout;
    while (!holds()) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
      if (left.count() <= 0)
        throw NoAnswer("no " + awaited.what + " came within " + seconds(options_.timeout) + " on " +
                       options_.url + ", channels " + options_.prefix + "_*. " + question(awaited));
      const std::optional<service::BusMessage> message = connection_.receive(left);
      if (message && message->channel.starts_with(options_.prefix))
        heard_.take(message->channel.substr(options_.prefix.size()), *message);
    }
  }

  /// Sends a command to the daemon of this session and returns the daemon's answer. Throws Rejected if the
  /// answer is a rejection.
  template <class Command>
  ack_t ask(Command command, const char* suffix) {
    command.utime = wall_clock_us();
    command.session = heard_.session;
    command.sender = options_.sender;
    // a sequence number is at least the wall clock [us], so the numbers of a controller that is restarted
    // within one session continue to grow
    command.sequence = heard_.sequence = std::max(heard_.sequence + 1, command.utime);
    heard_.answer.reset();
    const std::string channel = options_.prefix + suffix;
    const std::vector<std::byte> bytes =
        key_ ? seal(command, channel, *key_, command.utime + kValidity) : io::encode(command);
    if (!connection_.publish(channel, bytes))
      throw NoAnswer("the network does not accept the command on " + options_.url);
    wait([&] { return heard_.answer || heard_.session != command.session; },
         {"answer", "The command is lost, the daemon has ended, or it does not have this key"});
    if (!heard_.answer || heard_.answer->session != command.session) {
      // the new daemon's rejection may arrive before its STATUS. The next command needs that STATUS, so wait
      // for it
      wait([&] { return heard_.session != command.session; }, kStatus);
      throw Restarted("the daemon was started again, so the command is lost; send it again");
    }
    if (heard_.answer->reason != 0) throw Rejected(*heard_.answer);
    return *heard_.answer;
  }

 private:
  std::string question(const Awaited& awaited) const {
    const bool is_unread = heard_.session == 0 && !heard_.unread.empty();
    return is_unread ? "A daemon is running, but its STATUS is " + heard_.unread : awaited.question;
  }

  Options options_;
  Heard& heard_;
  std::optional<SealingKey> key_;
  service::BusConnection connection_;
};

Daemon::Daemon(Options options) : heard_(std::make_unique<Heard>()) {
  line_ = std::make_unique<Line>(std::move(options), *heard_);
  line_->wait([this] { return heard_->session != 0; }, kStatus);
  await_scene();
}
Daemon::~Daemon() = default;

void Daemon::await_scene() {
  line_->wait([this] { return heard_->scene.is_complete(); },
              {"complete SCENE", "Does the daemon still run?"});
}

std::int64_t Daemon::session() const { return heard_->session; }
const std::string& Daemon::sender() const { return heard_->sender; }
const SceneCatalogue& Daemon::scene() const { return heard_->scene; }
const freeflex_msgs::status_t& Daemon::status() const { return heard_->status; }
const std::optional<state_t>& Daemon::state() const { return heard_->state; }
const std::optional<PointsTick>& Daemon::points() const { return heard_->points; }
const std::optional<LoadsTick>& Daemon::loads() const { return heard_->loads; }

const freeflex_msgs::status_t& Daemon::next_status() {
  line_->wait([this] { return heard_->has_new_status; }, kStatus);
  heard_->has_new_status = false;
  return heard_->status;
}
const state_t& Daemon::next_state() {
  line_->wait([this] { return heard_->has_new_state; }, {"STATE", "Does the scene publish it?"});
  heard_->has_new_state = false;
  return *heard_->state;
}
const PointsTick& Daemon::next_points() {
  line_->wait([this] { return heard_->has_new_points; }, {"POINTS", "Does the scene publish them?"});
  heard_->has_new_points = false;
  return *heard_->points;
}
const LoadsTick& Daemon::next_loads() {
  line_->wait([this] { return heard_->has_new_loads; }, {"LOADS", "Does the scene publish them?"});
  heard_->has_new_loads = false;
  return *heard_->loads;
}

std::int32_t Daemon::point(std::string_view name) const {
  if (const auto found = scene().find_point(name)) return *found;
  refuse_name("point", name, names_of(scene().points()));
}
std::int32_t Daemon::link(std::string_view name) const {
  if (const auto found = scene().find_link(name)) return *found;
  std::vector<std::string> names;
  for (const auto& [index, each] : scene().links()) names.push_back(each.name);
  refuse_name("link", name, names);
}
std::int32_t Daemon::group(std::string_view name) const {
  if (const auto found = scene().find_group(name)) return *found;
  refuse_name("group", name, names_of(scene().groups()));
}
std::int32_t Daemon::wheel(std::string_view name) const {
  if (const auto found = scene().find_wheel(name)) return *found;
  refuse_name("wheel", name, names_of(scene().head().wheels));
}

std::int64_t Daemon::push(const Push& push) {
  await_scene();
  force_t force{};
  force.slot = push.slot;
  force.axes = push.in_body_axes ? 1 : 0;
  force.start_tick = push.at_tick.value_or(-1);
  force.late_policy = push.late_ok ? 1 : 0;
  force.duration_ticks = ticks(push.duration);
  force.lease_ticks = ticks(push.lease);
  // a push lasts a whole number of ticks, so its loads are scaled to give the requested impulse
  const double wanted = push.duration * heard_->status.rate,
               given = static_cast<double>(force.duration_ticks);
  const double share = push.duration > 0.0 && std::abs(wanted - given) > 1e-6 ? wanted / given : 1.0;
  const auto copy = [share](const std::array<double, 3>& from, auto& to) {
    for (std::size_t i = 0; i < 3; ++i) to[i] = share * from[i];
  };
  for (const auto& [name, f] : push.forces) {
    force.forces.push_back({point(name), {}});
    copy(f, force.forces.back().force);
  }
  for (const auto& [name, t] : push.torques) {
    force.torques.push_back({point(name), {}});
    copy(t, force.torques.back().torque);
  }
  for (const auto& [name, w] : push.wrenches) {
    force.wrenches.push_back({group(name), {}, {}});
    copy(w.force, force.wrenches.back().force);
    copy(w.torque, force.wrenches.back().torque);
  }
  for (const auto& [name, t] : push.wheels) force.wheels.push_back({wheel(name), share * t});
  force.num_forces = static_cast<std::int32_t>(force.forces.size());
  force.num_torques = static_cast<std::int32_t>(force.torques.size());
  force.num_wrenches = static_cast<std::int32_t>(force.wrenches.size());
  force.num_wheels = static_cast<std::int32_t>(force.wheels.size());
  return line_->ask(std::move(force), channels::kForce).tick;
}

std::int64_t Daemon::ticks(double time) const {
  // a time out of range gives a number of ticks that the daemon rejects
  if (!(time > 0.0)) return time == 0.0 ? 0 : -1;
  const double whole = std::min(std::round(time * heard_->status.rate), 1e18);
  return std::max<std::int64_t>(1, static_cast<std::int64_t>(whole));
}

std::int64_t Daemon::control(std::int32_t command, std::int64_t count) {
  control_t control{};
  control.command = command;
  control.count = count;
  return line_->ask(std::move(control), channels::kControl).tick;
}
std::int64_t Daemon::run() { return control(control_t::RUN, 0); }
std::int64_t Daemon::hold() { return control(control_t::HOLD, 0); }
std::int64_t Daemon::reset() {
  const std::int64_t epoch = heard_->epoch() + 1;
  const std::int64_t tick = control(control_t::RESET, 0);
  heard_->begin_epoch(epoch);
  return tick;
}
std::int64_t Daemon::stop() { return control(control_t::STOP, 0); }

const state_t& Daemon::step(std::int64_t ticks) {
  const std::int64_t session = heard_->session;
  const std::int64_t end = control(control_t::STEP, ticks) + ticks;
  line_->wait([&] { return heard_->session != session || (heard_->state && heard_->state->tick >= end); },
              {"STATE of tick " + std::to_string(end), "Does the scene publish it?"});
  if (heard_->session != session) throw Restarted("the daemon was started again");
  heard_->has_new_state = false;
  return *heard_->state;
}

}  // namespace freeflex::client
