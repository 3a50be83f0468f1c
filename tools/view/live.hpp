// A daemon's messages to browsers, and their pushes to the daemon.
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

/// STATE as the page takes it (page/blob.js): doubles 1, tick, time, position, attitude, angular velocity,
/// number of wheels, their momenta; then the lowest elastic coordinates as floats.
std::vector<std::byte> state_frame(const Body& body, const freeflex_msgs::state_t& state);
/// Index in the state's coordinates of a mode of the body, counted from 0.
std::size_t place_of_mode(const Body& body, const freeflex_msgs::state_t& state, std::size_t mode);
/// [m] Elastic coordinate of a mode of the body, counted from 0.
float shown_coordinate(const Body& body, const freeflex_msgs::state_t& state, std::size_t mode);
/// Gathers one tick of LOADS for the page: a figure of each published link (link_figure), not a number where
/// no page has it. Holds these figures alone, however many pages a message claims.
class LoadFigures {
 public:
  /// \pre the body outlives it
  explicit LoadFigures(const Body& body);
  /// Takes a page of so many bytes. True when all pages of its tick came.
  bool take(const freeflex_msgs::loads_t& page, std::size_t size);
  /// In the order of Body::published_links.
  std::span<const float> figures() const { return figures_; }

 private:
  void forget();

  const Body* body_;
  io::PageSet pages_;
  std::vector<float> figures_;
};

/// One tick of LOADS as the page takes it: doubles 2, tick; then the figures as floats.
std::vector<std::byte> loads_frame(std::int64_t tick, std::span<const float> figures);
/// STATUS as the page takes it: the message's fields, and the modes that move (ModePeaks::largest).
std::string status_text(const freeflex_msgs::status_t& status, const Json& modes);

/// Relays one daemon. Called by one thread, but for take_text.
class Live {
 public:
  /// \param key  of pushes; empty: they go as they are
  Live(Body& body, Bus& bus, std::string prefix, std::optional<SealingKey> key);
  /// Before the first message is taken.
  void serve(PageServer& server) { server_ = &server; }

  /// What a page says: {"push": {"point": index, "force": [x, y, z]}} [N, world axes], or {"push": null}, and
  /// "by", its own name of at most 32 characters, which the answer bears. By any thread.
  void take_text(std::string_view text);
  /// Sends the pushes that came meanwhile.
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
  struct Asked {
    std::int64_t sequence;
    Json told;  // to the page that asked: by, point, force
  };
  std::string sender_;       // of this process alone
  std::deque<Asked> asked_;  // the last, without an answer
  std::int64_t session_ = 0, sequence_ = 0;
  double rate_ = 0.0;                         // [Hz]
  bool is_other_ = true;                      // the daemon moves another plan, or none is heard
  std::optional<std::uint64_t> fingerprint_;  // of what the daemon moves
  LoadFigures loads_;
  ModePeaks peaks_;
  std::mutex mutex_;  // of what follows
  struct Pending {
    freeflex_msgs::force_t force;
    std::string by;  // the page that asks
  };
  std::optional<Pending> pending_;
};

/// The motion of a recording as the page takes it, a Blob: at most 60 frames a second of simulated time and
/// 64 MB. Empty, explained in error, when the log holds none of this body.
/// \param damage  empty, or what of the log is not whole and is not in the motion
std::vector<std::byte> recorded_motion(Body& body, const std::string& log, const std::string& prefix,
                                       std::optional<std::int64_t> session, std::string& error,
                                       std::string& damage);
/// The plan or scene that a recording names; empty, explained in error.
std::string recorded_plan(const std::string& log, const std::string& prefix,
                          std::optional<std::int64_t> session, std::string& error);

/// The page with what it shows inside.
std::string page_with(const std::vector<std::byte>& body, const std::vector<std::byte>& motion);
/// The page as it was built, which asks its server for the rest.
std::string_view plain_page();

}  // namespace freeflex::tools
