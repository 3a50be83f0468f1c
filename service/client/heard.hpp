// The messages that a client received from its daemon.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "service/bus_connection.hpp"
#include "service/client/client.hpp"
#include "service/io/wire/page_set.hpp"

namespace freeflex::client {

/// The latest message of each type in one session. Each has_new flag is true while no call has returned the
/// latest message of its type.
struct Daemon::Heard {
  /// Reads and keeps a message.  \param suffix  part of the channel name after the prefix
  void take(std::string_view suffix, const service::BusMessage& message);
  /// Returns the latest epoch received in this session.
  std::int64_t epoch() const;
  /// Forgets the motion of earlier epochs, and from now on ignores messages of earlier epochs.
  void begin_epoch(std::int64_t epoch);

  std::int64_t session = 0;  // 0: no STATUS yet
  // messages of epochs below this one are ignored, because they precede a reset by this client
  std::int64_t least_epoch = 0;
  std::string unread;  // why the latest STATUS could not be read
  SceneCatalogue scene;
  freeflex_msgs::status_t status{};
  std::optional<freeflex_msgs::state_t> state;
  std::optional<PointsTick> points;
  std::optional<LoadsTick> loads;
  bool has_new_status = false, has_new_state = false, has_new_points = false, has_new_loads = false;

  // the command whose answer is expected, and the answer after it has arrived
  std::string sender;
  std::int64_t sequence = 0;
  std::optional<freeflex_msgs::ack_t> answer;

 private:
  void take_status(const service::BusMessage& message);
  void take_points(const service::BusMessage& message);
  void take_loads(const service::BusMessage& message);
  void take_answer(const service::BusMessage& message);

  io::PageSet point_pages_, load_pages_;
  PointsTick points_at_hand_;
  LoadsTick loads_at_hand_;
};

}  // namespace freeflex::client
