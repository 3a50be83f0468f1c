#include "tools/bus/bus.hpp"

#include <CLI/App.hpp>
#include <algorithm>
#include <array>
#include <utility>

#include "service/io/wire/lcm_url.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

constexpr std::chrono::milliseconds kLongestWait{100};

}  // namespace

void add_bus_options(CLI::App& command, BusOptions& options) {
  command.add_option("--lcm-url", options.lcm_url, "LCM bus, default LCM_DEFAULT_URL, else LCM's own")
      ->type_name("URL");
  command.add_option("--prefix", options.prefix, "first part of the channel names")
      ->check(channel_prefix())
      ->type_name("NAME")
      ->capture_default_str();
}

Bus::Bus(const BusOptions& options) : options_(options) {
  options_.lcm_url = service::choose_url(options_.lcm_url);
  error_ = service::check_lcm_url(options_.lcm_url);
  is_usage_ = !error_.empty();
  if (error_.empty()) error_ = service::find_network_fault(options_.lcm_url);
  if (!error_.empty()) return;
  error_ = connection_.open(options_.lcm_url);
}

void Bus::subscribe(const std::string& channel, Handler handler) {
  handlers_.emplace_back(channel, std::move(handler));
}

bool Bus::publish(const std::string& channel, std::span<const std::byte> bytes) {
  return connection_.publish(channel, bytes);
}

bool Bus::wait(std::chrono::milliseconds time, const std::function<bool()>& done) {
  const auto end = std::chrono::steady_clock::now() + time;
  while (!done()) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    if (left.count() <= 0 || is_interrupted()) return false;
    // the waits are short, so that an interrupt is noticed
    const std::optional<BusMessage> message = connection_.receive(std::min(left, kLongestWait));
    if (!message) continue;
    for (const auto& [channel, handler] : handlers_)
      if (channel.empty() || channel == message->channel) handler(*message);
  }
  return true;
}

std::string Bus::describe() const { return options_.lcm_url + ", channels " + options_.prefix + "_*"; }

const char* validity_name(std::int32_t validity) {
  static constexpr std::array kNames{"good", "watch", "outside"};
  if (validity == freeflex_msgs::status_t::NOT_JUDGED) return "not judged";
  return validity >= 0 && validity < 3 ? kNames[index(validity)] : "?";
}

const char* mode_name(std::int32_t mode) {
  using freeflex_msgs::status_t;
  switch (mode) {
    case status_t::STARTING:
      return "starting";
    case status_t::RUNNING:
      return "running";
    case status_t::HOLDING:
      return "holding";
    case status_t::FAULT:
      return "fault";
    case status_t::STOPPED:
      return "stopped";
    default:
      return "unknown";
  }
}

std::int64_t wall_clock_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace freeflex::tools
