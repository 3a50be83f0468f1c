// The message bus as a tool sees it.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "freeflex_msgs/status_t.hpp"
#include "service/bus_connection.hpp"
#include "service/client/scene_catalogue.hpp"

namespace CLI {
class App;
}

namespace freeflex::tools {

/// Where a daemon is to be found.
struct BusOptions {
  std::string lcm_url;              // empty: LCM_DEFAULT_URL, else LCM's default
  std::string prefix = "FREEFLEX";  // of the channel names
};

using client::SceneCatalogue;
using service::BusMessage;

/// --lcm-url and --prefix.
void add_bus_options(CLI::App& command, BusOptions& options);

/// One connection to the bus. Not copyable, one thread.
class Bus {
 public:
  using Handler = std::function<void(const BusMessage&)>;

  explicit Bus(const BusOptions& options);
  /// Empty, or why there is no bus, with the commands that make one.
  const std::string& error() const { return error_; }
  /// The error is in what the user gave, not in the machine.
  bool is_usage_error() const { return is_usage_; }
  /// Calls handler for every message on the channel, of all channels when it is empty, from within wait().
  void subscribe(const std::string& channel, Handler handler);
  bool publish(const std::string& channel, std::span<const std::byte> bytes);
  /// Handles messages until time runs out or done() holds. False when time ran out.
  bool wait(std::chrono::milliseconds time, const std::function<bool()>& done);

  /// "udpm://... , prefix FREEFLEX", for messages.
  std::string describe() const;

 private:
  BusOptions options_;
  std::string error_;
  bool is_usage_ = false;
  std::vector<std::pair<std::string, Handler>> handlers_;  // by channel
  service::BusConnection connection_;
};

/// Names of status_t.mode and of status_t.validity.
const char* mode_name(std::int32_t mode);
const char* validity_name(std::int32_t validity);  // "good", "watch", "outside"

/// [us] since 1970.
std::int64_t wall_clock_us();

}  // namespace freeflex::tools
