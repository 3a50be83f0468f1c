// The rotor runs at 1 kHz under 500 commands a second, every point is published at 50 Hz, and lcm-logger
// records the bus. Sender, acknowledgements, APPLIED entries and log must agree on each command.
// FREEFLEX_LOAD_SECONDS sets the duration. The percentiles of lateness are printed together with those of
// cyclictest in the same minute, because without a real-time kernel both depend on the other programs of the
// machine.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <thread>

#include "messages/channels.hpp"
#include "service/io/wire/log.hpp"
#include "service/io/wire/reason.hpp"
#include "tests/service/bus_client.hpp"
#include "tests/service/latency.hpp"
#include "tests/service/rig.hpp"
#include "tests/support/private_network.hpp"

namespace freeflex::testing {
namespace {

using freeflex_msgs::ack_t;
using freeflex_msgs::applied_t;
using freeflex_msgs::control_t;
using freeflex_msgs::status_t;
using io::Reason;
using std::chrono::microseconds;
using std::chrono::steady_clock;

constexpr int kSeconds = FREEFLEX_LOAD_SECONDS;
constexpr microseconds kCommandPeriod{2000};  // 500 a second
constexpr const char* kPrefix = "LOAD";

std::string no_network;  // reason why there is no private network; empty if there is one

/// The expected answer to each sequence number.
using Expected = std::map<std::int64_t, Reason>;

/// Sends commands for kSeconds and returns the expected answers. The ingress must reject some commands
/// (unknown point), and the command queue others (late).
Expected send_load(BusClient& client) {
  Expected expected;
  auto next = steady_clock::now();
  const int num_commands = static_cast<int>(std::chrono::seconds(kSeconds) / kCommandPeriod);
  for (int i = 0; i < num_commands; ++i) {
    ForceCommand push = make_push(client.next_sequence++, i % 8, -1, (7 * i) % 115, 0.1);
    push.duration_ticks = 50;
    Reason reason = Reason::kAccepted;
    if (i % 25 == 24) push.start_tick = 0, reason = Reason::kLate;
    if (i % 40 == 39) push.points[0].point = 115, reason = Reason::kUnknownPoint;
    client.send(push);
    expected[push.sequence] = reason;
    next += kCommandPeriod;
    client.read();
    std::this_thread::sleep_until(next);
  }
  return expected;
}

/// Counts the answers and APPLIED entries that one listener received from the bus.
struct Account {
  std::map<std::int64_t, int> answers;  // by sequence
  std::map<std::int64_t, int> applied;  // by sequence
  std::map<std::int64_t, Reason> reasons;
  std::int64_t next_applied = 0;  // the next expected applied_sequence
  bool has_gap = false;
  std::int64_t first_missing = -1;  // first missing applied_sequence

  void add(const ack_t& ack) {
    if (ack.sender != "test") return;
    ++answers[ack.sequence];
    reasons[ack.sequence] = static_cast<Reason>(ack.reason);
  }
  void add(const applied_t& entry) {
    if (!has_gap && entry.applied_sequence != next_applied) has_gap = true, first_missing = next_applied;
    ++next_applied;
    if (entry.kind == applied_t::FORCE) ++applied[entry.command.sequence];
  }
};

/// Expects that every command is answered once as expected, and applied once if and only if it was accepted.
void expect_complete(const Expected& expected, const Account& account, const std::string& who) {
  EXPECT_FALSE(account.has_gap) << who;
  int num_wrong = 0;
  for (const auto& [sequence, reason] : expected) {
    const auto answers = account.answers.find(sequence);
    const auto applied = account.applied.find(sequence);
    const bool is_answered = answers != account.answers.end() && answers->second == 1;
    const int num_applied = applied == account.applied.end() ? 0 : applied->second;
    const bool is_right = is_answered && account.reasons.at(sequence) == reason &&
                          num_applied == (reason == Reason::kAccepted ? 1 : 0);
    if (!is_right) ++num_wrong;
  }
  EXPECT_EQ(num_wrong, 0) << who << ": commands not accounted for, of " << expected.size();
}

/// What a recording of lcm-logger contains: the number of messages on each channel, the account, and the
/// commands.
struct Recording {
  std::map<std::string, std::int64_t> counts;
  Account account;
  std::map<std::int64_t, int> sent;  // by sequence
  std::string error;
};
Recording read_recording(const std::string& path) {
  Recording recording;
  io::LogReader reader(path);
  for (io::LogEvent event; reader.next(event);) {
    const std::string suffix = event.channel.substr(std::string(kPrefix).size());
    ++recording.counts[suffix];
    const int size = static_cast<int>(event.bytes.size());
    if (suffix == channels::kAck) {
      ack_t ack;
      if (ack.decode(event.bytes.data(), 0, size) == size) recording.account.add(ack);
    } else if (suffix == channels::kApplied) {
      applied_t entry;
      if (entry.decode(event.bytes.data(), 0, size) == size) recording.account.add(entry);
    } else if (suffix == channels::kForce) {
      freeflex_msgs::force_t force;
      if (force.decode(event.bytes.data(), 0, size) == size) ++recording.sent[force.sequence];
    }
  }
  recording.error = reader.error() + reader.damage();
  return recording;
}

/// Returns how many due states the client did not receive between its first and its last state.
std::int64_t num_missing_states(const BusClient& client) {
  constexpr std::int64_t kEvery = 20;  // [ticks] interval of the rotor's `publish: state`
  const std::int64_t first = client.states.begin()->first, last = client.states.rbegin()->first;
  std::int64_t num_missing = 0;
  for (std::int64_t tick = (first + kEvery - 1) / kEvery * kEvery; tick <= last; tick += kEvery)
    if (!client.states.contains(tick)) ++num_missing;
  return num_missing;
}

/// Prints ticks and wall time between the first and the last status of the running loop.
void report_ticks(const BusClient& client, const status_t& first, const status_t& last) {
  const double seconds = static_cast<double>(last.utime - first.utime) * 1e-6;
  const double elapsed = seconds * last.rate;
  const auto executed = static_cast<double>(last.tick - first.tick);
  std::printf("ticks executed %.0f, elapsed %.1f between two status messages; overruns %lld, slips %lld\n",
              executed, elapsed, static_cast<long long>(last.overruns), static_cast<long long>(last.slips));
  std::printf("%-28s %10s %10s %10s %10s\n", "[us]", "p50", "p99", "p99.9", "max");
  print_row("lateness, last window", four(last.lateness_us));
  print_row("compute, last window", four(last.compute_us));
  print_row("command to state", four(last.command_latency_us));
  std::array<double, 4> worst{};
  for (const status_t& status : client.statuses) {
    for (std::size_t i = 0; i < 4; ++i) worst[i] = std::max(worst[i], status.lateness_us[i]);
  }
  print_row("lateness, worst windows", worst);
  // a status is stamped up to a few periods of the publisher after its tick, so the numbers may differ by
  // some ticks
  if (last.slips == 0 && kSeconds >= 30) {
    EXPECT_NEAR(executed, elapsed, 50.0);
  }
}

/// Expects that `freeflex replay` reports the first missing entry of an incomplete recording.
void expect_loss_named(const std::string& log, const Recording& recording) {
  if (!recording.account.has_gap)
    return;  // either the lost messages are at the end of the recording, or a replay does not need them
  Process replay({program("freeflex"), "replay", log, "--prefix", kPrefix});
  EXPECT_EQ(replay.wait(), 3) << replay.output();
  const std::string named =
      "the APPLIED event with sequence " + std::to_string(recording.account.first_missing) + " is missing";
  EXPECT_NE(replay.output().find(named), std::string::npos) << named << ", not:\n" << replay.output();
}

/// Expects that the recording replays to the bit, and that the unmodified player sends all APPLIED entries.
void expect_replayable(const std::string& log, std::size_t num_applied) {
  Process replay({program("freeflex"), "replay", log, "--prefix", kPrefix});
  EXPECT_EQ(replay.wait(), 0) << replay.output();
  std::printf("%s", replay.output().c_str());
  BusClient listener(kPrefix, "239.255.76.68");
  Process player({"lcm-logplayer", "--speed=3", "--lcm-url=udpm://239.255.76.68:7667?ttl=0", log});
  EXPECT_TRUE(listener.until([&] { return listener.applied.size() >= num_applied; }))
      << listener.applied.size() << " of " << num_applied;
  EXPECT_EQ(player.wait(), 0);
}

/// Plays the recording into another daemon. The commands belong to another session, so each is rejected with
/// an answer. (`freeflex run --log` and `replay` do apply recorded commands.)
void expect_foreign_in_a_fresh_daemon(const std::string& log, std::size_t num_commands) {
  BusClient client(kPrefix);
  Process daemon({program("freeflexd"), scene_path("rotor.yaml"), "--prefix", kPrefix, "--time", "lockstep"});
  ASSERT_TRUE(client.meet()) << daemon.output();
  Process player({"lcm-logplayer", "--speed=3", "--regexp=" + std::string(kPrefix) + "_FORCE",
                  "--lcm-url=udpm://239.255.76.67:7667?ttl=0", log});
  const auto expected = static_cast<std::int64_t>(num_commands);
  EXPECT_TRUE(client.until([&] { return client.statuses.back().commands_received >= expected; }))
      << client.statuses.back().commands_received << " of " << expected;
  EXPECT_EQ(player.wait(), 0);
  EXPECT_TRUE(client.until([&] { return client.acks.size() >= num_commands; })) << client.acks.size();
  for (const ack_t& ack : client.acks) ASSERT_EQ(ack.reason, static_cast<int>(Reason::kWrongSession));
  EXPECT_EQ(client.statuses.back().commands_accepted, 0);
  EXPECT_EQ(client.statuses.back().commands_received, expected);
  client.next_sequence = 1'000'000;  // beyond the sequences in the recording
  EXPECT_EQ(client.answer(client.send_control(control_t::STEP, 50)).reason, 0);
  ASSERT_TRUE(client.until([&] { return client.states.contains(50); }));
  EXPECT_EQ(client.states.at(50).applied_count, 0);
  std::printf("played into a fresh daemon: %zu commands, %zu answered as of another session\n", num_commands,
              client.acks.size());
}

/// The build defines the name of this class, because ctest distinguishes tests only by name.
class FREEFLEX_LOAD_NAME : public ::testing::Test {
 protected:
  void SetUp() override {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "with a sanitizer a tick takes its whole period";
#endif
    if (!no_network.empty()) GTEST_SKIP() << no_network;
    log_ = std::filesystem::temp_directory_path() / ("freeflex-load-" + std::to_string(getpid()) + ".log");
  }
  void TearDown() override { std::filesystem::remove(log_); }
  std::filesystem::path log_;
};

/// Runs the daemon under the load, records it, and checks what the client received.
void run_load(BusClient& client, const std::string& log, Expected& expected) {
  Recorder recorder(kPrefix, log);
  Process daemon({program("freeflexd"), scene_path("rotor.yaml"), "--prefix", kPrefix});
  ASSERT_TRUE(client.meet()) << daemon.output();
  const status_t first = client.statuses.back();
  expected = send_load(client);
  ASSERT_TRUE(client.until([&] { return client.acks.size() >= expected.size(); }))
      << client.acks.size() << " answers to " << expected.size();
  // waits until the last slots have ended and a status includes their ends
  const std::int64_t end = client.states.rbegin()->first + 100;
  ASSERT_TRUE(client.until([&] { return client.statuses.back().tick > end; }));
  const status_t last = client.statuses.back();
  EXPECT_EQ(client.answer(client.send_control(control_t::STOP)).reason, 0);
  EXPECT_EQ(daemon.wait(), 0);
  ASSERT_TRUE(client.until([&] { return client.statuses.back().mode == status_t::STOPPED; }));
  EXPECT_EQ(recorder.stop(), "");

  report_ticks(client, first, last);
  if (kSeconds >= 30) {
    EXPECT_EQ(last.slips, 0);
  }
  Account heard;
  for (const ack_t& ack : client.acks) heard.add(ack);
  for (const applied_t& entry : client.applied) heard.add(entry);
  expect_complete(expected, heard, "client");
  EXPECT_EQ(client.num_early_states, 0) << "a state must arrive after the APPLIED entries that it includes";
  EXPECT_EQ(num_missing_states(client), client.statuses.back().states_dropped - first.states_dropped)
      << "every due state must be received or counted as dropped";
  EXPECT_EQ(last.commands_received, static_cast<std::int64_t>(expected.size()));
  std::int64_t num_rejected = 0;
  for (const auto& rejection : last.rejections) num_rejected += rejection.count;
  EXPECT_EQ(last.commands_accepted + num_rejected, static_cast<std::int64_t>(expected.size()));
  std::printf("commands: %zu sent, %zu answered, %zu applied, %lld rejected\n", expected.size(),
              heard.answers.size(), heard.applied.size(), static_cast<long long>(num_rejected));
}

/// Returns how many commands, answers and APPLIED messages the client received that are not in the log.
std::int64_t num_lost(const BusClient& client, const Recording& recording) {
  std::int64_t lost = 0;
  for (const char* channel : {channels::kForce, channels::kAck, channels::kApplied}) {
    const auto logged = recording.counts.find(channel);
    lost += client.num_messages.at(channel) - (logged == recording.counts.end() ? 0 : logged->second);
  }
  return lost;
}

TEST_F(FREEFLEX_LOAD_NAME, TheSenderTheAnswersTheAppliedMessagesAndTheLogAgree) {
  print_cyclictest("cyclictest before", kSeconds < 30 ? 2 : 10);
  // lcm-logger drops messages while the machine keeps it from running. `replay` must report such a recording
  // as incomplete, and the recording is repeated. The messages that the client receives must be complete in
  // each run.
  constexpr int kMostRecordings = 5;
  for (int i = 1; i <= kMostRecordings; ++i) {
    BusClient client(kPrefix);
    Expected expected;
    run_load(client, log_.string(), expected);
    if (HasFailure()) return;
    const Recording recording = read_recording(log_.string());
    EXPECT_EQ(recording.error, "");
    for (const auto& [suffix, count] : recording.counts) {
      std::printf("log: %6lld %s\n", static_cast<long long>(count), suffix.c_str());
    }
    if (const std::int64_t lost = num_lost(client, recording); lost > 0) {
      std::printf("lcm-logger lost %lld messages of recording %d\n", static_cast<long long>(lost), i);
      expect_loss_named(log_.string(), recording);
      ASSERT_LT(i, kMostRecordings) << "none of " << i << " recordings is complete";
      continue;
    }
    expect_complete(expected, recording.account, "lcm-logger");
    EXPECT_EQ(recording.sent.size(), expected.size());
    EXPECT_EQ(recording.account.next_applied, client.statuses.back().applied_count);
    print_cyclictest("cyclictest after", kSeconds < 30 ? 2 : 10);
    expect_replayable(log_.string(), client.applied.size());
    expect_foreign_in_a_fresh_daemon(log_.string(), expected.size());
    return;
  }
}

}  // namespace
}  // namespace freeflex::testing

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  freeflex::testing::no_network = freeflex::testing::enter_private_network();
  return RUN_ALL_TESTS();
}
