// The real freeflexd in a private network: commands, answers, a second daemon, signals, hostile packets.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <random>
#include <set>

#include "messages/channels.hpp"
#include "service/io/reason.hpp"
#include "tests/service/bus_client.hpp"
#include "tests/service/rig.hpp"
#include "tests/support/private_network.hpp"

namespace freeflex::testing {
namespace {

using freeflex_msgs::applied_t;
using freeflex_msgs::control_t;
using freeflex_msgs::state_t;
using freeflex_msgs::status_t;
using io::Reason;

std::string no_network;  // why there is none

std::vector<std::string> command_line(const std::string& prefix, std::vector<std::string> more = {}) {
  std::vector<std::string> arguments{program("freeflexd"), scene_path("truss104.yaml"), "--prefix", prefix};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

/// Every number of a published motion.
std::vector<double> motion(const state_t& state) {
  std::vector<double> numbers(state.q);
  numbers.insert(numbers.end(), state.q_dot.begin(), state.q_dot.end());
  for (const double* v : {state.position, state.velocity, state.angular_velocity, state.angular_momentum}) {
    numbers.insert(numbers.end(), v, v + 3);
  }
  numbers.insert(numbers.end(), state.attitude, state.attitude + 4);
  return numbers;
}

class Daemon : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!no_network.empty()) GTEST_SKIP() << no_network;
  }
};

TEST_F(Daemon, AnswersACommandPublishesItAppliedAndMoves) {
  BusClient client("A");
  Process daemon(command_line("A", {"--time", "lockstep"}));
  ASSERT_TRUE(client.meet()) << daemon.output();
  EXPECT_EQ(client.statuses.back().time_mode, "lockstep");
  ForceCommand push = make_push(client.next_sequence++, 3, 10, 103, 2.0);
  push.duration_ticks = 30;
  client.send(push);
  const auto accepted = client.answer(push.sequence);
  EXPECT_EQ(accepted.reason, 0);
  EXPECT_EQ(accepted.tick, 10);
  EXPECT_EQ(accepted.session, client.session);
  EXPECT_EQ(client.answer(client.send_control(control_t::STEP, 100)).reason, 0);
  ASSERT_TRUE(client.until([&] { return client.states.contains(100) && client.applied.size() == 2; }));
  EXPECT_EQ(client.applied[0].kind, applied_t::FORCE);
  EXPECT_EQ(client.applied[0].tick, 10);
  EXPECT_EQ(client.applied[0].command.sequence, push.sequence);
  EXPECT_EQ(client.applied[0].command.forces[0].force[2], 6.0);
  EXPECT_EQ(client.applied[1].kind, applied_t::EXPIRED);
  EXPECT_EQ(client.applied[1].tick, 40);
  // 30 ms of (2, 4, 6) N, and what the scene pushes itself: 100 ms of (0.48, 0.6, 0.64) N; 104 kg
  const state_t& state = client.states.at(100);
  EXPECT_EQ(state.applied_count, 2);
  const Vec3 pulse{0.048, 0.060, 0.064};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double impulse = 0.06 * static_cast<double>(axis + 1) + pulse[axis];
    EXPECT_NEAR(104.0 * state.velocity[axis], impulse, 1e-12 * impulse)
        << axis;  // 100 sums, each rounded to 1e-16
  }
  // every multiple of the publication interval is there: lockstep skips none
  for (std::int64_t tick = 0; tick <= 100; tick += 20) EXPECT_TRUE(client.states.contains(tick)) << tick;
  EXPECT_EQ(client.answer(client.send_control(control_t::RUN)).reason, static_cast<int>(Reason::kWrongMode));
  EXPECT_EQ(client.answer(client.send_control(control_t::STOP)).reason, 0);
  EXPECT_EQ(daemon.wait(), 0) << daemon.output();
}

TEST_F(Daemon, PublishesEveryChannelAndEndsCleanlyOnSigint) {
  BusClient client("B");
  Process daemon(command_line("B"));
  ASSERT_TRUE(client.meet()) << daemon.output();
  EXPECT_EQ(client.answer(client.send_control(control_t::SHAPES, 1)).reason, 0);
  ForceCommand lease = make_push(client.next_sequence++);
  lease.duration_ticks = 0;
  lease.lease_ticks = 20;
  client.send(lease);
  EXPECT_EQ(client.answer(lease.sequence).reason, 0);
  EXPECT_TRUE(client.until([&] {
    bool has_all = true;
    for (const char* suffix : {channels::kState, channels::kPoints, channels::kStatus, channels::kScene,
                               channels::kShapes, channels::kAck, channels::kApplied}) {
      has_all = has_all && client.num_messages[suffix] > 0;
    }
    return has_all && client.applied.size() >= 2;
  }));
  EXPECT_EQ(client.applied[1].kind, applied_t::LEASE_LOST) << "nobody renewed the lease";
  EXPECT_EQ(client.applied[1].tick, client.applied[0].tick + 20);
  // the counters tell of both
  ASSERT_TRUE(client.until([&] { return client.statuses.back().commands_accepted == 2; }));
  EXPECT_EQ(client.statuses.back().commands_received, 2);
  EXPECT_EQ(client.statuses.back().mode, status_t::RUNNING);
  daemon.signal(SIGINT);
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_NE(daemon.output().find("SIGINT: "), std::string::npos) << daemon.output();
  EXPECT_TRUE(client.until([&] { return client.statuses.back().mode == status_t::STOPPED; }));
}

TEST_F(Daemon, AnswersWhatTheIngressTurnsDown) {
  BusClient client("C");
  Process daemon(command_line("C", {"--hold"}));
  ASSERT_TRUE(client.meet()) << daemon.output();
  client.send(make_push(7, 0, -1, 5000));
  EXPECT_EQ(client.answer(7).reason, static_cast<int>(Reason::kUnknownPoint));
  EXPECT_NE(client.acks.back().text, "");
  client.send(make_push(8, 0, -1, 103));
  EXPECT_EQ(client.answer(8).reason, 0);
  ForceCommand late = make_push(9, 0, -1, 103);
  client.next_sequence = 10;
  EXPECT_EQ(client.answer(client.send_control(control_t::STEP, 5)).reason, 0);
  ASSERT_TRUE(client.until([&] { return client.states.contains(5); }));
  late.sequence = 11;
  late.start_tick = 2;
  client.send(late);
  const auto answer = client.answer(11);
  EXPECT_EQ(answer.reason, static_cast<int>(Reason::kLate));
  EXPECT_EQ(answer.tick, 5);
  ASSERT_TRUE(client.until([&] { return client.statuses.back().num_rejections == 2; }));
}

TEST_F(Daemon, RefusesASecondOneOnThePrefixAndSaysWhoIsThere) {
  BusClient client("D");
  Process first(command_line("D", {"--hold"}));
  ASSERT_TRUE(client.meet()) << first.output();
  Process second(command_line("D"));
  EXPECT_EQ(second.wait(), 1);
  EXPECT_NE(second.output().find(std::to_string(client.session)), std::string::npos) << second.output();
  EXPECT_NE(second.output().find("--prefix"), std::string::npos) << "says what to do";
  Process elsewhere(command_line("D2", {"--until", "0.01"}));
  EXPECT_EQ(elsewhere.wait(), 0) << elsewhere.output();
  first.signal(SIGTERM);
  EXPECT_EQ(first.wait(), 0);
}

TEST_F(Daemon, OfTwoStartedTogetherExactlyOneStays) {
  BusClient client("E");
  Process one(command_line("E", {"--until", "3"}));
  Process other(command_line("E", {"--until", "3"}));
  const std::multiset<int> ends{one.wait(), other.wait()};
  EXPECT_EQ(ends, (std::multiset<int>{0, 1})) << one.output() << other.output();
}

TEST_F(Daemon, EndsCleanlyWhenToldDuringStartUp) {
  BusClient client("F");
  Process daemon(command_line("F"));
  // the scene is read; the ingress starts, or the bus is listened to
  ASSERT_TRUE(client.until([&] { return daemon.output().find("104 points") != std::string::npos; }));
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_NE(daemon.output().find("before the first tick"), std::string::npos) << daemon.output();
}

TEST_F(Daemon, LeavesNoIngressBehindWhenItIsKilled) {
  BusClient client("G");
  Process daemon(command_line("G", {"--hold"}));
  ASSERT_TRUE(client.meet()) << daemon.output();
  // the only child there is
  const std::string task = "/proc/" + std::to_string(daemon.pid()) + "/task/" + std::to_string(daemon.pid());
  std::ifstream children(task + "/children");
  pid_t ingress = -1;
  ASSERT_TRUE(children >> ingress);
  ASSERT_EQ(kill(ingress, 0), 0);
  daemon.signal(SIGKILL);
  EXPECT_EQ(daemon.wait(), 1000 + SIGKILL);
  const auto is_gone = [ingress] {
    std::ifstream stat("/proc/" + std::to_string(ingress) + "/stat");
    std::string pid, name, state;
    // a zombie that waits for its new parent has ended as well
    return !(stat >> pid >> name >> state) || state == "Z";
  };
  EXPECT_TRUE(client.until(is_gone));
}

TEST_F(Daemon, SaysWhatIsWrongAndHowToMendIt) {
  const auto run = [](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), program("freeflexd"));
    Process daemon(arguments);
    const int status = daemon.wait();
    return std::to_string(status) + " " + daemon.output();
  };
  const std::string scene = scene_path("boom.yaml");
  const auto expect = [](const std::string& found, const std::string& status, const std::string& words) {
    EXPECT_TRUE(found.starts_with(status + " ")) << found;
    EXPECT_NE(found.find(words), std::string::npos) << found;
  };
  expect(run({}), "2", "SCENE");
  expect(run({"--help"}), "0", "LCM_DEFAULT_URL");
  expect(run({scene, "--time", "fast"}), "2", "lockstep");
  expect(run({scene, "--time", "scaled=0"}), "2", "scaled=K");
  expect(run({scene, "--rate", "-5"}), "2", "'-5'");
  expect(run({scene, "--rate", "nan"}), "2", "'nan'");
  expect(run({"nowhere.yaml"}), "2", "nowhere.yaml");
  expect(run({scene, "--lcm-url", "memq://"}), "2", "udpm://");
  expect(run({scene, "--lcm-url", "file://x.log"}), "2", "udpm://");
  expect(run({scene, "--lcm-url", "udpm://10.0.0.1:7667"}), "1", "multicast address");
  expect(run({scene, "--prefix", "no/slash"}), "1", "prefix");
}

TEST_F(Daemon, SaysHowToGetAMulticastRoute) {
  // a network namespace whose loopback is down has no route at all
  Process daemon({"unshare", "-n", program("freeflexd"), scene_path("boom.yaml")});
  EXPECT_EQ(daemon.wait(), 1);
  const std::string output = daemon.output();
  EXPECT_NE(output.find("ip link set lo up multicast on"), std::string::npos) << output;
  EXPECT_NE(output.find("ip route add 239.0.0.0/8 dev lo"), std::string::npos) << output;
}

TEST_F(Daemon, RunsOnWhenNobodyTakesItsLog) {
  // /dev/full refuses every byte, as a full disk does
  Process daemon({"/bin/sh", "-c",
                  "exec " + program("freeflexd") + " " + scene_path("boom.yaml") +
                      " --prefix H --log-level debug --until 0.2 2>/dev/full"});
  EXPECT_EQ(daemon.wait(), 0);
}

/// Ten commands with ticks of their own, all acknowledged before the first.
void send_programme(BusClient& client) {
  for (int i = 0; i < 10; ++i) {
    ForceCommand push = make_push(client.next_sequence++, i % 4, 1000 + 150 * i, 96 + i % 8, 1.0 + i);
    push.duration_ticks = 100 + 17 * i;
    push.axes = i % 2;
    client.send(push);
    ASSERT_EQ(client.answer(push.sequence).reason, 0);
  }
}

/// Bytes that are no command, among them what kills liblcm.
void attack(BusClient& client, std::mt19937_64& engine, int round) {
  const std::string channel = std::string("I") + channels::kForce;
  std::vector<std::byte> bytes = io::encode(io::to_message(make_push(1'000'000), client.session, 0));
  for (int i = 0; i < 100; ++i) {
    std::vector<std::byte> bad(bytes);
    const std::size_t at = engine() % bad.size();
    switch (i % 4) {
      case 0:
        bad.resize(at);
        break;
      case 1:
        bad.push_back(std::byte{7});
        break;
      case 2:
        bad[16 + engine() % 8] ^= std::byte{0x55};
        break;  // the session
      default:
        bad[engine() % 8] ^= std::byte{1};  // the fingerprint
    }
    client.packets.publish(channel, bad);
  }
  if (round % 2 == 0) client.packets.send_wrapping_fragment(channel);
  if (round % 2 == 1) client.packets.send_fragment_runt(channel);
}

/// Ten attacks, each until the ingress has died of one and another runs.
void attack_and_restart(BusClient& client) {
  constexpr std::chrono::milliseconds kAgain{500};  // a packet may meet an ingress that does not receive yet
  std::mt19937_64 engine(5);
  for (int round = 0; round < 10; ++round) {
    const std::int64_t before = client.statuses.back().ingress_restarts;
    auto next = std::chrono::steady_clock::now();
    EXPECT_TRUE(client.until([&] {
      if (std::chrono::steady_clock::now() >= next) {
        attack(client, engine, round);
        next += kAgain;
      }
      return client.statuses.back().ingress_restarts > before;
    })) << round;
  }
}

/// 4 s and more with the programme, in peace or under attack.
std::map<std::int64_t, state_t> run_programme(bool is_attacked, std::int64_t& restarts) {
  BusClient client("I");
  Process daemon(command_line("I"));
  EXPECT_TRUE(client.meet()) << daemon.output();
  send_programme(client);
  if (is_attacked) attack_and_restart(client);
  EXPECT_TRUE(client.until([&] { return client.states.rbegin()->first >= 4000; }));
  daemon.signal(SIGINT);
  EXPECT_EQ(daemon.wait(), 0) << daemon.output();
  EXPECT_TRUE(client.until([&] { return client.statuses.back().mode == status_t::STOPPED; }));
  restarts = client.statuses.back().ingress_restarts;
  EXPECT_EQ(client.applied.size(), 20u) << "ten commands and their ends";
  return client.states;
}

TEST_F(Daemon, HostilePacketsRestartTheIngressAndChangeNoBit) {
  std::int64_t peaceful_restarts = 0;
  std::int64_t restarts = 0;
  const auto peaceful = run_programme(false, peaceful_restarts);
  const auto attacked = run_programme(true, restarts);
  EXPECT_EQ(peaceful_restarts, 0);
  EXPECT_GE(restarts, 10);
  EXPECT_NE(motion(std::prev(peaceful.end())->second), motion(peaceful.begin()->second));
  int num_compared = 0;
  for (const auto& [tick, state] : attacked) {
    const auto same = peaceful.find(tick);
    if (same == peaceful.end()) continue;
    ++num_compared;
    ASSERT_EQ(motion(state), motion(same->second)) << tick;
  }
  EXPECT_GE(num_compared, 10);  // of 200 published; a flood may cost the reader some
}

/// What `freeflex replay` says of an lcm-logger recording of 2 s, with commands at ticks of their own.
std::string record_and_replay(const std::string& timing, std::map<std::int64_t, state_t>& states) {
  const std::string log = std::string(P_tmpdir) + "/freeflex-timing-" + std::to_string(getpid()) + ".log";
  Recorder recorder("T", log);
  BusClient client("T");
  const bool is_lockstep = timing == "lockstep";
  std::vector<std::string> more{"--time", timing, "--until", "2"};
  if (!is_lockstep) more.emplace_back("--hold");
  Process daemon(command_line("T", more));
  EXPECT_TRUE(client.meet()) << daemon.output();
  for (int i = 0; i < 6; ++i) {
    ForceCommand push = make_push(client.next_sequence++, i % 3, 100 + 250 * i, 96 + i, 1.0 + i);
    push.duration_ticks = 40 + 90 * i;
    push.axes = i % 2;
    client.send(push);
    EXPECT_EQ(client.answer(push.sequence).reason, 0);
  }
  if (is_lockstep) {
    client.send_control(control_t::STEP, 2000);
  } else {
    client.send_control(control_t::RUN);
  }
  EXPECT_EQ(daemon.wait(), 0) << daemon.output();
  EXPECT_TRUE(client.until([&] { return client.states.contains(2000); }));
  EXPECT_EQ(recorder.stop(), "");
  Process replay({program("freeflex"), "replay", log, "--prefix", "T"});
  EXPECT_EQ(replay.wait(), 0) << timing << replay.output();
  unlink(log.c_str());
  states = client.states;
  return replay.output();
}

TEST_F(Daemon, RecordingsInEveryTimingAreOneMotionAndReplayToTheBit) {
  std::map<std::int64_t, state_t> first;
  for (const char* timing : {"realtime", "scaled=10", "asap", "lockstep"}) {
    std::map<std::int64_t, state_t> states;
    const std::string verdict = record_and_replay(timing, states);
    EXPECT_NE(verdict.find("identical to the bit over 2000 ticks"), std::string::npos)
        << timing << ": " << verdict;
    if (first.empty()) first = states;
    int num_compared = 0;
    for (const auto& [tick, state] : states) {
      if (!first.contains(tick)) continue;
      ++num_compared;
      ASSERT_EQ(motion(state), motion(first.at(tick))) << timing << " tick " << tick;
    }
    EXPECT_GE(num_compared, 10) << timing;
  }
}

TEST_F(Daemon, IsHeldInAFaultAndRecoversByReset) {
  BusClient client("J");
  Process daemon({program("freeflexd"), scene_path("boom.yaml"), "--prefix", "J", "--time", "lockstep"});
  ASSERT_TRUE(client.meet()) << daemon.output();
  // each is finite, their sum is not
  ForceCommand huge = make_push(client.next_sequence++, 0, 5, 0, 5e307);
  for (int point = 1; point < 4; ++point) add_force(huge, point, Eigen::Vector3d(1e308, 1e308, 1e308));
  client.send(huge);
  ASSERT_EQ(client.answer(huge.sequence).reason, 0) << client.acks.back().text;
  client.send_control(control_t::STEP, 100);
  ASSERT_TRUE(client.until([&] { return client.statuses.back().mode == status_t::FAULT; }));
  EXPECT_EQ(client.statuses.back().tick, 5);
  EXPECT_NE(client.statuses.back().fault.find("not finite"), std::string::npos)
      << client.statuses.back().fault;
  for (const auto& [tick, state] : client.states) {
    for (const double number : motion(state)) ASSERT_TRUE(std::isfinite(number)) << tick;
  }
  EXPECT_EQ(client.answer(client.send_control(control_t::STEP, 1)).reason,
            static_cast<int>(Reason::kWrongMode));
  EXPECT_EQ(client.answer(client.send_control(control_t::RESET)).reason, 0);
  EXPECT_EQ(client.answer(client.send_control(control_t::STEP, 10)).reason, 0);
  ASSERT_TRUE(client.until([&] { return client.states.contains(15); }));
  EXPECT_EQ(client.states.at(15).epoch, 1);
  EXPECT_NE(daemon.output().find("fault: "), std::string::npos) << "and the log says it";
}

}  // namespace
}  // namespace freeflex::testing

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  freeflex::testing::no_network = freeflex::testing::enter_private_network();
  return RUN_ALL_TESTS();
}
