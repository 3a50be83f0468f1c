// These tests use the C++ client with the real freeflexd.
#include "service/client/client.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <optional>

#include "freeflex_msgs/control_t.hpp"
#include "messages/channels.hpp"
#include "service/io/wire/reason.hpp"
#include "tests/service/daemon_fixture.hpp"

namespace freeflex::testing {
namespace {

/// Returns one of the three pages of a scene of three points, one point on each page.
freeflex_msgs::scene_t page_of_three(std::int32_t page) {
  freeflex_msgs::scene_t scene{};
  scene.session = 1;
  scene.total_points = scene.num_pages = 3;
  scene.page = scene.first_point = page;
  scene.num_points = 1;
  scene.points.resize(1);
  scene.points[0].name = "p" + std::to_string(page);
  scene.points[0].is_published = 1;
  return scene;
}

TEST(SceneCatalogue, IsCompleteWhenAllItsPagesHaveArrived) {
  client::SceneCatalogue scene;
  for (const std::int32_t page : {2, 0, 0}) scene.take(page_of_three(page), 100);
  EXPECT_FALSE(scene.is_complete());
  scene.take(page_of_three(1), 100);
  ASSERT_TRUE(scene.is_complete());
  EXPECT_EQ(scene.find_point("p2"), 2);
  EXPECT_EQ(scene.find_point("nose"), std::nullopt);
  EXPECT_EQ(scene.max_point_pages(), 6);
  EXPECT_EQ(scene.max_load_pages(), 0);
}

TEST(SceneCatalogue, RefusesImpossibleCounts) {
  client::SceneCatalogue scene;
  constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max();
  for (const std::int32_t page : {0, 1}) scene.take(page_of_three(page), 100);
  using Scene = freeflex_msgs::scene_t;
  for (std::int32_t Scene::*count : {&Scene::total_points, &Scene::total_links, &Scene::total_groups,
                                     &Scene::total_elastic, &Scene::num_pages, &Scene::first_point}) {
    for (const std::int32_t value : {kMost, -1}) {
      Scene page = page_of_three(2);
      page.session =
          2;  // the session of another daemon: if the page were accepted, a new catalogue would begin
      page.*count = value;
      scene.take(page, 100);
    }
  }
  scene.take(page_of_three(2), 100);
  EXPECT_TRUE(scene.is_complete()) << "earlier pages are kept";
}

/// Writes a scene of two points, 1 kg and 3 kg, that a spring joins.
class ClientOfADaemon : public Daemon {
 protected:
  void SetUp() override {
    Daemon::SetUp();
    std::ofstream(scene_)
        << "name: pair\nrate: 1000\n"
           "points:\n  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: b, mass: 3, at: [1, 0, 0]}\n"
           "links: [{name: rod, spring: [a, b], stiffness: 100}]\n"
           "commands: {force_limit: 10}\n"
           "publish: {state: 1000, points: {rate: 100}, loads: {rate: 100}}\n";
  }
  ~ClientOfADaemon() override { std::remove(scene_.c_str()); }

  /// Returns the daemon's command line. The default time mode is lockstep.
  std::vector<std::string> line(std::vector<std::string> more = {"--time", "lockstep"}) const {
    std::vector<std::string> words{program("freeflexd"), scene_, "--prefix", kPrefix, "--log-level", "error"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  static client::Options options() {
    return {.prefix = kPrefix, .timeout = std::chrono::duration_cast<std::chrono::milliseconds>(kPatience)};
  }

  static constexpr const char* kPrefix = "CLIENT";
  std::string scene_ = temporary_path("client.yaml");
};

TEST_F(ClientOfADaemon, StepReturnsTheStateAfterItsLastTick) {
  const Process daemon(line());
  client::Daemon pair(options());
  EXPECT_EQ(pair.scene().head().name, "pair");
  const std::int64_t start = pair.step(7).tick;
  EXPECT_EQ(pair.step().tick, start + 1);
  EXPECT_EQ(pair.step(1000).tick, start + 1001);
}

TEST_F(ClientOfADaemon, AfterAResetNothingOfThePreviousEpochIsReturned) {
  const Process daemon(line());
  client::Daemon pair(options());
  pair.push({.forces = {{"b", {2.0, 0.0, 0.0}}}, .duration = 0.5});
  EXPECT_EQ(pair.step(1000).epoch, 0);
  const std::int64_t tick = pair.reset();
  EXPECT_EQ(tick, 1000);
  EXPECT_TRUE(!pair.state() || pair.state()->epoch == 1);
  const freeflex_msgs::state_t& state = pair.next_state();
  EXPECT_EQ(state.epoch, 1);
  EXPECT_EQ(state.time, 0.0);
  EXPECT_EQ(pair.next_points().epoch, 1);
  EXPECT_EQ(pair.next_loads().epoch, 1);
  EXPECT_EQ(pair.step(10).time, 0.01);
}

TEST_F(ClientOfADaemon, APushByNameActsForItsDuration) {
  const Process daemon(line());
  client::Daemon pair(options());
  const std::int64_t tick = pair.push({.forces = {{"b", {2.0, 0.0, 0.0}}}, .duration = 0.5});
  const freeflex_msgs::state_t& state = pair.step(1000);
  EXPECT_GE(state.tick, tick + 500);
  // 2 N act for 0.5 s on 4 kg, and the rounding errors of 500 ticks add up to 1e-13 at most
  EXPECT_NEAR(state.velocity[0], 2.0 * 0.5 / 4.0, 1e-12);
}

TEST_F(ClientOfADaemon, PointsAndLoadsAreFoundByName) {
  const Process daemon(line());
  client::Daemon pair(options());
  pair.push({.forces = {{"a", {-1.0, 0.0, 0.0}}, {"b", {1.0, 0.0, 0.0}}}, .duration = 10.0});
  pair.step(100);
  const client::PointsTick points = pair.next_points();
  const client::LoadsTick loads = pair.next_loads();
  EXPECT_EQ(points.session, pair.session());
  EXPECT_EQ(points.tick % 10, 0);
  EXPECT_GE(points.at(pair.point("b")).position[0] - points.at(pair.point("a")).position[0], 1.0);
  EXPECT_EQ(loads.at(pair.link("rod")).num_values, 1);
  EXPECT_THROW(points.at(2), client::UnknownName);
}

TEST_F(ClientOfADaemon, ARejectedCommandThrowsTheReasonAndTheText) {
  const Process daemon(line());
  client::Daemon pair(options());
  try {
    pair.push({.forces = {{"b", {11.0, 0.0, 0.0}}}, .duration = 0.1});
    FAIL() << "11 N were accepted above a limit of 10 N";
  } catch (const client::Rejected& rejected) {
    EXPECT_EQ(rejected.ack.reason, static_cast<std::int32_t>(io::Reason::kOverLimit));
    EXPECT_NE(std::string(rejected.what()).find("rejected: over_limit: "), std::string::npos)
        << rejected.what();
  }
  EXPECT_THROW(pair.run(), client::Rejected);  // RUN is rejected in lockstep
  EXPECT_THROW(pair.push({.forces = {{"b", {1.0, 0.0, 0.0}}}, .duration = 1.0, .lease = 1.0}),
               client::Rejected);
  try {
    pair.push({.forces = {{"nose", {1.0, 0.0, 0.0}}}, .duration = 1.0});
    FAIL() << "the scene has no point nose";
  } catch (const client::UnknownName& unknown) {
    EXPECT_STREQ(unknown.what(), "there is no point 'nose'; the scene has a, b");
  }
}

TEST_F(ClientOfADaemon, AfterARestartOfTheDaemonTheClientWorksAgain) {
  std::optional<Process> daemon;
  daemon.emplace(line());
  client::Daemon pair(options());
  const std::int64_t first = pair.session();
  EXPECT_GT(pair.step(5).tick, 0);
  daemon->signal(SIGTERM);
  EXPECT_EQ(daemon->wait(), 0);
  daemon.reset();
  daemon.emplace(line());
  // the command has the session of the daemon that has ended
  EXPECT_THROW(pair.push({.forces = {{"b", {1.0, 0.0, 0.0}}}, .duration = 0.1}), client::Restarted);
  EXPECT_NE(pair.session(), first);
  pair.push({.forces = {{"b", {1.0, 0.0, 0.0}}}, .duration = 0.1});
  const std::int64_t start = pair.status().tick;
  EXPECT_GE(pair.step(3).tick, start + 3);
}

TEST_F(ClientOfADaemon, CommandsAreSealedWithTheKeyOfAKeyFile) {
  const std::string key = temporary_path("client.key");
  ASSERT_EQ(Process({program("freeflex"), "keygen", "pilot", "--out", key}).wait(), 0);
  {
    const Process daemon(line({"--time", "lockstep", "--keys", key}));
    client::Options with_key = options();
    with_key.key_file = key;
    client::Daemon pair(with_key);
    EXPECT_EQ(pair.sender(), "pilot");
    EXPECT_EQ(pair.step(2).tick, 2);
    client::Daemon plain(options());
    EXPECT_THROW(plain.step(), client::Rejected);
  }
  std::remove(key.c_str());
}

TEST_F(ClientOfADaemon, WithoutADaemonTheErrorStatesTheBus) {
  client::Options hasty = options();
  hasty.timeout = std::chrono::milliseconds(50);
  try {
    const client::Daemon nobody(hasty);
    FAIL() << "no daemon runs";
  } catch (const client::NoAnswer& silence) {
    EXPECT_STREQ(silence.what(),
                 "no STATUS came within 0.05 s on udpm://239.255.76.67:7667?ttl=0, channels CLIENT_*. Is "
                 "freeflexd running?");
  }
  hasty.url = "memq://";
  EXPECT_THROW(const client::Daemon nobody(hasty), client::NoBus);
  hasty.url = {};
  hasty.key_file = "/nowhere";
  EXPECT_THROW(const client::Daemon nobody(hasty), client::NoBus);
}

}  // namespace
}  // namespace freeflex::testing
