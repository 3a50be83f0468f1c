// A daemon as a controller sees it: heard, commanded, stepped. Session, sequence, leases, indices and answers
// are inside. It needs no core: the messages, libsodium for keys, and a socket.
//
//   freeflex::client::Daemon daemon;                     // a freeflexd that runs
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

/// What any call below throws; the text says what to do.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// There is no bus at the url, or the key file holds no key.
struct NoBus : Error {
  using Error::Error;
};
/// A message that was waited for did not come within Options::timeout.
struct NoAnswer : Error {
  using Error::Error;
};
/// Another daemon took the place of the one that a command was sent to: the command is lost, and the motion
/// begins anew. The next call goes to the new daemon.
struct Restarted : Error {
  using Error::Error;
};
/// The scene has nothing of this name or index; the text names what there is.
struct UnknownName : Error {
  using Error::Error;
};
/// The daemon refused a command: "rejected: late: ...".
struct Rejected : Error {
  explicit Rejected(freeflex_msgs::ack_t answer);
  freeflex_msgs::ack_t ack;  // reason and text by messages/README.md, section 6
};

struct Options {
  std::string prefix = "FREEFLEX";  // of the channels
  std::string url{};                // of the bus; empty: LCM_DEFAULT_URL, else LCM's default
  std::string sender{};    // name of this controller, of which there must not be two; empty: one of its own
  std::string key_file{};  // of `freeflex keygen`, for a daemon that requires keys; its id becomes the sender
  std::chrono::milliseconds timeout{5'000};  // [ms] that a message or an answer may take
};

using Vector = std::array<double, 3>;
struct Wrench {
  Vector force{};   // [N]
  Vector torque{};  // [N m]
};

/// Loads that replace what this sender has in a slot. Without any it clears the slot.
struct Push {
  std::map<std::string, Vector> forces{};    // [N] by point
  std::map<std::string, Vector> torques{};   // [N m] by point that has inertia
  std::map<std::string, Wrench> wrenches{};  // by group
  std::map<std::string, double> wheels{};    // [N m] of the motor, by wheel
  bool in_body_axes = false;                 // else in world axes
  int slot = 0;
  double duration = 0.0;  // [s] after which it ends; exactly one of the two is > 0
  double lease = 0.0;     // [s] within which it is to be renewed, by the next push into the slot
  std::optional<std::int64_t> at_tick{};  // at which it begins, else at once
  bool late_ok = false;                   // begins at once when at_tick has passed, else it is rejected
};

/// One tick of POINTS, all of its pages.
struct PointsTick {
  std::int64_t session = 0, epoch = 0, tick = 0;
  std::vector<freeflex_msgs::point_state_t> points;  // by ascending index
  std::vector<freeflex_msgs::group_pose_t> groups;   // by ascending index
  std::vector<freeflex_msgs::body_state_t> bodies;   // by ascending index of the point
  /// The point of this index. UnknownName: it is not published.
  const freeflex_msgs::point_state_t& at(std::int32_t point) const;
};

/// One tick of LOADS, all of its pages.
struct LoadsTick {
  std::int64_t session = 0, epoch = 0, tick = 0;
  std::vector<freeflex_msgs::link_load_t> links;  // by ascending index
  /// The link of this index. UnknownName: it is not published.
  const freeflex_msgs::link_load_t& at(std::int32_t link) const;
};

/// A daemon on the bus. Receives in its methods alone, has no thread, and is used by one thread. It holds the
/// last of each message and no more than the scene publishes. When a daemon is started again it takes that
/// one up: session() changes, and all that was heard is forgotten.
class Daemon {
 public:
  /// Waits for STATUS and the whole SCENE. NoBus, NoAnswer.
  explicit Daemon(Options options = {});
  ~Daemon();
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  std::int64_t session() const;
  const std::string& sender() const;
  const SceneCatalogue& scene() const;
  const freeflex_msgs::status_t& status() const;               // the last
  const std::optional<freeflex_msgs::state_t>& state() const;  // the last, if any
  const std::optional<PointsTick>& points() const;             // the last that is whole, if any
  const std::optional<LoadsTick>& loads() const;               // the last that is whole, if any

  /// The first that no earlier call returned, waited for; what came while a command was answered counts, and
  /// of several that did the last is returned. Valid until the next call of this class. NoAnswer.
  const freeflex_msgs::status_t& next_status();
  const freeflex_msgs::state_t& next_state();
  const PointsTick& next_points();
  const LoadsTick& next_loads();

  /// Index by name. UnknownName.
  std::int32_t point(std::string_view name) const;
  std::int32_t link(std::string_view name) const;
  std::int32_t group(std::string_view name) const;
  std::int32_t wheel(std::string_view name) const;

  // Commands wait for their answer and return the tick at which they take effect. Rejected, NoAnswer,
  // Restarted.

  /// UnknownName: a name of the push.
  std::int64_t push(const Push& push);
  std::int64_t run();   // ticks follow the clock
  std::int64_t hold();  // stands at its tick
  std::int64_t stop();  // ends the daemon in order
  /// Back to the start, in a new epoch. Motion of earlier epochs is not returned any more.
  std::int64_t reset();
  /// Steps a daemon that stands by so many ticks. Returns the STATE after them; the scene must publish it at
  /// that tick, or it comes within a second.
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
