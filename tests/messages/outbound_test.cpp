// Outgoing messages are complete and correct, and no page is above the size limit.
#include "service/io/wire/outbound.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <set>

#include "core/plan/make_plan.hpp"
#include "core/step/rigid/principal.hpp"
#include "messages/channels.hpp"
#include "service/io/wire/codec.hpp"
#include "tests/messages/commands.hpp"

namespace freeflex::testing {
namespace {

constexpr int kPoints = 2000;
constexpr int kElastic = 5;

/// Returns a plan of 2000 published and pushable points of 1 kg on a helix, with links along the helix and 5
/// modes.
Plan make_plan() {
  Plan plan;
  plan.name = "helix";
  plan.scene_hash = 0xFEDCBA9876543210u;
  plan.period = 1e-3;
  plan.mass = kPoints;
  plan.inertia = {1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0};
  plan.inverse_inertia = {1.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.25};
  set_principal(plan);
  plan.num_elastic = kElastic;
  plan.num_moving = plan.num_padded = 8;
  plan.omega.assign(8, 0.0);
  plan.decay.assign(8, 0.0);
  for (int l = 0; l < kElastic; ++l)
    plan.omega[static_cast<std::size_t>(l)] = 2.0 * std::numbers::pi * (l + 1);
  plan.rows.resize(3 * kPoints * 8);
  plan.eckart_rows.assign(6 * 8, 0.0);
  plan.points.resize(kPoints);
  plan.links.resize(kPoints - 1);
  plan.link_outputs.resize(kPoints - 1);
  plan.link_rows.assign((kPoints - 1) * 8, 0.0);
  for (int i = 0; i < kPoints; ++i) {
    const auto at = static_cast<std::size_t>(i);
    plan.points[at] = {
        "p" + std::to_string(i), 1.0, {std::cos(0.1 * i), std::sin(0.1 * i), 0.01 * i}, i, true};
    plan.published_points.push_back(i);
    for (std::size_t k = 0; k < 3 * kElastic; ++k)
      plan.rows[(3 * at + k / kElastic) * 8 + k % kElastic] = i + 0.001 * static_cast<double>(k);
    if (i + 1 == kPoints) break;
    plan.links[at] = {"l" + std::to_string(i), LinkType::kSpring, {i, i + 1}};
    plan.link_outputs[at] = {i, 1, i};
    for (std::size_t l = 0; l < kElastic; ++l) plan.link_rows[at * 8 + l] = i * 0.5 + static_cast<double>(l);
  }
  for (int g = 0; g < 300; ++g) {
    PlanGroup group;
    group.name = "g" + std::to_string(g);
    group.points = {g, g + 1, g + 2};
    group.mass = 3.0;
    plan.groups.push_back(group);
    plan.published_groups.push_back(g);
  }
  plan.initial.q.assign(8, 0.0);
  plan.initial.q_dot.assign(8, 0.0);
  return plan;
}

State make_test_state(const Plan& plan) {
  State state;
  state.tick = 12'345;
  state.epoch = 2;
  state.epoch_start_tick = 345;
  state.p_WB = {1.0, 2.0, 3.0};
  state.v_WB = {0.1, 0.2, 0.3};
  state.q_WB = {0.5, 0.5, -0.5, 0.5};
  state.H_W = {7.0, 8.0, 9.0};
  state.q.assign(8, 0.0);
  state.q_low = state.q_dot = state.q_dot_low = state.Q = state.q;
  for (int l = 0; l < plan.num_elastic; ++l) {
    state.q[static_cast<std::size_t>(l)] = 1e-4 / (3.0 + l);
    state.q_dot[static_cast<std::size_t>(l)] = -1e-3 / (7.0 + l);
  }
  return state;
}

const io::Stamp kStamp{1'000'001, kSession, 0xF00DF00DF00DF00Du, 17};

/// Checks that the pages are numbered, are not above the size limit and decode to the encoded values.
template <class Message>
void expect_pages(const std::vector<Message>& pages) {
  for (std::size_t i = 0; i < pages.size(); ++i) {
    EXPECT_EQ(pages[i].page, static_cast<int>(i));
    EXPECT_EQ(pages[i].num_pages, static_cast<int>(pages.size()));
    EXPECT_EQ(pages[i].utime, kStamp.utime);
    EXPECT_EQ(pages[i].session, kStamp.session);
    const std::vector<std::byte> bytes = io::encode(pages[i]);
    EXPECT_LE(bytes.size(), static_cast<std::size_t>(channels::kMaxMessageBytes));
    Message again;
    ASSERT_EQ(again.decode(bytes.data(), 0, static_cast<int>(bytes.size())), static_cast<int>(bytes.size()));
    EXPECT_EQ(io::encode(again), bytes);
  }
}

template <std::size_t N>
void expect_equal(const double* found, const std::array<double, N>& expected) {
  for (std::size_t i = 0; i < N; ++i) EXPECT_EQ(found[i], expected[i]);
}

TEST(Outbound, AStateMessageContainsTheStateOfTheCore) {
  const Plan plan = make_plan();
  const State state = make_test_state(plan);
  const freeflex_msgs::state_t message = io::make_state_message(plan, state, kStamp);
  EXPECT_EQ(message.utime, kStamp.utime);
  EXPECT_EQ(message.session, kSession);
  EXPECT_EQ(message.epoch, 2);
  EXPECT_EQ(message.tick, 12'345);
  EXPECT_EQ(message.time, 12.0) << "counted from the first tick of the epoch";
  EXPECT_EQ(message.applied_count, 17);
  expect_equal(message.position, state.p_WB);
  expect_equal(message.attitude, state.q_WB);
  expect_equal(message.velocity, state.v_WB);
  expect_equal(message.angular_momentum, state.H_W);
  expect_equal(message.angular_velocity, angular_velocity(plan, state));
  ASSERT_EQ(message.num_elastic, kElastic);
  EXPECT_EQ(message.q, std::vector<double>(state.q.begin(), state.q.begin() + kElastic));
  EXPECT_EQ(message.q_dot, std::vector<double>(state.q_dot.begin(), state.q_dot.begin() + kElastic));
}

TEST(Outbound, EachMotionChannelHasItsNameRateAndMessages) {
  Plan plan = make_plan();
  const State state = make_test_state(plan);
  plan.rates = {50.0, 20.0, 10.0};
  std::vector<std::string> names;
  std::vector<std::int64_t> ticks;
  std::vector<std::vector<std::vector<std::byte>>> sent;
  for (std::size_t i = 0; i < kNumMotionChannels; ++i) {
    names.emplace_back(io::kEncoders[i].suffix);
    ticks.push_back(io::ticks_between(plan.rates[i], plan.period));
    sent.push_back(io::kEncoders[i].encode(plan, state, kStamp));
  }
  EXPECT_EQ(names, (std::vector<std::string>{"_STATE", "_POINTS", "_LOADS"}));
  EXPECT_EQ(names[kStateChannel], channels::kState);
  EXPECT_EQ(ticks, (std::vector<std::int64_t>{20, 50, 100}));
  EXPECT_EQ(io::ticks_between(0.0, plan.period), 0) << "off";
  EXPECT_EQ(io::ticks_between(1e9, plan.period), 1) << "each tick at most once";
  std::vector<std::vector<std::vector<std::byte>>> expected(3);
  expected[0].push_back(io::encode(io::make_state_message(plan, state, kStamp)));
  for (const auto& page : io::make_points_messages(plan, state, kStamp))
    expected[1].push_back(io::encode(page));
  for (const auto& page : io::make_loads_messages(plan, state, kStamp))
    expected[2].push_back(io::encode(page));
  EXPECT_GT(expected[1].size(), 1u);
  EXPECT_TRUE(sent == expected);
}

TEST(Outbound, TwoThousandPointsAreSentCompleteInPages) {
  const Plan plan = make_plan();
  const State state = make_test_state(plan);
  const auto pages = io::make_points_messages(plan, state, kStamp);
  expect_pages(pages);
  EXPECT_EQ(pages.size(), 4u) << "2000 points of 100 B and 300 poses of 108 B are 232 kB";
  int next_point = 0;
  int next_group = 0;
  for (const auto& page : pages) {
    EXPECT_EQ(page.tick, state.tick);
    EXPECT_EQ(page.epoch, state.epoch);
    for (const auto& point : page.points) {
      ASSERT_EQ(point.point, next_point++);
      const PointState expected = read_point(plan, state, point.point);
      expect_equal(point.position, expected.p_W);
      expect_equal(point.velocity, expected.v_W);
      expect_equal(point.acceleration, expected.a_W);
      expect_equal(point.displacement, expected.V_B);
    }
    for (const auto& group : page.groups) {
      ASSERT_EQ(group.group, next_group++);
      const GroupPose expected = read_group(plan, state, group.group);
      expect_equal(group.position, expected.p_W);
      expect_equal(group.attitude, expected.q_WG);
      expect_equal(group.velocity, expected.v_W);
      expect_equal(group.angular_velocity, expected.w_B);
    }
  }
  EXPECT_EQ(next_point, kPoints);
  EXPECT_EQ(next_group, 300);
}

TEST(Outbound, LoadsOfAllLinksAreSentWithAllTheirRows) {
  Plan plan = make_plan();
  // the last link output gets 12 rows, as a beam has
  plan.link_outputs.back().num_rows = 12;
  plan.link_rows.resize(plan.link_rows.size() + 11 * 8, 2.0);
  const State state = make_test_state(plan);
  const auto pages = io::make_loads_messages(plan, state, kStamp);
  expect_pages(pages);
  std::vector<double> expected(12);
  int next = 0;
  for (const auto& page : pages) {
    for (const auto& link : page.links) {
      ASSERT_EQ(link.link, next);
      ASSERT_EQ(link.num_values, next == kPoints - 2 ? 12 : 1);
      read_link(plan, state, next++, std::span(expected).first(static_cast<std::size_t>(link.num_values)));
      EXPECT_TRUE(std::equal(link.values.begin(), link.values.end(), expected.begin()));
    }
  }
  EXPECT_EQ(next, kPoints - 1);
}

TEST(Outbound, IfNothingIsPublishedThereAreNoPages) {
  Plan plan = make_plan();
  plan.published_points.clear();
  plan.published_groups.clear();
  plan.link_outputs.clear();
  const State state = make_test_state(plan);
  EXPECT_TRUE(io::make_points_messages(plan, state, kStamp).empty());
  EXPECT_TRUE(io::make_loads_messages(plan, state, kStamp).empty());
}

/// Returns a plan in which only the points in `named` have mode-shape rows.
Plan make_sparse_plan(const std::set<std::int32_t>& named) {
  Plan plan = make_plan();
  plan.groups.clear();
  plan.published_groups.clear();
  plan.published_points = {*named.begin()};
  plan.link_outputs = {{7, 1, 0}};
  std::int32_t row = 0;
  for (std::int32_t i = 0; i < kPoints; ++i) {
    PlanPoint& point = plan.points[static_cast<std::size_t>(i)];
    point.pushable = named.contains(i);
    point.row = point.pushable ? row++ : -1;
  }
  return plan;
}

TEST(Outbound, AboveAThousandPointsASceneMessageListsOnlyPointsInUse) {
  const Plan plan = make_sparse_plan({3, 6, 500, 501, 1999});
  EXPECT_EQ(io::scene_listing(plan).points, 5);
  EXPECT_EQ(io::scene_listing(plan).links, 1);
  const auto pages = io::make_scene_messages(plan, false, "/srv/helix.plan", kStamp);
  expect_pages(pages);
  std::vector<std::string> points, links;
  int num_pushable = 0, num_published = 0;
  for (const auto& page : pages) {
    EXPECT_EQ(page.total_points, kPoints);
    EXPECT_EQ(page.total_links, kPoints - 1);
    for (int k = 0; k < page.num_points; ++k) {
      const auto& point = page.points[static_cast<std::size_t>(k)];
      EXPECT_EQ(point.name, "p" + std::to_string(page.first_point + k));
      points.push_back(point.name);
      num_pushable += point.is_pushable;
      num_published += point.is_published;
    }
    for (int k = 0; k < page.num_links; ++k) links.push_back("l" + std::to_string(page.first_link + k));
  }
  // points in a short gap between listed points are listed too
  EXPECT_EQ(points, (std::vector<std::string>{"p3", "p4", "p5", "p6", "p500", "p501", "p1999"}));
  EXPECT_EQ(num_pushable, 5);
  EXPECT_EQ(num_published, 1);
  EXPECT_EQ(links, std::vector<std::string>{"l7"});
}

TEST(Outbound, ASceneIsSentCompleteInPages) {
  const Plan plan = make_plan();
  const auto pages = io::make_scene_messages(plan, false, "/srv/helix.plan", kStamp);
  expect_pages(pages);
  EXPECT_GT(pages.size(), 2u);
  int points = 0;
  int links = 0;
  int groups = 0;
  int elastic = 0;
  for (const auto& page : pages) {
    EXPECT_EQ(page.name, "helix");
    EXPECT_EQ(page.plan_file, "/srv/helix.plan");
    EXPECT_EQ(page.rate, 1000.0);
    EXPECT_EQ(page.inertia[1][2], 6.0);
    EXPECT_EQ(static_cast<std::uint64_t>(page.plan_fingerprint), kStamp.plan_fingerprint);
    EXPECT_EQ(static_cast<std::uint64_t>(page.scene_hash), plan.scene_hash);
    EXPECT_EQ(page.total_points, kPoints);
    EXPECT_EQ(page.total_links, kPoints - 1);
    EXPECT_EQ(page.total_groups, 300);
    EXPECT_EQ(page.total_elastic, kElastic);
    if (page.num_points > 0) {
      EXPECT_EQ(page.first_point, points);
    }
    if (page.num_links > 0) {
      EXPECT_EQ(page.first_link, links);
    }
    if (page.num_groups > 0) {
      EXPECT_EQ(page.first_group, groups);
    }
    if (page.num_frequencies > 0) {
      EXPECT_EQ(page.first_elastic, elastic);
    }
    for (const auto& point : page.points) EXPECT_EQ(point.name, "p" + std::to_string(points++));
    for (const auto& link : page.links) {
      EXPECT_EQ(link.points[1], ++links);
      EXPECT_EQ(link.is_published, 1);
    }
    for (const auto& group : page.groups) EXPECT_EQ(group.points[2], 2 + groups++);
    for (const double frequency : page.frequencies) {
      ++elastic;
      EXPECT_NEAR(frequency, elastic, 1e-14 * elastic);
    }
  }
  EXPECT_EQ(points, kPoints);
  EXPECT_EQ(links, kPoints - 1);
  EXPECT_EQ(groups, 300);
  EXPECT_EQ(elastic, kElastic);
}

TEST(Outbound, AModeShapeIsSentOnlyForPointsWithModeShapeRows) {
  Plan plan = make_plan();
  plan.points[3].row = -1;
  const auto pages = io::make_shapes_messages(plan, 4, kStamp);
  expect_pages(pages);
  int num_points = 0;
  for (const auto& page : pages) {
    EXPECT_EQ(page.mode, 4);
    EXPECT_NEAR(page.frequency, 4.0, 1e-14);
    for (std::size_t i = 0; i < page.point.size(); ++i, ++num_points) {
      EXPECT_NE(page.point[i], 3);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(page.shape[i][axis], page.point[i] + 0.001 * static_cast<double>(axis * kElastic + 3));
      }
    }
  }
  EXPECT_EQ(num_points, kPoints - 1);
}

TEST(Outbound, AnAppliedForceContainsTheCommandToTheBit) {
  ForceCommand command;
  ASSERT_EQ(decode(make_force(), make_names(), command).reason, io::Reason::kAccepted);
  const freeflex_msgs::applied_t message = io::make_applied_force(command, 99, 5, kStamp);
  EXPECT_EQ(message.kind, freeflex_msgs::applied_t::FORCE);
  EXPECT_EQ(message.tick, 99);
  EXPECT_EQ(message.applied_sequence, 5);
  EXPECT_EQ(message.session, kSession);
  EXPECT_EQ(static_cast<std::uint64_t>(message.plan_fingerprint), kStamp.plan_fingerprint);
  ForceCommand again;
  ASSERT_EQ(io::from_message(message.command, make_names(), again).reason, io::Reason::kAccepted);
  EXPECT_EQ(std::memcmp(&again, &command, sizeof(command)), 0);
}

TEST(Outbound, TheEndOfASlotIsPublishedWithItsCause) {
  Expiry expiry;
  std::copy_n("tug", 3, expiry.sender.begin());
  expiry.slot = 9;
  expiry.sequence = 77;
  freeflex_msgs::applied_t message = io::make_applied_expiry(expiry, 50, 6, kStamp);
  EXPECT_EQ(message.kind, freeflex_msgs::applied_t::EXPIRED);
  EXPECT_EQ(message.command.sender, "tug");
  EXPECT_EQ(message.command.slot, 9);
  EXPECT_EQ(message.command.sequence, 77);
  EXPECT_EQ(message.command.num_forces, 0);
  expiry.was_lease = true;
  EXPECT_EQ(io::make_applied_expiry(expiry, 50, 6, kStamp).kind, freeflex_msgs::applied_t::LEASE_LOST);
  EXPECT_EQ(io::make_applied_reset(51, 7, kStamp).kind, freeflex_msgs::applied_t::RESET);
}

}  // namespace
}  // namespace freeflex::testing
