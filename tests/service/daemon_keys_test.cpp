// With --keys the real freeflexd obeys only the holders of its keys. The daemon obeys these holders as a
// daemon without keys obeys everybody.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <optional>

#include "messages/channels.hpp"
#include "service/io/wire/reason.hpp"
#include "service/keys.hpp"
#include "tests/service/daemon_fixture.hpp"
#include "tests/service/rig.hpp"

namespace freeflex::testing {
namespace {

using freeflex_msgs::control_t;
using freeflex_msgs::state_t;
using io::Reason;

/// Makes a temporary folder with the key "test".
class KeyFolder {
 public:
  KeyFolder() : path_(temporary_path("keys")) {
    std::filesystem::create_directory(path_);
    std::filesystem::permissions(path_, std::filesystem::perms::owner_all);
    EXPECT_EQ(service::make_key(file(), "test"), "");
  }
  ~KeyFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  KeyFolder(const KeyFolder&) = delete;
  KeyFolder& operator=(const KeyFolder&) = delete;
  const std::string& path() const { return path_; }
  std::string file() const { return path_ + "/test.key"; }
  SealingKey key() const { return service::load_key(file()).keys.at(0).sealing; }

 private:
  std::string path_;
};

std::int64_t count(const BusClient& client, Reason reason) {
  for (const auto& rejection : client.statuses.back().rejections)
    if (rejection.reason == static_cast<std::int32_t>(reason)) return rejection.count;
  return 0;
}

TEST_F(Daemon, WithKeysItObeysOnlyTheHoldersOfTheKeys) {
  const KeyFolder keys;
  Process daemon(command_line("K", {"--keys", keys.path()}));
  BusClient client("K");
  ASSERT_TRUE(client.meet()) << daemon.output();
  client.key = keys.key();
  ForceCommand push = make_push(client.next_sequence++, 0, -1, 96);
  push.duration_ticks = 100;
  client.send(push);
  EXPECT_EQ(client.answer(push.sequence).reason, 0);
  EXPECT_EQ(client.answer(client.send_control(control_t::HOLD)).reason, 0);

  // a stranger without a key is answered, but copied commands, commands on another channel and commands
  // sealed with another secret are only counted
  freeflex_msgs::control_t stop{};
  stop.session = client.session;
  stop.sender = "stranger";
  stop.sequence = 1;
  stop.command = control_t::STOP;
  client.packets.publish("K_CONTROL", io::encode(stop));
  EXPECT_TRUE(client.until([&] { return count(client, Reason::kKeyRequired) == 1; }));
  EXPECT_TRUE(client.until([&] { return client.acks.back().sender == "stranger"; }));
  EXPECT_EQ(client.acks.back().reason, static_cast<std::int32_t>(Reason::kKeyRequired));
  const std::int64_t soon = stop.utime + 1'000'000 + client.statuses.back().utime;
  stop.sequence = client.next_sequence;
  SealingKey forged = *client.key;
  forged.secret[0] ^= 1;
  client.packets.publish("K_CONTROL", seal(stop, "K_CONTROL", forged, soon));
  client.packets.publish("K_CONTROL", seal(stop, "K_FORCE", *client.key, soon));
  stop.sequence = 1;
  client.packets.publish("K_CONTROL", seal(stop, "K_CONTROL", *client.key, soon));
  EXPECT_TRUE(client.until(
      [&] { return count(client, Reason::kBadTag) == 2 && count(client, Reason::kStaleSequence) == 1; }));
  EXPECT_EQ(client.statuses.back().commands_accepted, 2);
  EXPECT_EQ(client.statuses.back().commands_received, 6);
  EXPECT_EQ(client.answer(client.send_control(control_t::STOP)).reason, 0);
  EXPECT_EQ(daemon.wait(), 0) << daemon.output();
  const std::string log = daemon.output();
  EXPECT_NE(log.find("commands on the bus need one of these keys: test"), std::string::npos) << log;
  EXPECT_NE(log.find("was not sealed with it for this channel"), std::string::npos) << log;
}

/// Runs 300 ticks in lockstep with three pushes.
std::map<std::int64_t, state_t> run_programme(const std::vector<std::string>& more,
                                              const std::optional<SealingKey>& key) {
  std::vector<std::string> arguments{"--time", "lockstep"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  Process daemon(command_line("L", arguments));
  BusClient client("L");
  EXPECT_TRUE(client.meet()) << daemon.output();
  client.key = key;
  for (int i = 0; i < 3; ++i) {
    ForceCommand push = make_push(client.next_sequence++, i, 10 + 70 * i, 96 + i);
    push.duration_ticks = 50;
    client.send(push);
    EXPECT_EQ(client.answer(push.sequence).reason, 0);
  }
  client.send_control(control_t::STEP, 300);
  EXPECT_TRUE(client.until([&] { return client.states.contains(300); }));
  return client.states;
}

TEST_F(Daemon, TheMotionHasTheSameBitsWithAndWithoutKeys) {
  const KeyFolder keys;
  const auto open = run_programme({}, std::nullopt);
  const auto sealed = run_programme({"--keys", keys.file()}, keys.key());
  ASSERT_EQ(open.size(), sealed.size());
  for (const auto& [tick, state] : open) EXPECT_EQ(motion(state), motion(sealed.at(tick))) << tick;
  EXPECT_NE(motion(open.at(300)), motion(open.at(0)));
}

TEST_F(Daemon, WithKeysTheOperatorsSocketNeedsNoKey) {
  const KeyFolder keys;
  const std::string socket = temporary_path("keys.sock");
  Process daemon(command_line("O", {"--keys", keys.path(), "--socket", socket}));
  BusClient client("O");
  ASSERT_TRUE(client.meet()) << daemon.output();
  Process push({program("freeflex"), "push", "--timeout", "60", "--socket", socket, "--control", "stop"});
  EXPECT_EQ(push.wait(), 0) << push.output();
  EXPECT_EQ(daemon.wait(), 0) << daemon.output();
}

TEST_F(Daemon, DoesNotStartIfAKeyFileIsMissingOrReadableByOthers) {
  const auto refused = [](const std::string& keys) {
    Process daemon(command_line("M", {"--keys", keys}));
    EXPECT_EQ(daemon.wait(), 2) << daemon.output();
    return daemon.output();
  };
  const KeyFolder keys;
  std::filesystem::permissions(keys.file(), std::filesystem::perms::others_read,
                               std::filesystem::perm_options::add);
  EXPECT_NE(refused(keys.path()).find("chmod 600 '" + keys.file() + "'"), std::string::npos);
  std::filesystem::remove(keys.file());
  EXPECT_NE(refused(keys.path()).find("holds no file *.key"), std::string::npos);
  EXPECT_NE(refused("").find("cannot be read"), std::string::npos);
}

}  // namespace
}  // namespace freeflex::testing
