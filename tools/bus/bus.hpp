// Connects the tools to the message bus.
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

/// Network and channel prefix of a daemon.
struct BusOptions {
  std::string lcm_url;              // empty: LCM_DEFAULT_URL, else LCM's default
  std::string prefix = "FREEFLEX";  // first part of the channel names
};

using client::SceneCatalogue;
using service::BusMessage;

/// Adds --lcm-url and --prefix.
void add_bus_options(CLI::App& command, BusOptions& options);

/// One connection to the bus. It cannot be copied, and only one thread may use it.
class Bus {
 public:
  using Handler = std::function<void(const BusMessage&)>;

  explicit Bus(const BusOptions& options);
  /// Returns the reason why there is no bus, with the commands that provide one, or an empty text if there is
  /// no error.
  const std::string& error() const { return error_; }
  /// Returns true if the cause of the error is in the arguments, or false if the cause is in the machine.
  bool is_usage_error() const { return is_usage_; }
  /// Makes wait() call the handler for every message on the channel. An empty name means all channels.
  void subscribe(const std::string& channel, Handler handler);
  bool publish(const std::string& channel, std::span<const std::byte> bytes);
  /// Handles messages until done() is true. Returns false if the time runs out before that.
  bool wait(std::chrono::milliseconds time, const std::function<bool()>& done);

  /// Returns "udpm://..., channels FREEFLEX_*", for messages to the user.
  std::string describe() const;

 private:
  BusOptions options_;
  std::string error_;
  bool is_usage_ = false;
  std::vector<std::pair<std::string, Handler>> handlers_;  // with their channels
  service::BusConnection connection_;
};

/// mode_name returns the name of a value of status_t.mode, and validity_name returns the name of a value of
/// status_t.validity.
const char* mode_name(std::int32_t mode);
const char* validity_name(std::int32_t validity);  // "good", "watch", "outside"

/// Returns the time of the wall clock [us] since 1970.
std::int64_t wall_clock_us();

}  // namespace freeflex::tools
