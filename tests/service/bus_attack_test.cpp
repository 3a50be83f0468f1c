// The tests run the real freeflexd while its receiving processes are killed repeatedly, while packets that
// kill liblcm arrive at 1 to 1000 a second, and under floods of hostile packets. The tests measure the time
// until commands are answered again and how many commands arrive, and check that no bit of the motion
// changes. FREEFLEX_ATTACK_KILLS and FREEFLEX_ATTACK_SECONDS set the number of kills and the duration [s] of
// a run under attack.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <set>
#include <thread>

#include "messages/channels.hpp"
#include "tests/service/daemon_fixture.hpp"
#include "tests/service/rig.hpp"
#include "tests/support/send_signal.hpp"

namespace freeflex::testing {
namespace {

using freeflex_msgs::state_t;
using freeflex_msgs::status_t;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr bool kIsQuick = FREEFLEX_ATTACK_KILLS < 100;
constexpr int kKills = FREEFLEX_ATTACK_KILLS;
constexpr std::chrono::seconds kSeconds{FREEFLEX_ATTACK_SECONDS};

/// The build defines the name of this class, because ctest distinguishes tests only by name.
class FREEFLEX_ATTACK_NAME : public Daemon {};

/// Returns the processes of a daemon's ingress. The first is the oldest, which is the receiver.
std::vector<pid_t> find_children(const Process& daemon) {
  const std::string task = "/proc/" + std::to_string(daemon.pid()) + "/task/" + std::to_string(daemon.pid());
  std::ifstream file(task + "/children");
  std::vector<pid_t> children;
  for (pid_t child = 0; file >> child;) children.push_back(child);
  return children;
}

/// Returns a command that is accepted and changes nothing, because the command clears an empty slot.
ForceCommand make_idle(std::int64_t sequence) {
  ForceCommand command = make_push(sequence, 63);
  command.num_points = 0;
  command.duration_ticks = 0;
  command.lease_ticks = 0;
  return command;
}

/// Sends a command each millisecond until one of them is answered. Returns the time [us] from the kill to the
/// answer.
milliseconds::rep wait_for_input(BusClient& client, steady_clock::time_point killed) {
  const std::int64_t first = client.next_sequence;
  const std::size_t num_acks = client.acks.size();
  auto next = steady_clock::now();
  client.until([&] {
    for (; steady_clock::now() >= next; next += milliseconds(1))
      client.send(make_idle(client.next_sequence++));
    return std::any_of(client.acks.begin() + static_cast<std::ptrdiff_t>(num_acks), client.acks.end(),
                       [&](const auto& ack) { return ack.sequence >= first; });
  });
  return std::chrono::duration_cast<microseconds>(steady_clock::now() - killed).count();
}

void print_us(const char* what, std::vector<milliseconds::rep> us) {
  std::sort(us.begin(), us.end());
  const auto at = [&](double share) {
    return static_cast<double>(us[static_cast<std::size_t>(share * static_cast<double>(us.size() - 1))]) /
           1e3;
  };
  std::printf("%-40s %zu: p50 %.2f, p90 %.2f, p99 %.2f, max %.2f ms\n", what, us.size(), at(0.5), at(0.9),
              at(0.99), at(1.0));
}

TEST_F(FREEFLEX_ATTACK_NAME, CommandsAreAnsweredAgainAfterEachKill) {
  BusClient client("AK");
  Process daemon(command_line("AK"));
  ASSERT_TRUE(client.meet()) << daemon.output();
  const auto begin_tick = client.statuses.back().tick;
  const auto begin_utime = client.statuses.back().utime;
  const auto begin = client.statuses.back();
  std::vector<milliseconds::rep> one_us, both_us;
  for (int i = 0; i < kKills; ++i) {
    const std::vector<pid_t> children = find_children(daemon);
    ASSERT_FALSE(children.empty()) << i;
    // kills come in bursts of ten, each as soon as commands are answered again, and every third kill ends
    // both processes
    const bool kills_both = i % 3 == 2 && children.size() > 1;
    const auto killed = steady_clock::now();
    ASSERT_TRUE(send_signal(children[0], SIGKILL));
    if (kills_both) {
      ASSERT_TRUE(send_signal(children[1], SIGKILL));
    }
    (kills_both ? both_us : one_us).push_back(wait_for_input(client, killed));
    if (i % 10 == 9) {
      const auto end = steady_clock::now() + milliseconds(50);
      ASSERT_TRUE(client.until([&] { return steady_clock::now() >= end; }));
    }
  }
  print_us("input back, receiver killed", one_us);
  print_us("input back, both killed", both_us);
  std::ranges::copy(one_us, std::back_inserter(both_us));
  print_us("input back, all", both_us);
  const std::int64_t tick = client.statuses.back().tick + 200;
  ASSERT_TRUE(client.until([&] { return client.statuses.back().tick >= tick; }));
  const status_t& end = client.statuses.back();
  EXPECT_GE(end.ingress_restarts, kKills);
  std::printf("%lld restarts; %lld ticks in %.3f s, %lld overruns, %lld slips\n",
              static_cast<long long>(end.ingress_restarts), static_cast<long long>(end.tick - begin_tick),
              static_cast<double>(end.utime - begin_utime) * 1e-6,
              static_cast<long long>(end.overruns - begin.overruns),
              static_cast<long long>(end.slips - begin.slips));
  daemon.signal(SIGINT);
  EXPECT_EQ(daemon.wait(), 0) << daemon.output();
}

// The test stops the receiving process, which is then killed after 100 ms without a beat.
TEST_F(FREEFLEX_ATTACK_NAME, CommandsAreAnsweredAgainAfterEachHang) {
  BusClient client("AH");
  Process daemon(command_line("AH"));
  ASSERT_TRUE(client.meet()) << daemon.output();
  constexpr int kHangs = kKills / 10;
  std::vector<milliseconds::rep> hung_us;
  for (int i = 0; i < kHangs; ++i) {
    const std::vector<pid_t> children = find_children(daemon);
    ASSERT_FALSE(children.empty()) << i;
    const auto stopped = steady_clock::now();
    ASSERT_TRUE(send_signal(children[0], SIGSTOP));
    hung_us.push_back(wait_for_input(client, stopped));
    const auto end = steady_clock::now() + milliseconds(50);
    ASSERT_TRUE(client.until([&] { return steady_clock::now() >= end; }));
  }
  print_us("input back, receiver stopped", hung_us);
  ASSERT_TRUE(client.until([&] { return client.statuses.back().ingress_hangs >= kHangs; }));
  EXPECT_EQ(client.statuses.back().ingress_hangs, kHangs);
}

enum class Flood {
  kNone,
  kCutChannel,
  kWrappingFragment,
  kRunt,
  kDuplicate,
  kEmptyFragment,
  kHugeClaim,
  kChannels,
  kNegativeLengths
};
constexpr const char* kFloods[] = {"none",
                                   "channel without its NUL",
                                   "fragment offsets that wrap",
                                   "runt fragments",
                                   "duplicates of a command",
                                   "fragments of length zero",
                                   "first fragments of 256 MB",
                                   "channel names",
                                   "negative lengths"};

/// Sends packets of one kind as fast as the system accepts them, from its own thread.
class Flooder {
 public:
  Flooder(Flood kind, const std::string& prefix, std::int64_t session)
      : kind_(kind), channel_(prefix + channels::kForce) {
    freeflex_msgs::force_t message = io::to_message(make_idle(1), session, 0);
    message.sender = "copy";
    bytes_ = io::encode(message);
    negative_ = bytes_;
    // the last sixteen bytes of an empty command are its four counts
    for (std::size_t i = negative_.size() - 16; i < negative_.size(); ++i) negative_[i] = std::byte{0xFF};
    if (kind != Flood::kNone) thread_ = std::thread([this] { run(); });
  }
  ~Flooder() { stop(); }
  void stop() {
    is_stopping_ = true;
    if (thread_.joinable()) thread_.join();
  }
  std::int64_t num_sent() const { return num_sent_; }

 private:
  void run() {
    PacketSender packets;
    for (; !is_stopping_; ++num_sent_) {
      switch (kind_) {
        case Flood::kNone:
          break;
        case Flood::kCutChannel:
          packets.send_cut_channel(channel_);
          break;
        case Flood::kWrappingFragment:
          packets.send_wrapping_fragment(channel_);
          break;
        case Flood::kRunt:
          packets.send_fragment_runt(channel_);
          break;
        case Flood::kDuplicate:
          packets.publish(channel_, bytes_);
          break;
        case Flood::kEmptyFragment:
          packets.send_first_fragment(channel_, 1000, 0);
          break;
        case Flood::kHugeClaim:
          packets.send_first_fragment(channel_, 256U << 20, 1000);
          break;
        case Flood::kChannels:
          packets.publish("C" + std::to_string(num_sent_.load()), bytes_);
          break;
        case Flood::kNegativeLengths:
          packets.publish(channel_, negative_);
          break;
      }
    }
  }

  Flood kind_;
  std::string channel_;
  std::vector<std::byte> bytes_, negative_;
  std::atomic<bool> is_stopping_{false};
  std::atomic<std::int64_t> num_sent_{0};
  std::thread thread_;
};

/// The results of a run of kSeconds.
struct Attacked {
  std::map<std::int64_t, state_t> states;
  std::int64_t num_sent = 0, num_heard = 0, num_flooded = 0;
  status_t first{}, last{};
};

/// Sends ten commands for given ticks, then 100 idle commands a second while crafted packets or a flood
/// arrive.
Attacked run_attacked(int packets_a_second, Flood flood = Flood::kNone) {
  Attacked run;
  BusClient client("AP");
  Process daemon(command_line("AP"));
  EXPECT_TRUE(client.meet()) << daemon.output();
  for (int i = 0; i < 10; ++i) {
    ForceCommand push = make_push(client.next_sequence++, i % 4, 500 + 50 * i, 96 + i % 8, 1.0 + i);
    push.duration_ticks = 100 + 17 * i;
    client.send(push);
    EXPECT_EQ(client.answer(push.sequence).reason, 0);
  }
  EXPECT_TRUE(client.until([&] { return client.statuses.back().commands_accepted >= 10; }));
  run.first = client.statuses.back();
  const std::int64_t first_sequence = client.next_sequence;
  const std::size_t num_acks = client.acks.size();
  const std::string channel = std::string("AP") + channels::kForce;
  const auto begin = steady_clock::now();
  std::int64_t num_packets = 0;
  Flooder flooder(flood, "AP", client.session);
  EXPECT_TRUE(client.until([&] {
    const auto passed = steady_clock::now() - begin;
    for (; milliseconds(10) * run.num_sent < passed && passed < kSeconds; ++run.num_sent)
      client.send(make_idle(client.next_sequence++));
    for (; passed * packets_a_second > std::chrono::seconds(1) * num_packets && passed < kSeconds;
         ++num_packets) {
      if (num_packets % 3 == 0) client.packets.send_wrapping_fragment(channel);
      if (num_packets % 3 == 1) client.packets.send_fragment_runt(channel);
      if (num_packets % 3 == 2) client.packets.send_cut_channel(channel);
    }
    if (passed >= kSeconds) flooder.stop();
    return passed >= kSeconds + milliseconds(500);
  }));
  run.num_flooded = flooder.num_sent();
  // under a flood answers are lost too, so num_heard is then the daemon's own count
  std::set<std::int64_t> heard;
  for (std::size_t i = num_acks; i < client.acks.size(); ++i)
    if (client.acks[i].sequence >= first_sequence && client.acks[i].reason == 0)
      heard.insert(client.acks[i].sequence);
  const std::int64_t utime = client.statuses.back().utime;
  EXPECT_TRUE(client.until([&] { return client.statuses.back().utime > utime; }));
  run.last = client.statuses.back();
  run.num_heard = flood == Flood::kNone ? static_cast<std::int64_t>(heard.size())
                                        : run.last.commands_accepted - run.first.commands_accepted;
  daemon.signal(SIGINT);
  EXPECT_EQ(daemon.wait(), 0) << daemon.output();
  run.states = std::move(client.states);
  return run;
}

/// Expects that each state that arrived in both runs has the same bits in both.
void expect_same_motion(const Attacked& run, const Attacked& peaceful) {
  int num_compared = 0;
  for (const auto& [tick, state] : run.states) {
    const auto same = peaceful.states.find(tick);
    if (same == peaceful.states.end()) continue;
    ++num_compared;
    ASSERT_EQ(motion(state), motion(same->second)) << "tick " << tick;
  }
  EXPECT_GE(num_compared, 10);
}

TEST_F(FREEFLEX_ATTACK_NAME, AFloodEndsNoProcessAndChangesNoBit) {
  const Attacked peaceful = run_attacked(0);
  for (int kind = 0; kind <= static_cast<int>(Flood::kNegativeLengths); ++kind) {
    // the quick run has only three floods: one that kills liblcm, one that loads the packet filter and one
    // that loads the codec
    if (kIsQuick && kind != static_cast<int>(Flood::kWrappingFragment) &&
        kind != static_cast<int>(Flood::kChannels) && kind != static_cast<int>(Flood::kNegativeLengths))
      continue;
    SCOPED_TRACE(kFloods[kind]);
    const Attacked run = run_attacked(0, static_cast<Flood>(kind));
    std::printf("%-27s %8.0f/s: %lld of %lld commands heard, %lld restarts, %lld overruns, %lld slips\n",
                kFloods[kind],
                static_cast<double>(run.num_flooded) / std::chrono::duration<double>(kSeconds).count(),
                static_cast<long long>(run.num_heard), static_cast<long long>(run.num_sent),
                static_cast<long long>(run.last.ingress_restarts),
                static_cast<long long>(run.last.overruns - run.first.overruns),
                static_cast<long long>(run.last.slips - run.first.slips));
    EXPECT_EQ(run.last.ingress_restarts, 0);
    EXPECT_GT(run.num_heard, 0);
    expect_same_motion(run, peaceful);
  }
}

TEST_F(FREEFLEX_ATTACK_NAME, CraftedPacketsLoseFewCommandsEndNoProcessAndChangeNoBit) {
  const Attacked peaceful = run_attacked(0);
  for (const int rate : {0, 1, 20, 100, 1000}) {
    if (kIsQuick && (rate == 1 || rate == 100)) continue;
    const Attacked run = rate == 0 ? peaceful : run_attacked(rate);
    std::printf(
        "%4d crafted packets a second: %lld of %lld commands heard, %lld restarts, %lld ticks, %lld "
        "overruns, lateness p99.9 %.0f us\n",
        rate, static_cast<long long>(run.num_heard), static_cast<long long>(run.num_sent),
        static_cast<long long>(run.last.ingress_restarts),
        static_cast<long long>(run.last.tick - run.first.tick),
        static_cast<long long>(run.last.overruns - run.first.overruns), run.last.lateness_us[2]);
    EXPECT_GE(run.num_heard * 100, run.num_sent * 95) << rate;
    EXPECT_EQ(run.last.ingress_restarts, 0) << rate;
    SCOPED_TRACE(rate);
    expect_same_motion(run, peaceful);
  }
}

}  // namespace
}  // namespace freeflex::testing
