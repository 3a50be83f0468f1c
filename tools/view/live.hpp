// Relays a daemon's messages to browsers, and the browsers' pushes to the daemon.
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "freeflex_msgs/force_t.hpp"
#include "freeflex_msgs/loads_t.hpp"
#include "freeflex_msgs/points_t.hpp"
#include "freeflex_msgs/state_t.hpp"
#include "freeflex_msgs/status_t.hpp"
#include "messages/seal.hpp"
#include "service/io/wire/page_set.hpp"
#include "tools/bus/bus.hpp"
#include "tools/view/body.hpp"
#include "tools/view/mode_peaks.hpp"
#include "tools/view/server.hpp"

namespace freeflex::tools {

/// Returns STATE in the format of the page (page/blob.js): as doubles 1 (the kind of frame), tick, time,
/// position, attitude, angular velocity, number of wheels, momenta of the wheels; then, as floats, the
/// elastic coordinates of the body's modes.
std::vector<std::byte> state_frame(const Body& body, const freeflex_msgs::state_t& state);
/// Returns the index, in the coordinates of the state, of a mode of the body. `mode` is counted from 0.
std::size_t coordinate_of_mode(const Body& body, const freeflex_msgs::state_t& state, std::size_t mode);
/// Returns the elastic coordinate [m] of a mode of the body, or 0 if the state lacks the mode. `mode` is
/// counted from 0.
float shown_coordinate(const Body& body, const freeflex_msgs::state_t& state, std::size_t mode);
/// Collects one tick of LOADS for the page: link_figure of each published link, NaN if no page of LOADS
/// contains the link. Stores only these values, whatever number of pages a message claims.
class LoadFigures {
 public:
  /// \pre the body outlives this object
  explicit LoadFigures(const Body& body);
  /// Adds a page of LOADS of `size` bytes. Returns true if all pages of its tick have come.
  bool take(const freeflex_msgs::loads_t& page, std::size_t size);
  /// Returns the values in the order of Body::published_links.
  std::span<const float> figures() const { return figures_; }

 private:
  void forget();

  const Body* body_;
  io::PageSet pages_;
  std::vector<float> figures_;
};

/// Returns one tick of LOADS in the format of the page: as doubles 2 (the kind of frame) and tick; then, as
/// floats, the values.
std::vector<std::byte> loads_frame(std::int64_t tick, std::span<const float> figures);
/// Returns STATUS in the format of the page: the fields of the message, and the modes that move
/// (ModePeaks::largest).
std::string status_text(const freeflex_msgs::status_t& status, const Json& modes);

/// Relays the messages of one daemon. Only one thread may use an object, except for take_text.
class Live {
 public:
  /// \param key  key for pushes; empty: pushes are not sealed
  Live(Body& body, Bus& bus, std::string prefix, std::optional<SealingKey> key);
  /// Sets the server. Must be called before the first message is taken.
  void serve(PageServer& server) { server_ = &server; }

  /// Takes a text from a page: {"push": {"point": index, "force": [x, y, z]}} [N, world axes], or {"push":
  /// null}. In addition "by" is the name of the page, which is cut to 32 bytes and which the answer repeats.
  /// Any thread may call this function.
  void take_text(std::string_view text);
  /// Sends the push that came since the last call, if there is one.
  void push();

 private:
  void take_status(const BusMessage& message);
  void take_state(const BusMessage& message);
  void take_loads(const BusMessage& message);
  void take_ack(const BusMessage& message);

  Body& body_;
  Bus& bus_;
  std::string prefix_;
  std::optional<SealingKey> key_;
  PageServer* server_ = nullptr;
  struct Unanswered {
    std::int64_t sequence;
    Json answer;  // answer for the page that asked: by, point, force
  };
  std::string sender_;                 // id of the key, or without a key a name that only this process uses
  std::deque<Unanswered> unanswered_;  // the latest pushes without an answer
  std::int64_t session_ = 0, sequence_ = 0;
  double rate_ = 0.0;                         // [Hz]
  bool is_other_ = true;                      // true if the daemon runs another plan, or there is no daemon
  std::optional<std::uint64_t> fingerprint_;  // fingerprint of the daemon's plan
  LoadFigures loads_;
  ModePeaks peaks_;
  std::mutex mutex_;  // guards pending_
  struct Pending {
    freeflex_msgs::force_t force;
    std::string by;  // name of the page that asks
  };
  std::optional<Pending> pending_;
};

/// Returns the motion of a recording as a Blob for the page: at most 60 frames per second of simulated time
/// and 64 MB. If the log contains no motion of this body, sets `error` to the reason and returns an empty
/// list.
/// \param damage  set to a text about the damage of the log; the damaged part is not in the motion; empty if
///   there is none
std::vector<std::byte> recorded_motion(Body& body, const std::string& log, const std::string& prefix,
                                       std::optional<std::int64_t> session, std::string& error,
                                       std::string& damage);
/// Returns the path of the plan or scene that a recording names. If there is none, sets `error` to the reason
/// and returns an empty text.
std::string recorded_plan(const std::string& log, const std::string& prefix,
                          std::optional<std::int64_t> session, std::string& error);

/// Returns the page with its data included.
std::string page_with(const std::vector<std::byte>& body, const std::vector<std::byte>& motion);
/// Returns the page as it was built, which loads its data from the server.
std::string_view plain_page();

}  // namespace freeflex::tools
