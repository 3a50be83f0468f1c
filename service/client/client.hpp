// A client of one daemon, for controllers. The client receives the daemon's messages, sends commands and
// steps the daemon. It fills in session, sequence numbers and indices, and waits for the answers. It needs
// the message types, libsodium (for keys) and a socket, but not the core library.
//
//   freeflex::client::Daemon daemon;                     // connects to a running freeflexd
//   daemon.push({.forces = {{"tip", {0, 0, 10}}}, .duration = 0.5});
//   std::printf("%g\n", daemon.next_state().position[2]);
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "freeflex_msgs/ack_t.hpp"
#include "freeflex_msgs/loads_t.hpp"
#include "freeflex_msgs/points_t.hpp"
#include "freeflex_msgs/state_t.hpp"
#include "freeflex_msgs/status_t.hpp"
#include "service/client/scene_catalogue.hpp"

namespace freeflex::client {

/// The base class of all errors that the calls below throw. The text of an error says what to do.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// The bus at the url cannot be opened, the key file contains no key, or the name of the sender is invalid.
struct NoBus : Error {
  using Error::Error;
};
/// An expected message did not arrive within Options::timeout.
struct NoAnswer : Error {
  using Error::Error;
};
/// A new daemon has replaced the daemon to which the command was sent. Therefore the command is lost, and the
/// motion starts again from the initial state. The next call goes to the new daemon.
struct Restarted : Error {
  using Error::Error;
};
/// The scene has no item of this name, or the daemon does not publish the item of this index. For a name, the
/// text of the error lists the names that exist.
struct UnknownName : Error {
  using Error::Error;
};
/// The daemon refused a command: "rejected: late: ...".
struct Rejected : Error {
  explicit Rejected(freeflex_msgs::ack_t answer);
  freeflex_msgs::ack_t ack;  // reason and text as in messages/README.md, section 6
};

struct Options {
  std::string prefix = "FREEFLEX";  // first part of the channel names
  std::string url{};                // url of the bus; empty: LCM_DEFAULT_URL, else LCM's default
  std::string sender{};             // unique name of this controller, empty for a generated name
  std::string key_file{};  // key file from `freeflex keygen`, if the daemon requires keys; the id of the key
                           // then replaces `sender`
  std::chrono::milliseconds timeout{5'000};  // [ms] longest wait for a message or an answer
};

using Vector = std::array<double, 3>;
struct Wrench {
  Vector force{};   // [N]
  Vector torque{};  // [N m]
};

/// Loads that replace the contents of one slot of this sender. A push without loads clears the slot.
struct Push {
  std::map<std::string, Vector> forces{};    // [N] by name of the point
  std::map<std::string, Vector> torques{};   // [N m] by name of the point, which must have inertia
  std::map<std::string, Wrench> wrenches{};  // by name of the group
  std::map<std::string, double> wheels{};    // [N m] motor torque, by name of the wheel
  bool in_body_axes = false;                 // false: world axes
  int slot = 0;
  double duration = 0.0;  // [s] time after which the loads end; exactly one of duration and lease is > 0
  double lease = 0.0;     // [s] time within which the next push into the slot must renew the loads
  std::optional<std::int64_t> at_tick{};  // tick at which the loads begin, empty for the next tick
  bool late_ok = false;  // if at_tick has passed: true: the loads begin at once; false: the push is rejected
};

/// The points, groups and bodies of one tick, collected from all pages of POINTS.
struct PointsTick {
  std::int64_t session = 0, epoch = 0, tick = 0;
  std::vector<freeflex_msgs::point_state_t> points;  // ordered by index
  std::vector<freeflex_msgs::group_pose_t> groups;   // ordered by index
  std::vector<freeflex_msgs::body_state_t> bodies;   // ordered by index of the point
  /// Returns the point of this index. Throws UnknownName if the point is not published.
  const freeflex_msgs::point_state_t& at(std::int32_t point) const;
};

/// The link loads of one tick, collected from all pages of LOADS.
struct LoadsTick {
  std::int64_t session = 0, epoch = 0, tick = 0;
  std::vector<freeflex_msgs::link_load_t> links;  // ordered by index
  /// Returns the link of this index. Throws UnknownName if the link is not published.
  const freeflex_msgs::link_load_t& at(std::int32_t link) const;
};

/// The connection to a daemon on the bus. Receives messages only inside its methods and starts no thread.
/// Only one thread may use it. Keeps the latest message of each type that the scene publishes. If the daemon
/// is restarted, this object follows the new daemon. Then session() changes, and the object forgets all
/// earlier messages.
class Daemon {
 public:
  /// Waits for STATUS and all pages of SCENE. Throws NoBus, NoAnswer.
  explicit Daemon(Options options = {});
  ~Daemon();
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  std::int64_t session() const;
  const std::string& sender() const;
  const SceneCatalogue& scene() const;
  const freeflex_msgs::status_t& status() const;               // the latest STATUS
  const std::optional<freeflex_msgs::state_t>& state() const;  // the latest STATE, if one was received
  const std::optional<PointsTick>& points() const;             // the latest tick of which all pages arrived
  const std::optional<LoadsTick>& loads() const;               // the latest tick of which all pages arrived

  /// Each function returns the latest message that no earlier call returned, and waits for one if there is
  /// none. The message may have arrived while another call waited for an answer. The returned reference is
  /// valid until the next call of a function of this object. Throws NoAnswer.
  const freeflex_msgs::status_t& next_status();
  const freeflex_msgs::state_t& next_state();
  const PointsTick& next_points();
  const LoadsTick& next_loads();

  /// Returns the index of the item with this name. Throws UnknownName if the scene has no such item.
  std::int32_t point(std::string_view name) const;
  std::int32_t link(std::string_view name) const;
  std::int32_t group(std::string_view name) const;
  std::int32_t wheel(std::string_view name) const;

  // Each function below sends a command and waits for its answer. All except step() return the tick at which
  // the command takes effect. They throw Rejected, NoAnswer and Restarted.

  /// Sends the push. Also throws UnknownName if the scene lacks a name that the push contains.
  std::int64_t push(const Push& push);
  std::int64_t run();   // makes the ticks follow the clock from now on
  std::int64_t hold();  // pauses the simulation at its tick
  std::int64_t stop();  // ends the daemon cleanly
  /// Sets the daemon back to the initial state, in a new epoch. No later call returns motion of an earlier
  /// epoch.
  std::int64_t reset();
  /// Advances a holding daemon by this many ticks and returns the STATE after the last of them. The daemon
  /// publishes this STATE even if the scene's publication rate skips the tick.
  const freeflex_msgs::state_t& step(std::int64_t ticks = 1);

 private:
  struct Heard;
  class Line;

  void await_scene();
  std::int64_t ticks(double time) const;
  std::int64_t control(std::int32_t command, std::int64_t count);

  std::unique_ptr<Line> line_;
  std::unique_ptr<Heard> heard_;
};

}  // namespace freeflex::client
