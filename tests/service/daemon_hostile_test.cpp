// These tests run the real freeflexd under commands that are rejected for every reason, bytes that are not a
// command, packets that kill liblcm and kills of the receiver. The daemon answers every message that can be
// answered, and no bit of its motion changes.
#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

#include "freeflex_msgs/envelope_t.hpp"
#include "messages/channels.hpp"
#include "service/io/wire/reason.hpp"
#include "tests/service/daemon_fixture.hpp"
#include "tests/service/rig.hpp"
#include "tests/support/send_signal.hpp"

namespace freeflex::testing {
namespace {

using freeflex_msgs::control_t;
using freeflex_msgs::force_t;
using freeflex_msgs::state_t;
using freeflex_msgs::status_t;
using io::Reason;
using Bytes = std::vector<std::byte>;

/// Sends ten commands for given ticks. All commands are acknowledged before the first of these ticks.
void send_programme(BusClient& client) {
  for (int i = 0; i < 10; ++i) {
    ForceCommand push = make_push(client.next_sequence++, i % 4, 1000 + 150 * i, 96 + i % 8, 1.0 + i);
    push.duration_ticks = 100 + 17 * i;
    push.axes = i % 2;
    client.send(push);
    ASSERT_EQ(client.answer(push.sequence).reason, 0);
  }
}

/// Returns copies of the push: cut after each number of bytes, with more bytes at the end, or with wrong
/// counts.
std::vector<Bytes> misshapen(const Bytes& push) {
  std::vector<Bytes> all;
  for (std::size_t size = 0; size < push.size(); ++size)
    all.emplace_back(push.begin(), push.begin() + static_cast<std::ptrdiff_t>(size));
  for (const std::size_t extra : {1, 8, 28}) {
    all.push_back(push);
    all.back().resize(push.size() + extra);
  }
  // the offset of the last two of the four counts, which one force (an int32 and three doubles) follows
  const std::size_t counts = push.size() - 28 - 8;
  for (const std::uint32_t count : {0xFFFFFFFFu, 1u << 30, 1u << 29, 0x80000000u}) {
    for (const std::size_t at : {counts, counts + 4}) {
      all.push_back(push);
      for (std::size_t i = 0; i < 4; ++i) all.back()[at + i] = static_cast<std::byte>(count >> (24 - 8 * i));
    }
  }
  return all;
}

/// Changes one to four bytes, which is too few to turn a push of session ~session into a command of this
/// session.
Bytes mutate(Bytes bytes, std::mt19937_64& engine) {
  for (std::uint64_t n = 1 + engine() % 4; n > 0; --n)
    bytes[engine() % bytes.size()] ^= static_cast<std::byte>(1 + engine() % 255);
  return bytes;
}

/// Sends invalid commands of all kinds, and then one of the two packets that kill liblcm.
void attack(BusClient& client, std::mt19937_64& engine, int round) {
  constexpr int kMutants = 1000;
  const std::string channel = std::string("I") + channels::kForce;
  const ForceCommand push = make_push(1'000'000);
  for (const Bytes& bytes : misshapen(io::encode(io::to_message(push, client.session, 0))))
    client.packets.publish(channel, bytes);
  // with ~session, all eight bytes of the session differ
  const Bytes foreign = io::encode(io::to_message(push, ~client.session, 0));
  for (int i = 0; i < kMutants; ++i) client.packets.publish(channel, mutate(foreign, engine));
  if (round % 2 == 0) client.packets.send_wrapping_fragment(channel);
  if (round % 2 == 1) client.packets.send_fragment_runt(channel);
}

/// Makes ten attacks. The receiving process survives each of them and is then killed.
void attack_and_kill(BusClient& client, const Process& daemon) {
  std::mt19937_64 engine(5);
  for (int round = 0; round < 10; ++round) {
    const std::int64_t num_seen = client.statuses.back().commands_received;
    attack(client, engine, round);
    EXPECT_TRUE(client.until([&] { return client.statuses.back().commands_received > num_seen; })) << round;
    EXPECT_EQ(client.statuses.back().ingress_restarts, round);
    ASSERT_TRUE(send_signal(find_ingress(daemon), SIGKILL)) << round;
    EXPECT_TRUE(client.until([&] { return client.statuses.back().ingress_restarts > round; })) << round;
  }
}

/// Runs the same commands for 4 s or more, with or without attacks.
std::map<std::int64_t, state_t> run_programme(bool is_attacked, std::int64_t& restarts) {
  BusClient client("I");
  Process daemon(command_line("I"));
  EXPECT_TRUE(client.meet()) << daemon.output();
  send_programme(client);
  if (is_attacked) attack_and_kill(client, daemon);
  EXPECT_TRUE(client.until([&] { return client.states.rbegin()->first >= 4000; }));
  daemon.signal(SIGINT);
  EXPECT_EQ(daemon.wait(), 0) << daemon.output();
  EXPECT_TRUE(client.until([&] { return client.statuses.back().mode == status_t::STOPPED; }));
  restarts = client.statuses.back().ingress_restarts;
  EXPECT_EQ(client.applied.size(), 20u) << "ten commands and their ends";
  EXPECT_EQ(client.statuses.back().commands_accepted, 10);
  return client.states;
}

TEST_F(Daemon, HostilePacketsAndKillsOfTheIngressChangeNoBit) {
  std::int64_t peaceful_restarts = 0;
  std::int64_t restarts = 0;
  const auto peaceful = run_programme(false, peaceful_restarts);
  const auto attacked = run_programme(true, restarts);
  EXPECT_EQ(peaceful_restarts, 0);
  EXPECT_EQ(restarts, 10);
  EXPECT_NE(motion(std::prev(peaceful.end())->second), motion(peaceful.begin()->second));
  int num_compared = 0;
  for (const auto& [tick, state] : attacked) {
    const auto same = peaceful.find(tick);
    if (same == peaceful.end()) continue;
    ++num_compared;
    ASSERT_EQ(motion(state), motion(same->second)) << tick;
  }
  EXPECT_GE(num_compared, 10);  // 200 states are published, but this client may lose some in the flood
}

/// A scene in which a command can break every rule.
constexpr const char* kScene = R"(name: reasons
rate: 1000
points:
  - {name: a, mass: 1, at: [0, 0, 0]}
  - {name: b, mass: 2, at: [1, 0, 0]}
  - {name: c, mass: 1, at: [0, 1, 0]}
  - {name: d, mass: 3, at: [0, 0, 1]}
links:
  - {spring: [a, b], stiffness: 1e4}
  - {spring: [a, c], stiffness: 1e4}
  - {spring: [a, d], stiffness: 1e4}
  - {spring: [b, c], stiffness: 1e4}
  - {spring: [b, d], stiffness: 1e4}
  - {spring: [c, d], stiffness: 1e4}
groups: {alone: [a], pair: [b, c]}
commands: {points: [a, b, c], force_limit: 100, torque_limit: 50}
)";

/// Sends commands, each of which breaks one rule. The daemon's status counts the rejections.
class Offender {
 public:
  explicit Offender(BusClient& client) : client_(client) {}

  /// Breaks each rule that the ingress checks.
  void break_rules_of_contents() {
    force([](force_t& f) { f.session += 1; });
    force([](force_t& f) { f.sender = "no spaces"; });
    force([](force_t& f) { f.sequence = 1; });
    force([](force_t& f) { f.slot = 64; });
    force([](force_t& f) { f.axes = 2; });
    force([](force_t& f) { f.lease_ticks = f.duration_ticks; });
    force([](force_t& f) { f.forces.resize(257, f.forces[0]), f.num_forces = 257; });
    force([](force_t& f) { f.forces[0].point = 4; });
    force([](force_t& f) { f.forces[0].point = 3; });
    force([](force_t& f) { f.wrenches = {{2, {1, 0, 0}, {}}}, f.num_wrenches = 1; });
    force([](force_t& f) { f.forces.push_back(f.forces[0]), f.num_forces = 2; });
    force([](force_t& f) { f.forces[0].force[1] = std::numeric_limits<double>::quiet_NaN(); });
    force([](force_t& f) { f.forces[0].force[1] = 100.5; });
    force([](force_t& f) { f.wrenches = {{0, {}, {0, 0, 1}}}, f.num_wrenches = 1; });
    force([](force_t& f) { f.torques = {{0, {0, 0, 1}}}, f.num_torques = 1; });
    client_.packets.publish(kForceChannel, io::encode(freeflex_msgs::envelope_t{}));
    Bytes bytes = io::encode(push());
    bytes.pop_back();
    client_.packets.publish(kForceChannel, bytes);
    bytes = io::encode(push());
    bytes[0] ^= std::byte{1};
    client_.packets.publish(kForceChannel, bytes);
    client_.send_control(77);
  }

  /// Breaks the rules that depend on the tick and on waiting commands.
  void break_rules_of_time(std::int64_t tick) {
    force([](force_t& f) { f.start_tick = 0; });
    force([tick](force_t& f) { f.start_tick = tick + 2 * io::kMaxAheadTicks; });
    client_.send_control(control_t::RUN);
    constexpr std::int64_t kFarTicks =
        59'000;  // below the limit of 60'000 for the bus, because ticks pass in the meantime
    // Commands for a tick that is never reached first take all slots of the sender and then fill the queue.
    // The 65th command is from another sender.
    for (int i = 0; i < 300; ++i) {
      force([i, tick](force_t& f) {
        f.start_tick = tick + kFarTicks;
        f.slot = i % 64;
        if (i == 64) f.sender = "other", f.sequence = 1;
      });
      if (i % 50 == 49) client_.answer(client_.next_sequence - 1);
    }
  }

  /// Sends from more senders than the daemon can store. After this function, the daemon accepts no new
  /// sender.
  void be_too_many() {
    for (int i = 0; i < 65; ++i) force([i](force_t& f) { f.sender = "s" + std::to_string(i), f.slot = -1; });
  }

 private:
  static constexpr const char* kForceChannel = "R_FORCE";

  force_t push() {
    ForceCommand command = make_push(client_.next_sequence++);
    command.duration_ticks = 10;
    return io::to_message(command, client_.session, 0);
  }
  template <class Change>
  void force(Change change) {
    force_t message = push();
    change(message);
    client_.packets.publish(kForceChannel, io::encode(message));
  }

  BusClient& client_;
};

/// Returns the numbers of rejections for each reason in the last status.
std::map<Reason, std::int64_t> rejections(const BusClient& client) {
  std::map<Reason, std::int64_t> counts;
  for (const auto& rejection : client.statuses.back().rejections)
    counts[static_cast<Reason>(rejection.reason)] = rejection.count;
  return counts;
}

/// Runs 400 ticks in lockstep with three pushes and, if `breaks` is true, with commands that break every
/// rule.
void run_with_rules_broken(const std::string& scene, bool breaks, std::map<std::int64_t, state_t>& states) {
  BusClient client("R");
  Process daemon({program("freeflexd"), scene, "--prefix", "R", "--time", "lockstep"});
  ASSERT_TRUE(client.meet()) << daemon.output();
  for (int i = 0; i < 3; ++i) {
    ForceCommand command = make_push(client.next_sequence++, i, 10 + 120 * i, i, 2.0);
    command.duration_ticks = 50;
    client.send(command);
    ASSERT_EQ(client.answer(command.sequence).reason, 0);
  }
  const auto advance_to = [&client](std::int64_t tick) {
    client.send_control(control_t::STEP, 100);
    return client.until([&] { return client.states.contains(tick); });
  };
  Offender offender(client);
  ASSERT_TRUE(advance_to(100));
  if (breaks) offender.break_rules_of_contents();
  ASSERT_TRUE(advance_to(200));
  if (breaks) offender.break_rules_of_time(200);
  ASSERT_TRUE(advance_to(300));
  if (breaks) offender.be_too_many();
  ASSERT_TRUE(advance_to(400));
  states = client.states;
  if (!breaks) return;
  // of the reasons before kFirstOfKeys, two are tested elsewhere: left_out needs a reduced plan, and too_old
  // needs a daemon that was stopped (daemon_ends_test). The reason epoch_ended needs the reset below.
  // verifier_test covers the reasons from kFirstOfKeys on
  constexpr int kFirstOfKeys = static_cast<int>(Reason::kKeyRequired);
  EXPECT_TRUE(client.until([&] { return rejections(client).size() >= kFirstOfKeys - 4; }));
  client.send_control(control_t::RESET);
  EXPECT_TRUE(client.until([&] { return rejections(client).size() == kFirstOfKeys - 3; }));
  for (int number = 1; number < kFirstOfKeys; ++number) {
    const auto reason = static_cast<Reason>(number);
    const bool is_met = reason != Reason::kLeftOut && reason != Reason::kTooOld;
    EXPECT_EQ(rejections(client)[reason] > 0, is_met) << io::reason_name(reason);
  }
  for (const auto& ack : client.acks) {
    if (ack.reason != 0) {
      EXPECT_FALSE(ack.text.empty()) << ack.reason;
    }
  }
}

TEST_F(Daemon, RejectedCommandsAreCountedAndAnsweredAndChangeNoBit) {
  const std::string scene = temporary_path("reasons.yaml");
  std::ofstream(scene) << kScene;
  std::map<std::int64_t, state_t> peaceful, provoked;
  run_with_rules_broken(scene, false, peaceful);
  run_with_rules_broken(scene, true, provoked);
  std::filesystem::remove(scene);
  ASSERT_EQ(peaceful.size(), provoked.size());
  for (const auto& [tick, state] : peaceful) {
    ASSERT_TRUE(provoked.contains(tick)) << tick;
    EXPECT_EQ(motion(state), motion(provoked.at(tick))) << tick;
  }
  EXPECT_NE(motion(peaceful.at(400)), motion(peaceful.at(0)));
}

}  // namespace
}  // namespace freeflex::testing
