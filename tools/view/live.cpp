#include "tools/view/live.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/step/command.hpp"
#include "freeflex_msgs/ack_t.hpp"
#include "freeflex_msgs/force_t.hpp"
#include "messages/channels.hpp"
#include "service/io/wire/codec.hpp"
#include "service/io/wire/decode.hpp"
#include "service/io/wire/versions.hpp"
#include "tools/bus/message_json.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

constexpr double kLease = 0.5;  // [s] lease of a push, which the page renews five times within this time
// [us] time within which a sealed command must reach the daemon
constexpr std::int64_t kValidity = 10'000'000;
constexpr std::size_t kMostUnanswered = 64, kMostName = 32;

template <typename T>
void append(const T* values, std::size_t size, std::vector<std::byte>& bytes) {
  const auto* first = reinterpret_cast<const std::byte*>(values);
  bytes.insert(bytes.end(), first, first + size * sizeof(T));
}

/// Cuts a UTF-8 text to at most `most` bytes, at a character boundary.
std::string cut_text(const std::string& text, std::size_t most) {
  if (text.size() <= most) return text;
  constexpr unsigned kContinues = 0x80, kMark = 0xC0;
  while (most > 0 && (static_cast<unsigned char>(text[most]) & kMark) == kContinues) --most;
  return text.substr(0, most);
}

Bytes shared(std::vector<std::byte> bytes) {
  return std::make_shared<const std::vector<std::byte>>(std::move(bytes));
}

}  // namespace

std::size_t coordinate_of_mode(const Body& body, const freeflex_msgs::state_t& state, std::size_t mode) {
  // after a command that needs omitted modes, the state has the coordinates of the fallback plan
  const bool is_wide = !body.plan.fallback.empty() && state.num_elastic == body.plan.fallback[0].num_elastic;
  return is_wide ? static_cast<std::size_t>(body.plan.fallback_modes[mode]) : mode;
}

float shown_coordinate(const Body& body, const freeflex_msgs::state_t& state, std::size_t mode) {
  const std::size_t at = coordinate_of_mode(body, state, mode);
  return at < state.q.size() ? static_cast<float>(state.q[at]) : 0.0F;
}

std::vector<std::byte> state_frame(const Body& body, const freeflex_msgs::state_t& state) {
  std::vector<std::byte> bytes;
  const double head[] = {1.0, static_cast<double>(state.tick), state.time};
  append(head, 3, bytes);
  append(state.position, 3, bytes);
  append(state.attitude, 4, bytes);
  append(state.angular_velocity, 3, bytes);
  // uses the number of wheels in the plan, not the number that the message claims
  std::vector<double> wheels = state.wheel_momentum;
  wheels.resize(body.plan.wheels.size());
  const auto num_wheels = static_cast<double>(wheels.size());
  append(&num_wheels, 1, bytes);
  append(wheels.data(), wheels.size(), bytes);
  std::vector<float> q(static_cast<std::size_t>(body.num_modes));
  for (std::size_t l = 0; l < q.size(); ++l) q[l] = shown_coordinate(body, state, l);
  append(q.data(), q.size(), bytes);
  return bytes;
}

LoadFigures::LoadFigures(const Body& body) : body_(&body) { forget(); }

void LoadFigures::forget() {
  figures_.assign(body_->published_links.size(), std::numeric_limits<float>::quiet_NaN());
}

bool LoadFigures::take(const freeflex_msgs::loads_t& page, std::size_t size) {
  const io::PageSet::Taken taken = pages_.take({page.session, page.epoch, page.tick}, page.page,
                                               page.num_pages, std::ssize(figures_), size);
  if (taken.is_first) forget();
  if (!taken.is_kept) return false;
  const std::vector<std::int32_t>& links = body_->published_links;
  for (const auto& load : page.links) {
    const auto found = std::lower_bound(links.begin(), links.end(), load.link);
    if (found == links.end() || *found != load.link) continue;
    const LinkFigure figure = traits_of(body_->plan.links[static_cast<std::size_t>(load.link)].type).figure;
    figures_[static_cast<std::size_t>(found - links.begin())] =
        static_cast<float>(link_figure(figure, load.values));
  }
  return taken.is_whole;
}

std::vector<std::byte> loads_frame(std::int64_t tick, std::span<const float> figures) {
  std::vector<std::byte> bytes;
  const double head[] = {2.0, static_cast<double>(tick)};
  append(head, 2, bytes);
  append(figures.data(), figures.size(), bytes);
  return bytes;
}

std::string status_text(const freeflex_msgs::status_t& status, const Json& modes) {
  const std::vector<std::byte> bytes = io::encode(status);
  return json_text(Json{{"status", decode_by_suffix(channels::kStatus, bytes).fields}, {"modes", modes}});
}

Live::Live(Body& body, Bus& bus, std::string prefix, std::optional<SealingKey> key)
    : body_(body), bus_(bus), prefix_(std::move(prefix)), key_(std::move(key)), loads_(body), peaks_(body) {
  sender_ = key_ ? key_->id : "view." + std::to_string(getpid());
  const auto subscribe = [this](const char* suffix, void (Live::*take)(const BusMessage&)) {
    bus_.subscribe(prefix_ + suffix, [this, take](const BusMessage& message) { (this->*take)(message); });
  };
  subscribe(channels::kStatus, &Live::take_status);
  subscribe(channels::kState, &Live::take_state);
  subscribe(channels::kLoads, &Live::take_loads);
  subscribe(channels::kAck, &Live::take_ack);
}

void Live::take_status(const BusMessage& message) {
  freeflex_msgs::status_t status;
  if (!io::decode_message(message.bytes, status))
    return server_->send_latest("notice",
                                json_text(Json{{"notice", "a daemon is running, but its STATUS is " +
                                                              io::explain_unread(message.bytes)}}));
  const auto fingerprint = static_cast<std::uint64_t>(status.plan_fingerprint);
  const bool is_known = fingerprint_ == fingerprint && rate_ == status.rate;
  const bool is_other = is_known ? is_other_ : !take_rate(body_, fingerprint, status.rate);
  fingerprint_ = fingerprint;
  if (is_other != is_other_ || status.session != session_)
    server_->send_latest(
        "notice",
        json_text(Json{{"notice", is_other ? "the daemon runs another plan (fingerprint " +
                                                 fingerprint_text(fingerprint) + ", but this page has " +
                                                 fingerprint_text(body_.fingerprint) +
                                                 "); start freeflex view without a file to see the "
                                                 "daemon's plan"
                                           : ""}}));
  is_other_ = is_other;
  session_ = status.session;
  rate_ = status.rate;
  if (!is_other) server_->send_latest("status", status_text(status, peaks_.largest()));
}

void Live::take_state(const BusMessage& message) {
  freeflex_msgs::state_t state;
  if (is_other_ || !io::decode_message(message.bytes, state) || state.session != session_) return;
  peaks_.take(state);
  server_->send(PageServer::Kind::kState, shared(state_frame(body_, state)));
}

void Live::take_loads(const BusMessage& message) {
  freeflex_msgs::loads_t page;
  if (is_other_ || !io::decode_message(message.bytes, page) || page.session != session_) return;
  if (loads_.take(page, message.bytes.size()))
    server_->send(PageServer::Kind::kLoads, shared(loads_frame(page.tick, loads_.figures())));
}

void Live::take_ack(const BusMessage& message) {
  freeflex_msgs::ack_t ack;
  if (!io::decode_message(message.bytes, ack) || ack.sender != sender_) return;
  const auto found = std::find_if(unanswered_.begin(), unanswered_.end(),
                                  [&](const Unanswered& one) { return one.sequence == ack.sequence; });
  if (found == unanswered_.end()) return;  // the answer is for another program with the same key
  Json answer = std::move(found->answer);
  unanswered_.erase(found);
  answer.update({{"reason", ack.reason}, {"tick", ack.tick}, {"text", ack.text}});
  server_->send_once(json_text(Json{{"ack", std::move(answer)}}));
}

void Live::take_text(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("push")) return;
  freeflex_msgs::force_t force{};
  if (const Json& push = json["push"]; push.is_object()) {
    const Json point = push.value("point", Json()), vector = push.value("force", Json());
    if (!point.is_number_integer() || !vector.is_array() || vector.size() != 3) return;
    freeflex_msgs::point_force_t entry{};
    const auto index = point.get<std::int64_t>();
    if (index < 0 || index >= std::ssize(body_.plan.points)) return;
    entry.point = static_cast<std::int32_t>(index);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!vector[axis].is_number()) return;
      entry.force[axis] = vector[axis].get<double>();
    }
    force.forces.push_back(entry);
    force.num_forces = 1;
  } else if (!push.is_null()) {
    return;
  }
  const Json name = json.value("by", Json());
  const std::string by = name.is_string() ? cut_text(name.get<std::string>(), kMostName) : std::string();
  const std::lock_guard lock(mutex_);
  pending_ = {force, by};
}

void Live::push() {
  std::optional<Pending> pending;
  {
    const std::lock_guard lock(mutex_);
    pending = std::exchange(pending_, std::nullopt);
  }
  if (!pending || is_other_) return;
  freeflex_msgs::force_t* const force = &pending->force;
  force->utime = wall_clock_us();
  force->session = session_;
  force->sender = sender_;
  // sequences start from the clock, so that they also ascend when the sender's next program starts
  sequence_ = std::max(sequence_ + 1, force->utime);
  force->sequence = sequence_;
  Json answer{{"by", pending->by}};
  if (force->num_forces > 0)
    answer.update({{"point", force->forces[0].point},
                   {"force", std::vector<double>(force->forces[0].force, force->forces[0].force + 3)}});
  unanswered_.push_back({sequence_, answer});
  if (unanswered_.size() > kMostUnanswered) unanswered_.pop_front();
  force->start_tick = -1;
  if (force->num_forces > 0) force->lease_ticks = std::max<std::int64_t>(1, std::llround(kLease * rate_));
  const std::string channel = prefix_ + channels::kForce;
  const std::vector<std::byte> bytes =
      key_ ? seal(*force, channel, *key_, force->utime + kValidity) : io::encode(*force);
  if (!bus_.publish(channel, bytes)) {
    answer.update({{"reason", -1}, {"tick", 0}, {"text", "the network refused the push; try again"}});
    server_->send_once(json_text(Json{{"ack", std::move(answer)}}));
  }
}

}  // namespace freeflex::tools
