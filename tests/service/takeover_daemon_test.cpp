// These tests run the daemon with a hostile ingress. This program is the test, the daemon that the test
// starts, and the ingress of this daemon. Until the ingress is killed, it writes arbitrary bytes into all
// memory that it can reach.
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <span>

#include "service/bus_socket.hpp"
#include "service/daemon.hpp"
#include "service/ingress.hpp"
#include "service/io/wire/lcm_packet.hpp"
#include "service/keys.hpp"
#include "service/log.hpp"
#include "tests/service/bus_client.hpp"
#include "tests/service/hostile_ingress.hpp"
#include "tests/service/rig.hpp"
#include "tests/support/private_network.hpp"

namespace freeflex::testing {
namespace {

std::string no_network;  // reason why there is no private network; empty if there is one

/// Runs the hostile ingress. The hostile ingress does nothing until a FORCE arrives, because some of its
/// actions report another daemon on the prefix, which would keep this daemon from starting. The hostile
/// ingress is confined like the genuine ingress and makes only the same system calls.
service::IngressEnd be_hostile(service::SharedBlock& block, const service::IngressSettings& settings,
                               int seat) {
  static std::array<std::byte, 65536> buffer;  // no UDP packet is larger
  HostileIngress hostile(block, 7);
  std::atomic<std::uint64_t>& beat = block.seats[static_cast<std::size_t>(seat)].beat;
  bool is_active = false;
  bool is_hostile = false;
  while (getppid() == settings.daemon_pid) {
    beat.fetch_add(1);
    if (!is_active) {
      pollfd order{service::kOrderFd, POLLIN, 0};
      is_active = poll(&order, 1, 10) == 1;
    } else if (!is_hostile) {
      const service::ReceivedPacket packet = service::receive_packet(service::kSocketFd, buffer);
      const auto message =
          packet.size > 0
              ? service::read_lcm_packet(std::span(buffer).first(static_cast<std::size_t>(packet.size)))
              : std::nullopt;
      is_hostile = message && message->channel == "T_FORCE";
    } else {
      // after a hundred actions there is a pause, so that the daemon can run in between, even on a single
      // processor
      for (int i = 0; i < 100; ++i) hostile.act();
      poll(nullptr, 0, 1);
    }
  }
  return service::IngressEnd::kDaemonGone;
}

/// Runs this program as the daemon: PROGRAM daemon KEYS
int be_daemon(const char* keys) {
  service::DaemonOptions options;
  options.input = scene_path("truss104.yaml");
  options.prefix = "T";
  options.keys = keys;
  service::SignalWatch signals;
  service::start_log("info");
  const int status = service::run_daemon(options, signals);
  service::end_log(status);
  return status;
}

TEST(DaemonWithAHostileIngress, AppliesNoCommandAndKeepsRunning) {
  if (!no_network.empty()) GTEST_SKIP() << no_network;
  const std::filesystem::path folder =
      std::filesystem::path(P_tmpdir) / ("freeflex-takeover-" + std::to_string(getpid()));
  std::filesystem::create_directory(folder);
  const std::string key = folder / "test.key";
  ASSERT_EQ(service::make_key(key, "test"), "");
  BusClient client("T");
  Process daemon({std::filesystem::read_symlink("/proc/self/exe"), "daemon", key});
  ASSERT_TRUE(client.meet()) << daemon.output();
  ASSERT_TRUE(client.until([&] { return client.statuses.back().mode == freeflex_msgs::status_t::RUNNING; }));
  // One push without a key makes an ingress hostile. On a busy machine an ingress may be killed because its
  // beats are missing, so each replacement gets its own push.
  std::int64_t num_lives = 0;
  const auto provoke = [&] {
    if (client.statuses.back().ingress_restarts < num_lives) return;
    client.send(make_push(++num_lives));
  };
  const auto num_refused = [&client] {
    std::int64_t count = 0;
    for (const auto& rejection : client.statuses.back().rejections)
      if (rejection.reason != static_cast<std::int32_t>(io::Reason::kQueueFull)) count += rejection.count;
    return count;
  };
  // waits until more than 10,000 entries of the ingress are refused and more than 1000 ticks have passed
  const std::int64_t from = client.statuses.back().tick;
  EXPECT_TRUE(client.until([&] {
    provoke();
    return num_refused() > 10'000 && client.statuses.back().tick > from + 1000;
  })) << daemon.output();
  daemon.signal(SIGINT);
  EXPECT_EQ(daemon.wait(), 0) << daemon.output();
  EXPECT_TRUE(client.until([&] { return client.statuses.back().mode == freeflex_msgs::status_t::STOPPED; }));
  EXPECT_EQ(client.statuses.back().commands_accepted, 0);
  EXPECT_EQ(client.statuses.back().epoch, 0);
  EXPECT_TRUE(client.applied.empty());
  EXPECT_TRUE(client.acks.empty()) << "the false answers of the ingress are not published";
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace freeflex::testing

int main(int argc, char** argv) {
  if (const auto status = freeflex::service::run_if_ingress(argc, argv, freeflex::testing::be_hostile))
    return *status;
  if (argc == 3 && std::string(argv[1]) == "daemon") return freeflex::testing::be_daemon(argv[2]);
  ::testing::InitGoogleTest(&argc, argv);
  freeflex::testing::no_network = freeflex::testing::enter_private_network();
  return RUN_ALL_TESTS();
}
