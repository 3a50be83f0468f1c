// These tests check that the operator can control the real freeflexd while strangers use the bus. Strangers
// can take all slots of the bus, but they cannot block controls or the operator, and they cannot keep a
// daemon from starting.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <filesystem>

#include "messages/channels.hpp"
#include "service/io/wire/operator_address.hpp"
#include "service/io/wire/reason.hpp"
#include "tests/service/daemon_fixture.hpp"
#include "tests/service/rig.hpp"

namespace freeflex::testing {
namespace {

using freeflex_msgs::control_t;
using freeflex_msgs::status_t;
using io::Reason;

/// Runs freeflex push over the socket. Returns the exit code, and stores what push printed in `output`.
int push(const std::string& socket, std::vector<std::string> arguments, std::string* output = nullptr) {
  arguments.insert(arguments.begin(), {program("freeflex"), "push", "--timeout", "60", "--socket", socket});
  Process process(arguments);
  const int status = process.wait();
  if (output != nullptr) *output = process.output();
  return status;
}

ForceCommand of(const std::string& sender, ForceCommand command) {
  command.sender.fill('\0');
  std::ranges::copy(sender, command.sender.begin());
  return command;
}

/// Sends from 64 invented senders. The first 48 of them take every slot and every queue entry of the bus.
void take_everything(BusClient& client) {
  constexpr int kWaiting = 4;  // waiting commands of each sender, in addition to a slot
  constexpr std::int64_t kLongest =
      60'000;  // [ticks] longest duration and longest wait that are allowed on the bus
  for (int i = 0; i < 64; ++i) {
    ForceCommand push = of("invented-" + std::to_string(i), make_push(1, 0, -1, 96, 1e-6));
    push.duration_ticks = kLongest;
    for (int num_taken = 0; num_taken < 1 + kWaiting; ++push.sequence) {
      ASSERT_LT(push.sequence, 1000) << i << " has " << num_taken;
      client.send(push);
      ASSERT_TRUE(client.until([&] {
        return !client.acks.empty() && client.acks.back().sequence == push.sequence &&
               client.acks.back().sender == push.sender.data();
      })) << i;
      // 48 x 4 commands fill the queue, so later senders find no room. One of the first 48 may also find the
      // queue full for a moment, and sends again.
      const bool is_full = client.acks.back().reason == static_cast<int>(Reason::kQueueFull);
      if (i >= 48) {
        ASSERT_TRUE(is_full) << i;
        break;
      }
      if (is_full) continue;
      ASSERT_EQ(client.acks.back().reason, 0) << i;
      push.start_tick = kLongest / 2;
      ++num_taken;
    }
  }
}

TEST_F(Daemon, StrangersCannotBlockControlsOrTheOperator) {
  const std::string socket = temporary_path("operator.sock");
  BusClient client("OP");
  // simulated time is slow, so that no slot ends before the end of the test
  Process daemon(command_line("OP", {"--socket", socket, "--time", "scaled=0.05"}));
  ASSERT_TRUE(client.meet()) << daemon.output();
  take_everything(client);
  // "test" is the sixty-fifth sender, so the forces of "test" are refused, but its controls are not
  client.send(make_push(client.next_sequence));
  EXPECT_EQ(client.answer(client.next_sequence++).reason, static_cast<int>(Reason::kTooManySenders));
  EXPECT_EQ(client.answer(client.send_control(control_t::HOLD)).reason, 0);
  EXPECT_EQ(client.answer(client.send_control(control_t::RUN)).reason, 0);
  client.send(of("invented-60", make_push(10)));
  ASSERT_TRUE(client.until([&] { return client.acks.back().sequence == 10; }));
  EXPECT_EQ(client.acks.back().reason, static_cast<int>(Reason::kQueueFull))
      << "the bus's queue entries are taken";
  // the operator has its own slots and queue entries
  std::string output;
  for (int slot = 0; slot < 16; ++slot) {
    EXPECT_EQ(
        push(socket,
             {"--point", "s24c0", "--force", "0,0,1", "--duration", "1000", "--slot", std::to_string(slot)},
             &output),
        0)
        << output;
  }
  EXPECT_EQ(push(socket, {"--point", "s24c0", "--force", "0,0,1", "--slot", "16"}, &output), 1);
  EXPECT_NE(output.find("(no_slot_free): all 16 slots that are open to this sender"), std::string::npos)
      << output;
  // the operator clears all senders on the bus, and their slots are free again
  ASSERT_EQ(push(socket, {"--clear-sender", "*"}, &output), 0) << output;
  ASSERT_TRUE(client.until([&] { return client.statuses.back().num_slots == 16; }))
      << "the operator's slots stay in force";
  const auto count = [&client](std::int32_t kind) {
    return std::ranges::count_if(client.applied, [kind](const auto& entry) { return entry.kind == kind; });
  };
  EXPECT_TRUE(client.until([&] { return count(freeflex_msgs::applied_t::CLEARED) >= 48; }));
  const auto num_cleared = [&client] {
    return std::ranges::count(client.acks, static_cast<int>(Reason::kCleared), &freeflex_msgs::ack_t::reason);
  };
  EXPECT_TRUE(client.until([&] { return num_cleared() >= 48 * 4; }))
      << "waiting commands must be answered again";
  for (int slot = 0; slot < 16; ++slot) {
    client.send(make_push(client.next_sequence, slot, -1, 96));
    EXPECT_EQ(client.answer(client.next_sequence++).reason, 0) << slot;
  }
  EXPECT_EQ(count(freeflex_msgs::applied_t::CLEARED), 48) << "no other slots are cleared";
  EXPECT_EQ(num_cleared(), 48 * 4);
  const std::int64_t epoch = client.statuses.back().epoch;
  EXPECT_EQ(push(socket, {"--control", "reset"}, &output), 0) << output;
  EXPECT_TRUE(client.until([&] { return client.statuses.back().epoch == epoch + 1; }));
  EXPECT_EQ(push(socket, {"--control", "stop"}, &output), 0) << output;
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_FALSE(std::filesystem::exists(socket));
}

TEST_F(Daemon, OnlyTheOperatorClearsASenderAndTheRecordingReplaysToTheBit) {
  const std::string socket = temporary_path("operator.sock");
  const std::string log = temporary_path("clear.log");
  const auto record = [&] {
    Recorder recorder("OC", log);
    BusClient client("OC");
    Process daemon(command_line("OC", {"--time", "lockstep", "--socket", socket}));
    EXPECT_TRUE(client.meet()) << daemon.output();
    const auto advance = [&](std::int64_t tick) {
      EXPECT_EQ(client.answer(client.send_control(control_t::STEP, 50)).reason, 0);
      EXPECT_TRUE(client.until([&] { return client.states.contains(tick); }));
    };
    client.send(make_push(client.next_sequence++, 0, -1, 96));
    client.send(make_push(client.next_sequence++, 1, -1, 97));
    client.send(make_push(client.next_sequence++, 2, 120, 98));
    EXPECT_EQ(client.answer(client.next_sequence - 1).reason, 0);
    advance(50);
    EXPECT_EQ(client.answer(client.send_control(control_t::CLEAR, 0, "test")).reason,
              static_cast<int>(Reason::kNotGranted))
        << "a sender on the bus must not clear, because then anybody could";
    std::string output;
    EXPECT_EQ(push(socket, {"--clear-sender", "test"}, &output), 0) << output;
    EXPECT_TRUE(
        client.until([&] { return client.acks.back().reason == static_cast<int>(Reason::kCleared); }));
    EXPECT_EQ(client.acks.back().sequence, 3);
    advance(100);
    advance(150);
    std::vector<std::array<std::int64_t, 4>> applied;
    for (const auto& entry : client.applied)
      applied.push_back({entry.tick, entry.kind, entry.command.slot, entry.command.sequence});
    using freeflex_msgs::applied_t;
    EXPECT_EQ(applied, (std::vector<std::array<std::int64_t, 4>>{{0, applied_t::FORCE, 0, 1},
                                                                 {0, applied_t::FORCE, 1, 2},
                                                                 {50, applied_t::CLEARED, 0, 1},
                                                                 {50, applied_t::CLEARED, 1, 2}}));
    EXPECT_EQ(push(socket, {"--control", "stop"}, &output), 0) << output;
    EXPECT_EQ(daemon.wait(), 0);
    EXPECT_EQ(recorder.stop(), "");
    Process replay({program("freeflex"), "replay", log, "--prefix", "OC"});
    const int status = replay.wait();
    unlink(log.c_str());
    return std::pair(status, replay.output());
  };
  auto [status, text] = record();
  for (int i = 0; i < 10 && status == kIncomplete; ++i) std::tie(status, text) = record();
  EXPECT_EQ(status, 0) << text;
  EXPECT_NE(text.find("identical to the bit over 150 ticks"), std::string::npos) << text;
}

TEST_F(Daemon, NamesOfTheOperatorAreRefusedOnTheBusAndOtherNamesOnTheSocket) {
  const std::string socket = temporary_path("operator.sock");
  BusClient client("ON");
  Process daemon(command_line("ON", {"--hold", "--socket", socket}));
  ASSERT_TRUE(client.meet()) << daemon.output();
  std::string output;
  EXPECT_EQ(push(socket, {"--control", "run", "--sender", "test"}, &output), 1);
  EXPECT_NE(output.find("(bad_sender): sender test must have a name on this socket that begins with local."),
            std::string::npos)
      << output;
  client.send(of("local.push", make_push(1)));
  ASSERT_TRUE(client.until([&] { return !client.acks.empty(); }));
  EXPECT_EQ(client.acks.back().reason, static_cast<int>(Reason::kBadSender));
  const std::int64_t seen = client.statuses.back().commands_received;
  EXPECT_EQ(push(socket, {"--control", "run"}, &output), 0) << output;
  EXPECT_TRUE(client.until([&] { return client.statuses.back().commands_received > seen; }));
  EXPECT_EQ(client.acks.size(), 1u) << "answers to the operator are not on the bus";
  EXPECT_TRUE(client.until([&] { return client.statuses.back().commands_accepted == 1; }));
}

TEST_F(Daemon, TheOperatorsSocketIsPrivateAndAStaleOneIsReplaced) {
  const std::string socket = temporary_path("operator.sock");
  BusClient client("OS");
  {
    Process daemon(command_line("OS", {"--socket", socket}));
    ASSERT_TRUE(client.meet()) << daemon.output();
    struct stat found {};
    ASSERT_EQ(stat(socket.c_str(), &found), 0);
    EXPECT_EQ(found.st_mode & 0777, 0600u);
    if (geteuid() == 0) {
      const pid_t stranger = fork();
      if (stranger == 0) {
        if (setuid(65534) != 0) _exit(2);
        const auto address = service::unix_address(socket);
        const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET, 0);
        _exit(connect(fd, reinterpret_cast<const sockaddr*>(&*address), sizeof *address) == 0 ? 1 : 0);
      }
      int status = 0;
      waitpid(stranger, &status, 0);
      EXPECT_EQ(WEXITSTATUS(status), 0) << "another user must not be able to connect";
    }
    Process second(command_line("OT", {"--socket", socket}));
    EXPECT_EQ(second.wait(), 1);
    EXPECT_NE(second.output().find("another program listens on " + socket), std::string::npos)
        << second.output();
    daemon.signal(SIGKILL);
    EXPECT_EQ(daemon.wait(), 1000 + SIGKILL);
  }
  ASSERT_TRUE(std::filesystem::exists(socket)) << "a killed daemon does not remove its socket";
  Process next(command_line("OT", {"--socket", socket}));
  BusClient other("OT");
  ASSERT_TRUE(other.meet()) << next.output();
  EXPECT_EQ(push(socket, {"--control", "stop"}), 0) << next.output();
  EXPECT_EQ(next.wait(), 0);
}

TEST_F(Daemon, WithoutASocketPathDaemonAndOperatorUseAPrivateFolder) {
  const std::string theirs = temporary_path("theirs");
  const std::string mine = temporary_path("mine");
  for (const std::string& folder : {theirs, mine}) {
    std::filesystem::create_directory(folder);
    std::filesystem::permissions(folder, std::filesystem::perms::owner_all);
  }
  std::filesystem::permissions(theirs, std::filesystem::perms::all);
  const auto push_hold = [](const std::string& folder, std::string& output) {
    Process process(by_shell("XDG_RUNTIME_DIR=" + folder, {program("freeflex"), "push", "--prefix", "OX",
                                                           "--socket", "--control", "hold"}));
    const int status = process.wait();
    output = process.output();
    return status;
  };
  for (const std::string& folder : {mine, theirs}) {
    BusClient client("OX");
    Process daemon(by_shell("XDG_RUNTIME_DIR=" + folder, command_line("OX")));
    ASSERT_TRUE(client.meet()) << daemon.output();
    const std::string socket = folder + "/freeflexd-OX.sock";
    EXPECT_EQ(std::filesystem::exists(socket), folder == mine) << daemon.output();
    std::string output;
    EXPECT_EQ(push_hold(folder, output), 0) << output;
    daemon.signal(SIGTERM);
    EXPECT_EQ(daemon.wait(), 0);
    EXPECT_FALSE(std::filesystem::exists(socket));
    EXPECT_EQ(push_hold(folder, output), 1) << output;
    EXPECT_NE(output.find("there is no daemon at "), std::string::npos) << output;
    std::filesystem::remove_all(folder);
  }
}

TEST_F(Daemon, WithTakeOverADaemonStartsDespiteAForeignStatus) {
  BusClient client("OQ");
  status_t invented{};
  invented.session = 1;  // older than any daemon's
  auto next = std::chrono::steady_clock::now();
  const auto until = [&](const std::function<bool()>& condition) {
    return client.until([&] {
      for (; std::chrono::steady_clock::now() >= next; next += std::chrono::milliseconds(20))
        client.packets.publish(std::string("OQ") + channels::kStatus, io::encode(invented));
      return condition();
    });
  };
  Process refused(command_line("OQ"));
  ASSERT_TRUE(until([&] { return refused.output().find("start with --take-over") != std::string::npos; }))
      << refused.output();
  EXPECT_EQ(refused.wait(), 1);
  Process daemon(command_line("OQ", {"--take-over"}));
  EXPECT_TRUE(until([&] {
    return !client.statuses.empty() && client.statuses.back().session != 1 &&
           client.statuses.back().mode == status_t::RUNNING;
  })) << daemon.output();
  EXPECT_NE(daemon.output().find("starts anyway, because of --take-over"), std::string::npos);
}

}  // namespace
}  // namespace freeflex::testing
