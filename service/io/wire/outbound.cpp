#include "service/io/wire/outbound.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/limits.hpp"
#include "messages/channels.hpp"
#include "service/io/wire/codec.hpp"

namespace freeflex::io {

static_assert(channels::kMaxMessageBytes == kMaxMessageBytes,
              "sizes of structures follow from that of a message");
namespace {

template <std::size_t N>
void copy_to(const std::array<double, N>& from, double* to) {
  std::copy_n(from.begin(), N, to);
}

constexpr int kFingerprintSize = 8;  // [B] getEncodedSize counts the fingerprint, which an item inside a
                                     // message does not have

/// Sets the page number and the number of pages on every page.
template <class Page>
void number_pages(std::vector<Page>& pages) {
  for (std::size_t i = 0; i < pages.size(); ++i) {
    pages[i].page = static_cast<std::int32_t>(i);
    pages[i].num_pages = static_cast<std::int32_t>(pages.size());
  }
}

freeflex_msgs::point_state_t make_point(std::int32_t point, const PointState& kinematics) {
  freeflex_msgs::point_state_t message{};
  message.point = point;
  copy_to(kinematics.p_W, message.position);
  copy_to(kinematics.v_W, message.velocity);
  copy_to(kinematics.a_W, message.acceleration);
  copy_to(kinematics.V_B, message.displacement);
  return message;
}

freeflex_msgs::body_state_t make_body(const Plan& plan, const MotionState& state, std::int32_t point) {
  const BodyState body = read_body(plan, state, point);
  freeflex_msgs::body_state_t message{};
  message.point = point;
  copy_to(body.q_WP, message.attitude);
  copy_to(body.w_P, message.angular_velocity);
  return message;
}

freeflex_msgs::group_pose_t make_group(const Plan& plan, const MotionState& state, std::int32_t group) {
  const GroupPose pose = read_group(plan, state, group);
  freeflex_msgs::group_pose_t message{};
  message.group = group;
  copy_to(pose.p_W, message.position);
  copy_to(pose.q_WG, message.attitude);
  copy_to(pose.v_W, message.velocity);
  copy_to(pose.w_B, message.angular_velocity);
  return message;
}

/// Returns a page with utime, session, epoch and tick but without items.
template <class Page>
Page make_page(const MotionState& state, const Stamp& stamp) {
  Page page{};
  page.utime = stamp.utime;
  page.session = stamp.session;
  page.epoch = state.epoch;
  page.tick = state.tick;
  return page;
}

/// Adds an item to the last page, or to a new page if the last page would exceed the limit.
/// \param room  [B] free on the last page
template <class Page, class Item>
void add_item(std::vector<Page>& pages, const Page& empty, std::vector<Item> Page::*items, Item item,
              int& room) {
  const int size = item.getEncodedSize() - kFingerprintSize;
  if (pages.empty() || size > room) {
    pages.push_back(empty);
    room = channels::kMaxMessageBytes - empty.getEncodedSize();
  }
  room -= size;
  (pages.back().*items).push_back(std::move(item));
}

std::vector<std::vector<std::byte>> encode_state(const Plan& plan, const MotionState& state,
                                                 const Stamp& stamp) {
  return {encode(make_state_message(plan, state, stamp))};
}

template <auto make_pages>
std::vector<std::vector<std::byte>> encode_pages(const Plan& plan, const MotionState& state,
                                                 const Stamp& stamp) {
  std::vector<std::vector<std::byte>> encoded;
  for (const auto& page : make_pages(plan, state, stamp)) encoded.push_back(encode(page));
  return encoded;
}

freeflex_msgs::applied_t make_applied(std::int32_t kind, std::int64_t tick, std::int64_t applied_sequence,
                                      const Stamp& stamp) {
  freeflex_msgs::applied_t message{};
  message.utime = stamp.utime;
  message.session = stamp.session;
  message.applied_sequence = applied_sequence;
  message.tick = tick;
  message.kind = kind;
  message.plan_fingerprint = static_cast<std::int64_t>(stamp.plan_fingerprint);
  message.command.utime = stamp.utime;
  message.command.session = stamp.session;
  return message;
}

}  // namespace

constexpr std::array<ChannelEncoder, kNumMotionChannels> kEncoders{
    {{channels::kState, encode_state, &freeflex_msgs::status_t::states_dropped},
     {channels::kPoints, encode_pages<make_points_messages>, &freeflex_msgs::status_t::points_dropped},
     {channels::kLoads, encode_pages<make_loads_messages>, &freeflex_msgs::status_t::loads_dropped}}};
static_assert(kEncoders.back().dropped != nullptr, "kEncoders lacks a row");

std::int64_t ticks_between(double rate, double period) {
  if (!(rate > 0.0)) return 0;
  return std::max<std::int64_t>(1, std::llround(1.0 / (rate * period)));
}

freeflex_msgs::state_t make_state_message(const Plan& given, const MotionState& state, const Stamp& stamp) {
  const StepPlan& plan = active_plan(given, state);
  freeflex_msgs::state_t message{};
  message.utime = stamp.utime;
  message.session = stamp.session;
  message.epoch = state.epoch;
  message.tick = state.tick;
  message.time = static_cast<double>(state.tick - state.epoch_start_tick) * plan.period;
  message.applied_count = stamp.applied_count;
  copy_to(state.p_WB, message.position);
  copy_to(state.q_WB, message.attitude);
  copy_to(state.v_WB, message.velocity);
  copy_to(angular_velocity(plan, state), message.angular_velocity);
  copy_to(state.H_W, message.angular_momentum);
  message.num_elastic = plan.num_elastic;
  message.q.assign(state.q.begin(), state.q.begin() + plan.num_elastic);
  message.q_dot.assign(state.q_dot.begin(), state.q_dot.begin() + plan.num_elastic);
  message.num_wheels = static_cast<std::int32_t>(state.wheel_momentum.size());
  message.wheel_momentum = state.wheel_momentum;
  return message;
}

std::vector<freeflex_msgs::points_t> make_points_messages(const Plan& plan, const MotionState& state,
                                                          const Stamp& stamp) {
  std::vector<PointState> points;
  points.reserve(plan.published_points.size());
  for (const std::int32_t point : plan.published_points) points.push_back(read_point(plan, state, point));
  return make_pages_of_points(plan, state, points, stamp);
}

std::vector<freeflex_msgs::points_t> make_pages_of_points(const Plan& plan, const MotionState& state,
                                                          std::span<const PointState> points,
                                                          const Stamp& stamp) {
  using Page = freeflex_msgs::points_t;
  const Page empty = make_page<Page>(state, stamp);
  std::vector<Page> pages;
  int room = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    add_item(pages, empty, &Page::points, make_point(plan.published_points[i], points[i]), room);
  for (const std::int32_t group : plan.published_groups) {
    add_item(pages, empty, &Page::groups, make_group(plan, state, group), room);
  }
  for (const std::int32_t point : plan.published_points)
    if (attitude_index_of(plan, point) >= 0)
      add_item(pages, empty, &Page::bodies, make_body(plan, state, point), room);
  for (Page& page : pages) {
    page.num_bodies = static_cast<std::int32_t>(page.bodies.size());
    page.num_points = static_cast<std::int32_t>(page.points.size());
    page.num_groups = static_cast<std::int32_t>(page.groups.size());
  }
  number_pages(pages);
  return pages;
}

std::vector<freeflex_msgs::loads_t> make_loads_messages(const Plan& plan, const MotionState& state,
                                                        const Stamp& stamp) {
  using Page = freeflex_msgs::loads_t;
  const Page empty = make_page<Page>(state, stamp);
  std::vector<Page> pages;
  int room = 0;
  for (std::size_t i = 0; i < plan.link_outputs.size(); ++i) {
    freeflex_msgs::link_load_t load{};
    load.link = plan.link_outputs[i].link;
    load.num_values = plan.link_outputs[i].num_rows;
    load.values.resize(index(load.num_values));
    read_link(plan, state, static_cast<int>(i), load.values);
    add_item(pages, empty, &Page::links, std::move(load), room);
  }
  for (Page& page : pages) page.num_links = static_cast<std::int32_t>(page.links.size());
  number_pages(pages);
  return pages;
}

freeflex_msgs::applied_t make_applied_force(const ForceCommand& command, std::int64_t tick,
                                            std::int64_t applied_sequence, const Stamp& stamp) {
  freeflex_msgs::applied_t message =
      make_applied(freeflex_msgs::applied_t::FORCE, tick, applied_sequence, stamp);
  message.command = to_message(command, stamp.session, stamp.utime);
  return message;
}

freeflex_msgs::applied_t make_applied_end(std::int32_t kind, const Expiry& end, std::int64_t tick,
                                          std::int64_t applied_sequence, const Stamp& stamp) {
  freeflex_msgs::applied_t message = make_applied(kind, tick, applied_sequence, stamp);
  message.command.sender = end.sender.data();
  message.command.slot = end.slot;
  message.command.sequence = end.sequence;
  return message;
}

freeflex_msgs::applied_t make_applied_expiry(const Expiry& expiry, std::int64_t tick,
                                             std::int64_t applied_sequence, const Stamp& stamp) {
  using freeflex_msgs::applied_t;
  const std::int32_t kind = expiry.was_lease ? std::int32_t{applied_t::LEASE_LOST} : applied_t::EXPIRED;
  return make_applied_end(kind, expiry, tick, applied_sequence, stamp);
}

freeflex_msgs::applied_t make_applied_reset(std::int64_t tick, std::int64_t applied_sequence,
                                            const Stamp& stamp) {
  return make_applied(freeflex_msgs::applied_t::RESET, tick, applied_sequence, stamp);
}

}  // namespace freeflex::io
