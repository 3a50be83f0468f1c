#include "service/client/heard.hpp"

#include <algorithm>

#include "messages/channels.hpp"
#include "service/io/wire/decode.hpp"
#include "service/io/wire/versions.hpp"

namespace freeflex::client {
namespace {

/// Returns true if the index of every item is at least 0 and below the count.
template <class Item>
bool are_within(const std::vector<Item>& items, std::int32_t Item::*index, std::size_t count) {
  return std::all_of(items.begin(), items.end(), [&](const Item& item) {
    return item.*index >= 0 && static_cast<std::size_t>(item.*index) < count;
  });
}

template <class Item>
void append(std::vector<Item>& all, const std::vector<Item>& items) {
  all.insert(all.end(), items.begin(), items.end());
}

template <class Item>
void sort(std::vector<Item>& items, std::int32_t Item::*index) {
  std::sort(items.begin(), items.end(), [&](const Item& a, const Item& b) { return a.*index < b.*index; });
}

}  // namespace

void Daemon::Heard::take(std::string_view suffix, const service::BusMessage& message) {
  if (suffix == channels::kStatus) return take_status(message);
  if (suffix == channels::kAck) return take_answer(message);
  if (suffix == channels::kPoints) return take_points(message);
  if (suffix == channels::kLoads) return take_loads(message);
  if (suffix == channels::kState) {
    freeflex_msgs::state_t found;
    if (!io::decode_message(message.bytes, found) || found.session != session || found.epoch < least_epoch)
      return;
    state = std::move(found);
    has_new_state = true;
  } else if (suffix == channels::kScene) {
    freeflex_msgs::scene_t page;
    if (io::decode_message(message.bytes, page) && page.session == session)
      scene.take(page, message.bytes.size());
  }
}

std::int64_t Daemon::Heard::epoch() const {
  return std::max({least_epoch, status.epoch, state ? state->epoch : 0});
}

void Daemon::Heard::begin_epoch(std::int64_t epoch) {
  least_epoch = epoch;
  const auto forget_earlier = [epoch](auto& heard, bool& is_new) {
    if (!heard || heard->epoch >= epoch) return;
    heard.reset();
    is_new = false;
  };
  forget_earlier(state, has_new_state);
  forget_earlier(points, has_new_points);
  forget_earlier(loads, has_new_loads);
}

void Daemon::Heard::take_status(const service::BusMessage& message) {
  freeflex_msgs::status_t found;
  if (!io::decode_message(message.bytes, found)) {
    unread = io::explain_unread(message.bytes);
    return;
  }
  if (found.session != session) {
    session = found.session;
    least_epoch = 0;
    scene = {};
    state.reset();
    points.reset();
    loads.reset();
    point_pages_.clear();
    load_pages_.clear();
    has_new_state = has_new_points = has_new_loads = false;
  }
  status = std::move(found);
  has_new_status = true;
}

void Daemon::Heard::take_points(const service::BusMessage& message) {
  freeflex_msgs::points_t page;
  if (!scene.is_complete() || !io::decode_message(message.bytes, page) || page.session != session ||
      page.epoch < least_epoch)
    return;
  using freeflex_msgs::body_state_t, freeflex_msgs::group_pose_t, freeflex_msgs::point_state_t;
  const std::size_t num_points = scene.points().size();
  if (!are_within(page.points, &point_state_t::point, num_points) ||
      !are_within(page.groups, &group_pose_t::group, scene.groups().size()) ||
      !are_within(page.bodies, &body_state_t::point, num_points))
    return;
  const io::PageSet::Taken taken =
      point_pages_.take({page.session, page.epoch, page.tick}, page.page, page.num_pages,
                        scene.max_point_pages(), message.bytes.size());
  if (taken.is_first) points_at_hand_ = {page.session, page.epoch, page.tick, {}, {}, {}};
  if (!taken.is_kept) return;
  append(points_at_hand_.points, page.points);
  append(points_at_hand_.groups, page.groups);
  append(points_at_hand_.bodies, page.bodies);
  if (!taken.is_whole) return;
  sort(points_at_hand_.points, &point_state_t::point);
  sort(points_at_hand_.groups, &group_pose_t::group);
  sort(points_at_hand_.bodies, &body_state_t::point);
  points = std::move(points_at_hand_);
  has_new_points = true;
}

void Daemon::Heard::take_loads(const service::BusMessage& message) {
  freeflex_msgs::loads_t page;
  if (!scene.is_complete() || !io::decode_message(message.bytes, page) || page.session != session ||
      page.epoch < least_epoch)
    return;
  using freeflex_msgs::link_load_t;
  if (!are_within(page.links, &link_load_t::link, static_cast<std::size_t>(scene.head().total_links))) return;
  const io::PageSet::Taken taken =
      load_pages_.take({page.session, page.epoch, page.tick}, page.page, page.num_pages,
                       scene.max_load_pages(), message.bytes.size());
  if (taken.is_first) loads_at_hand_ = {page.session, page.epoch, page.tick, {}};
  if (!taken.is_kept) return;
  append(loads_at_hand_.links, page.links);
  if (!taken.is_whole) return;
  sort(loads_at_hand_.links, &link_load_t::link);
  loads = std::move(loads_at_hand_);
  has_new_loads = true;
}

void Daemon::Heard::take_answer(const service::BusMessage& message) {
  freeflex_msgs::ack_t found;
  // accepts an answer of any session, because a restarted daemon rejects a command meant for its predecessor,
  // and that rejection has the new session
  if (io::decode_message(message.bytes, found) && found.sender == sender && found.sequence == sequence)
    answer = std::move(found);
}

}  // namespace freeflex::client
