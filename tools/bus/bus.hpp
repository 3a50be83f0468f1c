// The message bus as a tool sees it.
#pragma once

#include <lcm/lcm.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "freeflex_msgs/scene_t.hpp"
#include "freeflex_msgs/status_t.hpp"

namespace CLI {
class App;
}

namespace freeflex::tools {

/// Where a daemon is to be found.
struct BusOptions {
  std::string lcm_url;              // empty: LCM_DEFAULT_URL, else LCM's default
  std::string prefix = "FREEFLEX";  // of the channel names
};

struct BusMessage {
  std::string_view channel;
  std::span<const std::byte> bytes;
  std::int64_t utime;  // [us] reception
};

/// --lcm-url and --prefix.
void add_bus_options(CLI::App& command, BusOptions& options);

/// One LCM connection. Not copyable, one thread.
class Bus {
 public:
  using Handler = std::function<void(const BusMessage&)>;

  explicit Bus(const BusOptions& options);
  /// Empty, or why there is no bus, with the commands that make one.
  const std::string& error() const { return error_; }
  /// The error is in what the user gave, not in the machine.
  bool is_usage_error() const { return is_usage_; }
  /// Calls handler for every message on channels that match the regular expression, from within wait().
  void subscribe(const std::string& pattern, Handler handler);
  bool publish(const std::string& channel, std::span<const std::byte> bytes);
  /// Handles messages until time runs out or done() holds. False when time ran out.
  bool wait(std::chrono::milliseconds time, const std::function<bool()>& done);

  /// "udpm://... , prefix FREEFLEX", for messages.
  std::string describe() const;

 private:
  static void receive(const lcm_recv_buf_t* buffer, const char* channel, void* handler);
  struct Close {
    void operator()(lcm_t* lcm) const { lcm_destroy(lcm); }
  };
  BusOptions options_;
  std::string error_;
  bool is_usage_ = false;
  std::vector<std::unique_ptr<Handler>> handlers_;
  std::unique_ptr<lcm_t, Close> lcm_;
};

/// What the indices of the messages mean, gathered from the pages of FREEFLEX_SCENE.
class SceneCatalogue {
 public:
  /// Takes a page; pages of another session start over.
  void take(const freeflex_msgs::scene_t& page);
  bool is_complete() const;
  /// Points that no page says anything of: nobody reads, pushes or loads them. \pre is_complete()
  std::size_t num_unlisted() const { return points_.size() - num_listed_; }
  const freeflex_msgs::scene_t& head() const { return head_; }
  const std::vector<freeflex_msgs::scene_point_t>& points() const { return points_; }
  const std::vector<freeflex_msgs::scene_link_t>& links() const { return links_; }
  const std::vector<freeflex_msgs::scene_group_t>& groups() const { return groups_; }
  const std::vector<double>& frequencies() const { return frequencies_; }  // [Hz]
  /// Index by name; nullopt when there is none.
  std::optional<std::int32_t> find_point(const std::string& name) const;
  std::optional<std::int32_t> find_group(const std::string& name) const;

 private:
  freeflex_msgs::scene_t head_{};
  std::vector<bool> has_page_;
  std::size_t num_listed_ = 0;
  std::vector<freeflex_msgs::scene_point_t> points_;  // without a name where they are not listed
  std::vector<freeflex_msgs::scene_link_t> links_;
  std::vector<freeflex_msgs::scene_group_t> groups_;
  std::vector<double> frequencies_;
};

/// Names of status_t.mode and of status_t.validity.
const char* mode_name(std::int32_t mode);
const char* validity_name(std::int32_t validity);  // "good", "watch", "outside"

/// [us] since 1970.
std::int64_t wall_clock_us();

}  // namespace freeflex::tools
