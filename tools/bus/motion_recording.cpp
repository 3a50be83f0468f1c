// Reads a recording of a motion. The recording has STATE, POINTS and LOADS of one session, and the names come
// from the SCENE of the session.
#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <string_view>
#include <tuple>
#include <utility>

#include "freeflex_msgs/loads_t.hpp"
#include "freeflex_msgs/points_t.hpp"
#include "freeflex_msgs/scene_t.hpp"
#include "freeflex_msgs/state_t.hpp"
#include "messages/channels.hpp"
#include "service/io/wire/codec.hpp"
#include "service/io/wire/decode.hpp"
#include "tools/bus/motion_sources.hpp"
#include "tools/bus/recording.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

using freeflex_msgs::loads_t;
using freeflex_msgs::points_t;
using freeflex_msgs::scene_t;
using freeflex_msgs::state_t;

/// Holds the first column of each point, body, group or link, by the index of the item.
class FirstColumns {
 public:
  void set(std::int32_t index, std::size_t column) { columns_[index] = column; }
  /// Returns the values of an item in a row, or nullptr if the item has no column.
  double* find(std::int32_t index, std::vector<double>& values) const {
    const auto found = columns_.find(index);
    return found == columns_.end() ? nullptr : values.data() + found->second;
  }
  std::size_t size() const { return columns_.size(); }

 private:
  std::map<std::int32_t, std::size_t> columns_;
};

struct Names {
  std::map<std::int32_t, std::string> points, groups;
  std::map<std::int32_t, std::pair<std::string, std::string>> links;  // name, kind
  std::vector<std::string> wheels;
};

std::string name_of(const std::map<std::int32_t, std::string>& names, std::int32_t index) {
  const auto found = names.find(index);
  return found == names.end() ? "#" + std::to_string(index) : found->second;
}

/// Position of one page in the log.
struct PageAt {
  std::int64_t tick = 0;
  std::int32_t page = 0, num_pages = 1;
  std::int64_t offset = 0;  // [bytes]
  std::int64_t epoch = 0;
  std::size_t content = 0;  // hash of a STATE; 0 for POINTS and LOADS
};

/// The pages of one part ordered by tick, and the columns of their values.
struct Index {
  std::vector<PageAt> pages;
  std::size_t num_columns = 0;
  FirstColumns points, bodies, groups, links;
  std::map<std::int32_t, std::int32_t> link_sizes;
  int num_elastic = -1;
};

void take(const double* from, std::size_t size, double*& to) { to = std::copy_n(from, size, to); }

/// Copies the values of a message into a row. Returns false if the message does not have the columns of the
/// index.
bool fill(const Index& index, const state_t& message, std::vector<double>& values) {
  if (message.num_elastic != index.num_elastic) return false;
  double* to = values.data();
  take(&message.time, 1, to);
  take(message.position, 3, to);
  take(message.attitude, 4, to);
  take(message.velocity, 3, to);
  take(message.angular_velocity, 3, to);
  take(message.angular_momentum, 3, to);
  for (const std::vector<double>* each : {&message.q, &message.q_dot, &message.wheel_momentum})
    take(each->data(), each->size(), to);
  return to == values.data() + values.size();
}

bool fill(const Index& index, const points_t& message, std::vector<double>& values) {
  for (const auto& point : message.points) {
    double* to = index.points.find(point.point, values);
    if (to == nullptr) return false;
    for (const double* vector : {point.position, point.velocity, point.acceleration}) take(vector, 3, to);
  }
  for (const auto& body : message.bodies) {
    double* to = index.bodies.find(body.point, values);
    if (to == nullptr) return false;
    take(body.attitude, 4, to);
    take(body.angular_velocity, 3, to);
  }
  for (const auto& group : message.groups) {
    double* to = index.groups.find(group.group, values);
    if (to == nullptr) return false;
    take(group.position, 3, to);
    take(group.attitude, 4, to);
    take(group.velocity, 3, to);
    take(group.angular_velocity, 3, to);
  }
  return true;
}

bool fill(const Index& index, const loads_t& message, std::vector<double>& values) {
  for (const auto& link : message.links) {
    double* to = index.links.find(link.link, values);
    if (to == nullptr || link.num_values != index.link_sizes.at(link.link)) return false;
    take(link.values.data(), link.values.size(), to);
  }
  return true;
}

template <class Message>
class PageReader : public RowReader {
 public:
  PageReader(const std::string& path, const Index& index) : log_(path), index_(index) {}

  bool next(MotionRow& row) override {
    while (at_ != index_.pages.size()) {
      const std::size_t first = at_;
      while (at_ != index_.pages.size() && index_.pages[at_].tick == index_.pages[first].tick) ++at_;
      row.tick = index_.pages[first].tick;
      // values that no page of the tick contains are NaN
      row.values.assign(index_.num_columns, std::numeric_limits<double>::quiet_NaN());
      bool is_whole = at_ - first == static_cast<std::size_t>(index_.pages[first].num_pages);
      for (std::size_t k = first; k != at_ && is_whole; ++k) {
        Message message;
        if (!log_.read_at(index_.pages[k].offset, event_) || !io::decode_message(event_.bytes, message)) {
          error_ = "the message at byte " + std::to_string(index_.pages[k].offset) + " cannot be read again";
          return false;
        }
        is_whole = fill(index_, message, row.values);
      }
      if (is_whole) return true;
      ++num_odd_;
    }
    return false;
  }

 private:
  io::LogReader log_;
  const Index& index_;
  io::LogEvent event_;
  std::size_t at_ = 0;
};

class RecordedMotion : public MotionFile {
 public:
  /// \param damage  damage of the recording; empty if there is none
  RecordedMotion(std::string path, const std::string& prefix, std::int64_t session, const std::string& damage)
      : path_(std::move(path)), prefix_(prefix), session_(session) {
    if (!damage.empty()) damage_ = damage.starts_with(path_) ? damage : path_ + ": " + damage;
  }
  bool is_recording() const override { return true; }

  /// Reads the index of the recording. Returns an empty text or the error of the log.
  std::string read() {
    io::LogReader log(path_);
    io::LogEvent event;
    std::set<std::string> others;
    while (log.next(event)) {
      if (event.channel == prefix_ + channels::kState) {
        take_page<state_t>(event, kStateChannel);
      } else if (event.channel == prefix_ + channels::kPoints) {
        take_page<points_t>(event, kPointsChannel);
      } else if (event.channel == prefix_ + channels::kLoads) {
        take_page<loads_t>(event, kLoadsChannel);
      } else if (event.channel == prefix_ + channels::kScene) {
        take_scene(event);
      } else {
        others.insert(event.channel);
      }
    }
    if (std::string two = find_two_states(); !two.empty()) return two;
    for (Index& index : indices_) sort(index);
    std::string list;
    for (const std::string& channel : others) list += (list.empty() ? "" : ", ") + printable(channel);
    if (!list.empty()) ignored_.push_back("channels " + list);
    lay_out(log);
    return log.error();
  }

  std::unique_ptr<RowReader> open(std::size_t part) override {
    switch (channels_[part]) {
      case kStateChannel:
        return std::make_unique<PageReader<state_t>>(path_, indices_[kStateChannel]);
      case kPointsChannel:
        return std::make_unique<PageReader<points_t>>(path_, indices_[kPointsChannel]);
      default:
        return std::make_unique<PageReader<loads_t>>(path_, indices_[kLoadsChannel]);
    }
  }

 private:
  template <class Message>
  void take_page(const io::LogEvent& event, std::size_t channel) {
    Message message;
    if (!io::decode_message(event.bytes, message) || message.session != session_) return;
    PageAt page{message.tick, 0, 1, event.offset, message.epoch, 0};
    if constexpr (std::is_same_v<Message, state_t>) {
      message.utime = message.applied_count = 0;  // a state that is sent again may differ in these fields
      const std::vector<std::byte> bytes = io::encode(message);
      page.content =
          std::hash<std::string_view>{}({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    } else {
      page.page = message.page;
      page.num_pages = message.num_pages;
    }
    indices_[channel].pages.push_back(page);
  }

  void take_scene(const io::LogEvent& event) {
    scene_t message;
    if (!io::decode_message(event.bytes, message) || message.session != session_) return;
    names_.wheels.clear();
    for (const auto& wheel : message.wheels) names_.wheels.push_back(wheel.name);
    for (std::int32_t k = 0; k < message.num_points; ++k)
      names_.points[message.first_point + k] = message.points[static_cast<std::size_t>(k)].name;
    for (std::int32_t k = 0; k < message.num_groups; ++k)
      names_.groups[message.first_group + k] = message.groups[static_cast<std::size_t>(k)].name;
    for (std::int32_t k = 0; k < message.num_links; ++k) {
      const auto& link = message.links[static_cast<std::size_t>(k)];
      names_.links[message.first_link + k] = {link.name, link.kind};
    }
  }

  /// Returns an error if one tick of one epoch has two different states. Otherwise returns an empty text.
  std::string find_two_states() const {
    std::map<std::pair<std::int64_t, std::int64_t>, std::size_t> contents;
    for (const PageAt& page : indices_[kStateChannel].pages)
      if (contents.try_emplace({page.epoch, page.tick}, page.content).first->second != page.content)
        return path_ + ": the STATE at byte " + std::to_string(page.offset) +
               " differs from an earlier STATE of tick " + std::to_string(page.tick) +
               "; the file is damaged, or two motions were put into one file";
    return {};
  }

  // orders pages by tick and number and removes repeated pages, because a packet may arrive twice, and a
  // daemon that holds sends its last tick again
  static void sort(Index& index) {
    const auto key = [](const PageAt& page) { return std::tie(page.tick, page.page); };
    std::stable_sort(index.pages.begin(), index.pages.end(),
                     [key](const PageAt& a, const PageAt& b) { return key(a) < key(b); });
    const auto repeats = std::unique(index.pages.begin(), index.pages.end(),
                                     [key](const PageAt& a, const PageAt& b) { return key(a) == key(b); });
    index.pages.erase(repeats, index.pages.end());
  }

  /// Sets the columns from the first complete tick of each channel.
  void lay_out(io::LogReader& log) {
    const auto add = [this](std::size_t channel, const char* name, Columns columns) {
      if (columns.empty()) return;
      indices_[channel].num_columns = columns.size();
      parts_.push_back({name, std::move(columns)});
      channels_.push_back(channel);
    };
    add(kStateChannel, "STATE", state_layout(log));
    add(kPointsChannel, "POINTS", points_layout(log));
    add(kLoadsChannel, "LOADS", loads_layout(log));
  }

  template <class Message>
  std::vector<Message> first_tick(io::LogReader& log, const Index& index) {
    std::vector<Message> messages;
    for (std::size_t first = 0; first < index.pages.size();) {
      std::size_t end = first;
      while (end != index.pages.size() && index.pages[end].tick == index.pages[first].tick) ++end;
      if (end - first == static_cast<std::size_t>(index.pages[first].num_pages)) {
        for (; first != end; ++first) {
          io::LogEvent event;
          Message& message = messages.emplace_back();
          if (!log.read_at(index.pages[first].offset, event) || !io::decode_message(event.bytes, message))
            return {};
        }
        return messages;
      }
      first = end;
    }
    return messages;
  }

  Columns state_layout(io::LogReader& log) {
    Index& index = indices_[kStateChannel];
    const std::vector<state_t> messages = first_tick<state_t>(log, index);
    if (messages.empty()) return {};
    index.num_elastic = messages[0].num_elastic;
    names_.wheels.resize(static_cast<std::size_t>(messages[0].num_wheels));
    return state_columns(index.num_elastic, names_.wheels);
  }

  Columns points_layout(io::LogReader& log) {
    Index& index = indices_[kPointsChannel];
    Columns columns;
    const std::vector<points_t> messages = first_tick<points_t>(log, index);
    std::set<std::int32_t> bodies;
    for (const points_t& message : messages)
      for (const auto& body : message.bodies) bodies.insert(body.point);
    for (const points_t& message : messages)
      for (const auto& point : message.points) {
        index.points.set(point.point, columns.size());
        const bool is_body = bodies.contains(point.point);
        append_point_columns(name_of(names_.points, point.point), is_body, columns);
        if (is_body) index.bodies.set(point.point, columns.size() - 7);
      }
    for (const points_t& message : messages)
      for (const auto& group : message.groups) {
        index.groups.set(group.group, columns.size());
        append_group_columns(name_of(names_.groups, group.group), columns);
      }
    return columns;
  }

  Columns loads_layout(io::LogReader& log) {
    Index& index = indices_[kLoadsChannel];
    Columns columns;
    for (const loads_t& message : first_tick<loads_t>(log, index))
      for (const auto& link : message.links) {
        index.links.set(link.link, columns.size());
        index.link_sizes[link.link] = link.num_values;
        const auto found = names_.links.find(link.link);
        append_link_columns(
            found == names_.links.end() ? "#" + std::to_string(link.link) : found->second.first,
            found == names_.links.end() ? "" : found->second.second, link.num_values, columns);
      }
    return columns;
  }

  std::string path_, prefix_;
  std::int64_t session_;
  Names names_;
  std::array<Index, kNumMotionChannels> indices_;
  std::vector<std::size_t> channels_;  // of the parts
};

bool begins_as_log(const std::string& path) {
  io::LogReader log(path);
  io::LogEvent event;
  return log.next(event) || log.is_damaged();
}

}  // namespace

std::unique_ptr<MotionFile> open_recording(const std::string& path, const std::string& prefix,
                                           std::optional<std::int64_t> session, std::string& error) {
  io::LogReader log(path);
  Recording recording = read_recording(log, prefix);
  error = recording.error;
  if (!error.empty()) return nullptr;
  const RecordedSession* const chosen = choose_session(recording, session, error);
  if (chosen == nullptr) {
    error = joined(recording.damage, path + ": " + error);
    return nullptr;
  }
  auto motion = std::make_unique<RecordedMotion>(path, prefix, chosen->session,
                                                 joined(recording.damage, recording.warning));
  error = motion->read();
  if (error.empty() && motion->parts().empty())
    error = joined(recording.damage, path + ": it contains no complete " + prefix + channels::kState + ", " +
                                         prefix + channels::kPoints + " or " + prefix + channels::kLoads);
  if (!error.empty()) return nullptr;
  return motion;
}

std::unique_ptr<MotionFile> open_motion(const std::string& path, const std::string& prefix,
                                        std::optional<std::int64_t> session, std::string& error) {
  if (begins_as_log(path)) return open_recording(path, prefix, session, error);
  if (!session) return open_table(path, error);
  error = path + ": a session was chosen, but the file is not a recording; omit the session";
  return nullptr;
}

}  // namespace freeflex::tools
