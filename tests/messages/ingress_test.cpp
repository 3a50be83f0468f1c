// The ingress processes pass on commands from UDP, are not harmed by packets that kill liblcm, and lose no
// command when one of them ends. The test program takes the part of the daemon, and of the ingress if it is
// started with --ingress.
#include "service/ingress.hpp"

#include <gtest/gtest.h>
#include <lcm/lcm.h>
#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <thread>

#include "freeflex_msgs/status_t.hpp"
#include "tests/messages/commands.hpp"
#include "tests/support/lcm_packets.hpp"
#include "tests/support/private_network.hpp"
#include "tests/support/send_signal.hpp"

namespace freeflex::testing {
namespace {

using io::Reason;
using service::InboundEntry;
using service::InboundKind;
using service::IngressProcess;
using service::RejectionEntry;

std::string no_network;  // reason why there is no private network; empty if there is one

constexpr auto kPatience = std::chrono::seconds(
    60);  // far longer than any machine needs, so that a test fails only if a process hangs

/// Evaluates the condition every millisecond until it is true. Returns false if the condition stays false for
/// kPatience.
template <class Condition>
bool eventually(Condition&& condition) {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

class Ingress : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!no_network.empty()) GTEST_SKIP() << no_network;
    IngressProcess::Options options;
    options.session = kSession;
    options.channel_prefix = "TEST";
    options.timeout = std::chrono::seconds(60);
    const std::string fault = ingress_.start(options, make_names());
    ASSERT_EQ(fault, "");
  }

  void send(std::int64_t sequence) {
    freeflex_msgs::force_t message = make_force();
    message.sequence = sequence;
    ASSERT_TRUE(packets_.publish("TEST_FORCE", io::encode(message)));
  }
  bool receives(std::int64_t sequence) {
    return eventually([&] {
      ingress_.poll();
      return ingress_.block().inbound.try_pop(entry_) && entry_.force.sequence == sequence;
    });
  }
  bool rejects(Reason reason) {
    return eventually([&] {
      ingress_.poll();
      return ingress_.block().rejected.try_pop(rejection_) && rejection_.admission.reason == reason;
    });
  }
  /// Waits until an ingress process has been replaced and both ingress processes are ready.
  bool restarts() {
    const std::int64_t before = ingress_.num_restarts();
    return eventually([&] {
      if (const std::string event = ingress_.poll(); !event.empty()) events_.push_back(event);
      return ingress_.num_restarts() > before && ingress_.is_complete();
    });
  }
  bool is_complete() {
    return eventually([&] { return ingress_.poll(), ingress_.is_complete(); });
  }

  IngressProcess ingress_;
  PacketSender packets_;
  InboundEntry entry_{};
  RejectionEntry rejection_{};
  std::vector<std::string> events_;
};

TEST_F(Ingress, AForbiddenSystemCallEndsOneProcessAndIsExplainedOnce) {
  constexpr int kTimes = 8;  // more than the failed starts after which start() gives up
  for (int i = 1; i <= kTimes; ++i) {
    ASSERT_TRUE(is_complete());
    // the filter of system calls ends a process by this signal
    ASSERT_EQ(kill(ingress_.pid(), SIGSYS), 0);
    ASSERT_TRUE(restarts());
    send(i);
    EXPECT_TRUE(receives(i));
  }
  int num_named = 0;
  int num_explained = 0;
  for (const std::string& event : events_) {
    num_named += event.find("made a system call that its filter forbids") != std::string::npos ? 1 : 0;
    num_explained +=
        event.find("/etc/ld.so.preload") != std::string::npos || event.find("LD_PRELOAD") != std::string::npos
            ? 1
            : 0;
  }
  EXPECT_EQ(num_named, kTimes);
  EXPECT_EQ(num_explained, 1);
}

TEST_F(Ingress, PassesOnCommandsFromLcm) {
  lcm_t* lcm = lcm_create("udpm://239.255.76.67:7667?ttl=0");
  ASSERT_NE(lcm, nullptr);
  const freeflex_msgs::force_t message = make_force();
  const std::vector<std::byte> bytes = io::encode(message);
  ASSERT_EQ(lcm_publish(lcm, "TEST_FORCE", bytes.data(), static_cast<unsigned>(bytes.size())), 0);
  ASSERT_TRUE(receives(42));
  EXPECT_EQ(entry_.kind, InboundKind::kForce);
  EXPECT_EQ(io::encode(io::to_message(entry_.force, message.session, message.utime)), bytes);
  const std::vector<std::byte> control = io::encode(make_control());
  ASSERT_EQ(lcm_publish(lcm, "TEST_CONTROL", control.data(), static_cast<unsigned>(control.size())), 0);
  ASSERT_TRUE(eventually([&] { return ingress_.block().inbound.try_pop(entry_); }));
  EXPECT_EQ(entry_.kind, InboundKind::kControl);
  EXPECT_EQ(entry_.control.command, freeflex_msgs::control_t::RUN);
  lcm_destroy(lcm);
}

TEST_F(Ingress, RejectsInvalidCommandsAndDetectsAnotherDaemon) {
  freeflex_msgs::force_t message = make_force();
  message.forces[0].point = 5000;
  packets_.publish("TEST_FORCE", io::encode(message));
  ASSERT_TRUE(rejects(Reason::kUnknownPoint));
  EXPECT_TRUE(io::is_sane(rejection_.admission));
  packets_.publish("OTHER_FORCE", io::encode(make_force()));
  freeflex_msgs::status_t status{};
  status.session = 4711;
  packets_.publish("TEST_STATUS", io::encode(status));
  EXPECT_TRUE(eventually([&] { return ingress_.block().other_session.load() == 4711; }));
  EXPECT_EQ(ingress_.block().received.load(), 1) << "messages on other channels are not counted";
  EXPECT_GT(ingress_.socket().receive_buffer(), 0);
}

TEST_F(Ingress, APacketThatEndsInsideTheChannelNameIsHarmless) {
  // liblcm would read the rest of the name from the previous packet
  for (std::int64_t i = 1; i <= 50; ++i) {
    send(i);
    ASSERT_TRUE(receives(i));
    ASSERT_TRUE(packets_.send_cut_channel("TEST_FORCE"));
  }
  send(51);
  EXPECT_TRUE(receives(51));
  EXPECT_EQ(ingress_.num_restarts(), 0);
  EXPECT_EQ(ingress_.block().received.load(), 51);
}

TEST_F(Ingress, PacketsThatCrashLiblcmAreRejectedAndEndNoProcess) {
  for (std::int64_t i = 1; i <= 50; ++i) {
    ASSERT_TRUE(packets_.send_wrapping_fragment("TEST_FORCE"));
    ASSERT_TRUE(packets_.send_fragment_runt("TEST_FORCE"));
    send(i);
    ASSERT_TRUE(receives(i));
  }
  EXPECT_EQ(ingress_.num_restarts(), 0);
  ASSERT_TRUE(rejects(Reason::kMalformed));
  EXPECT_EQ(std::string(rejection_.admission.text.data()),
            "a message in fragments has more than 65499 bytes, but a command has at most 8760");
}

TEST_F(Ingress, AStandbyThatTakesOverStillRefusesOldSequenceNumbers) {
  ASSERT_TRUE(is_complete());
  send(1);
  ASSERT_TRUE(receives(1));
  const pid_t first = ingress_.pid();
  const pid_t second = ingress_.standby_pid();
  ASSERT_TRUE(send_signal(first, SIGKILL));
  ASSERT_TRUE(restarts());
  EXPECT_EQ(ingress_.pid(), second) << "the standby";
  ASSERT_FALSE(events_.empty());
  EXPECT_NE(events_[0].find("its standby takes over"), std::string::npos) << events_[0];
  send(1);
  EXPECT_TRUE(rejects(Reason::kStaleSequence)) << "the table of sequences outlives the process";
  send(2);
  EXPECT_TRUE(receives(2));
}

TEST_F(Ingress, PacketsSentWhileNoProcessReceivesReachTheNextProcessOnceAndInOrder) {
  ASSERT_TRUE(is_complete());
  std::int64_t sequence = 0;
  for (int round = 0; round < 5; ++round) {
    const std::int64_t first = sequence + 1;
    // poll() is not called, so no process is replaced, until all packets are sent
    ASSERT_TRUE(send_signal(ingress_.pid(), SIGKILL));
    if (round % 2 == 1) {
      ASSERT_TRUE(send_signal(ingress_.standby_pid(), SIGKILL));
    }
    siginfo_t ended{};
    ASSERT_EQ(waitid(P_PID, static_cast<id_t>(ingress_.pid()), &ended, WEXITED | WNOWAIT), 0);
    for (int i = 0; i < 100; ++i) send(++sequence);
    for (std::int64_t expected = first; expected <= sequence; ++expected) {
      ASSERT_TRUE(eventually([&] { return ingress_.poll(), ingress_.block().inbound.try_pop(entry_); }));
      ASSERT_EQ(entry_.force.sequence, expected);
    }
    ASSERT_TRUE(is_complete());
  }
  EXPECT_FALSE(ingress_.block().inbound.try_pop(entry_));
  RejectionEntry none;
  EXPECT_FALSE(ingress_.block().rejected.try_pop(none)) << "no command arrived twice";
}

TEST_F(Ingress, AProcessStoppedBySigstopIsReplacedWithoutLossOfCommands) {
  ASSERT_TRUE(is_complete());
  const pid_t stopped = ingress_.pid();
  ASSERT_TRUE(send_signal(stopped, SIGSTOP));
  // until it has stopped, the process may still read a packet, which would be lost when the process is killed
  ASSERT_TRUE(eventually([stopped] { return service::read_process(stopped).state == 'T'; }));
  for (std::int64_t i = 1; i <= 20; ++i) send(i);
  ASSERT_TRUE(restarts());
  EXPECT_EQ(ingress_.num_hangs(), 1);
  EXPECT_EQ(events_[0], "the ingress process was stopped and was killed; its standby takes over");
  for (std::int64_t i = 1; i <= 20; ++i) EXPECT_TRUE(receives(i));
  EXPECT_FALSE(send_signal(stopped, 0));
  // the standby is watched too
  ASSERT_TRUE(send_signal(ingress_.standby_pid(), SIGSTOP));
  ASSERT_TRUE(restarts());
  EXPECT_EQ(ingress_.num_hangs(), 2);
}

TEST_F(Ingress, MessagesOnOtherChannelsTakeNoRoomInTheQueue) {
  ASSERT_TRUE(is_complete());
  // while both processes are stopped, more packets are sent than the socket's queue can store
  ASSERT_TRUE(send_signal(ingress_.standby_pid(), SIGSTOP));
  ASSERT_TRUE(send_signal(ingress_.pid(), SIGSTOP));
  const std::vector<std::byte> large(60'000);
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(packets_.publish("TEST_STATE", large));
  EXPECT_LT(ingress_.socket().fill(), 0.01);
  // the loopback interface queues at most 1000 packets for the whole machine and drops the others, so a
  // packet may be lost before it reaches the socket
  std::int64_t sequence = 0;
  EXPECT_TRUE(eventually([&] {
    send(++sequence);
    ingress_.poll();
    return ingress_.block().inbound.try_pop(entry_);
  }));
}

TEST_F(Ingress, IsReplacedAfterEveryKill) {
  ASSERT_TRUE(is_complete());
  for (std::int64_t i = 1; i <= 10; ++i) {
    ASSERT_TRUE(send_signal(i % 2 == 0 ? ingress_.pid() : ingress_.standby_pid(), SIGKILL));
    ASSERT_TRUE(restarts()) << i;
    send(i);
    ASSERT_TRUE(receives(i)) << i;
  }
  EXPECT_EQ(ingress_.num_restarts(), 10);
  EXPECT_EQ(ingress_.num_hangs(), 0);
}

TEST_F(Ingress, MapsItsSettingsReadOnly) {
  // the kernel maps the settings read-only in the ingress, so that even a hostile ingress cannot write them
  const std::string path = "/proc/" + std::to_string(ingress_.pid()) + "/maps";
  std::FILE* maps = std::fopen(path.c_str(), "r");
  ASSERT_NE(maps, nullptr);
  char line[512];
  std::vector<std::string> rights;
  while (std::fgets(line, sizeof(line), maps) != nullptr) {
    if (std::string(line).find("/memfd:freeflexd") == std::string::npos) continue;
    rights.push_back(std::string(line).substr(std::string(line).find(' ') + 1, 4));
  }
  std::fclose(maps);
  std::ranges::sort(rights);
  EXPECT_EQ(rights, (std::vector<std::string>{"r--s", "rw-s"}));
}

TEST_F(Ingress, HasNoRightsThatItDoesNotNeed) {
  const std::string path = "/proc/" + std::to_string(ingress_.pid());
  std::map<std::string, std::string> status;
  std::ifstream lines(path + "/status");
  for (std::string line; std::getline(lines, line);) {
    const std::size_t colon = line.find(":\t");
    if (colon != line.npos) status[line.substr(0, colon)] = line.substr(colon + 2);
  }
  for (const char* set : {"CapInh", "CapPrm", "CapEff", "CapAmb"})
    EXPECT_EQ(status[set], "0000000000000000") << set;
  EXPECT_EQ(status["NoNewPrivs"], "1");
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  EXPECT_EQ(status["Seccomp"], "2");
  EXPECT_EQ(ingress_.lacks() & service::kLacksFilter, 0u);
#endif
  if (ingress_.user().uid != service::IngressUser::kSame && ingress_.lacks() == 0) {
    const std::string uid = std::to_string(ingress_.user().uid);
    EXPECT_EQ(status["Uid"], uid + "\t" + uid + "\t" + uid + "\t" + uid);
    EXPECT_EQ(status["Groups"], " ");
  }
  std::vector<std::string> open;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(path + "/fd", none))
    open.push_back(entry.path().filename());
  std::ranges::sort(open);
  EXPECT_EQ(open, (std::vector<std::string>{"0", "1", "2", "5", "6"}));
}

TEST_F(Ingress, IgnoresSigintSigtermAndSighupButEndsWhenItsDaemonStopsIt) {
  const pid_t pid = ingress_.pid();
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) ASSERT_TRUE(send_signal(pid, number));
  send(1);
  EXPECT_TRUE(receives(1));
  EXPECT_EQ(ingress_.pid(), pid);
  ingress_.stop();
  EXPECT_FALSE(send_signal(pid, 0)) << "ended and reaped";
  EXPECT_EQ(ingress_.poll(), "") << "not restarted";
}

TEST_F(Ingress, AcceptsOldSequenceNumbersAfterAStopAndANewStart) {
  send(5);
  ASSERT_TRUE(receives(5));
  ingress_.stop();
  IngressProcess::Options options;
  options.session = kSession;
  options.channel_prefix = "TEST";
  ASSERT_EQ(ingress_.start(options, make_names()), "");
  send(5);
  EXPECT_TRUE(receives(5));
}

TEST(IngressStart, RefusesAnInvalidUrlOrPrefixAndReportsTheCause) {
  IngressProcess ingress;
  IngressProcess::Options options;
  options.channel_prefix = "TEST";
  options.lcm_url = "udpm://239.255.76.67:0";
  EXPECT_NE(ingress.start(options, make_names()).find("1 to 65535"), std::string::npos);
  EXPECT_EQ(ingress.poll(), "");
  options.lcm_url.clear();
  for (const char* prefix : {"", "A.*", "A B", "123456789012345678901234567890123"}) {
    options.channel_prefix = prefix;
    EXPECT_NE(ingress.start(options, make_names()).find("channel prefix"), std::string::npos);
  }
}

TEST(IngressStart, ReportsTheTwoCommandsThatAddAMissingRoute) {
  if (!no_network.empty()) GTEST_SKIP() << no_network;
  std::string fault;
  // this thread alone gets a network namespace with its loopback interface down
  std::thread([&fault] {
    ASSERT_EQ(unshare(CLONE_NEWNET), 0);
    IngressProcess ingress;
    IngressProcess::Options options;
    options.session = kSession;
    options.channel_prefix = "TEST";
    fault = ingress.start(options, make_names());
    EXPECT_EQ(ingress.pid(), -1);
  }).join();
  EXPECT_NE(fault.find("ip link set lo up multicast on"), std::string::npos) << fault;
  EXPECT_NE(fault.find("ip route add 239.0.0.0/8 dev lo"), std::string::npos) << fault;
}

TEST(IngressStart, ReportsAPortThatAnotherProgramUses) {
  if (!no_network.empty()) GTEST_SKIP() << no_network;
  const int holder = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in here{};
  here.sin_family = AF_INET;
  here.sin_port = htons(7700);
  ASSERT_EQ(bind(holder, reinterpret_cast<const sockaddr*>(&here), sizeof(here)), 0);
  IngressProcess ingress;
  IngressProcess::Options options;
  options.session = kSession;
  options.channel_prefix = "TEST";
  options.lcm_url = "udpm://239.255.76.67:7700";
  const std::string fault = ingress.start(options, make_names());
  EXPECT_NE(fault.find("port 7700"), std::string::npos) << fault;
  EXPECT_NE(fault.find("--lcm-url"), std::string::npos) << fault;
  close(holder);
}

/// The child process takes the part of a daemon: it starts an ingress, writes the pid of the ingress to a
/// pipe and then kills itself.
TEST(IngressStart, EndsWithItsDaemon) {
  if (!no_network.empty()) GTEST_SKIP() << no_network;
  int channel[2];
  ASSERT_EQ(pipe(channel), 0);
  const pid_t daemon = fork();
  if (daemon == 0) {
    auto* ingress = new IngressProcess;
    IngressProcess::Options options;
    options.session = kSession;
    options.channel_prefix = "TEST";
    const bool started = ingress->start(options, make_names()).empty();
    const pid_t pid = started ? ingress->pid() : -1;
    if (write(channel[1], &pid, sizeof(pid)) != sizeof(pid)) _exit(2);
    raise(SIGKILL);
  }
  pid_t pid = -1;
  ASSERT_EQ(read(channel[0], &pid, sizeof(pid)), static_cast<ssize_t>(sizeof(pid)));
  close(channel[0]);
  close(channel[1]);
  waitpid(daemon, nullptr, 0);
  ASSERT_GT(pid, 0);
  EXPECT_TRUE(eventually([pid] {
    // a process that has ended but was not reaped (a zombie) still has a cmdline file, which is empty
    std::FILE* file = std::fopen(("/proc/" + std::to_string(pid) + "/cmdline").c_str(), "r");
    if (file == nullptr) return true;
    const bool is_empty = std::fgetc(file) == EOF;
    std::fclose(file);
    return is_empty;
  }));
}

}  // namespace
}  // namespace freeflex::testing

int main(int argc, char** argv) {
  if (const auto status = freeflex::service::run_if_ingress(argc, argv)) return *status;
  ::testing::InitGoogleTest(&argc, argv);
  freeflex::testing::no_network = freeflex::testing::enter_private_network();
  return RUN_ALL_TESTS();
}
