// What a client heard of its daemon last.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "service/bus_connection.hpp"
#include "service/client/client.hpp"
#include "service/io/wire/page_set.hpp"

namespace freeflex::client {

/// The last of each message of one session, each with a mark that no call returned it yet.
struct Daemon::Heard {
  /// \param suffix  of the channel behind the prefix
  void take(std::string_view suffix, const service::BusMessage& message);
  /// The epoch heard of last in this session.
  std::int64_t epoch() const;
  /// Forgets the motion of earlier epochs, and takes no more of it.
  void begin_epoch(std::int64_t epoch);

  std::int64_t session = 0;      // 0: none was heard
  std::int64_t least_epoch = 0;  // what is of an earlier one came before a reset by this client
  std::string unread;            // why the last STATUS could not be read
  SceneCatalogue scene;
  freeflex_msgs::status_t status{};
  std::optional<freeflex_msgs::state_t> state;
  std::optional<PointsTick> points;
  std::optional<LoadsTick> loads;
  bool has_new_status = false, has_new_state = false, has_new_points = false, has_new_loads = false;

  // the answer that is waited for
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
