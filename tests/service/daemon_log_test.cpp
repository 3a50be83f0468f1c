// These tests check the log of the real freeflexd: no tick is lost if the log cannot be written, and nobody
// on the bus can flood the log.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <numeric>
#include <sstream>

#include "messages/channels.hpp"
#include "service/limited_log.hpp"
#include "tests/service/daemon_fixture.hpp"
#include "tests/support/send_signal.hpp"

namespace freeflex::testing {
namespace {

using freeflex_msgs::state_t;
using freeflex_msgs::status_t;
using service::LimitedLog;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

/// Makes a daemon write many log lines. The function sends a thousand STATUS messages a second, each of
/// another session. It kills the ingress after 200 ms, and then after pauses that grow by a tenth.
class Provoker {
 public:
  Provoker(BusClient& client, const Process& daemon, const std::string& prefix)
      : client_(client), daemon_(daemon), channel_(prefix + channels::kStatus) {}

  /// Provokes log lines until the condition is true. Returns false if the condition stays false for
  /// kPatience.
  bool until(const std::function<bool()>& condition) {
    return client_.until([&] {
      const auto now = steady_clock::now();
      if (now >= next_status_) {
        foreign_.session = ++num_sent_;
        client_.packets.publish(channel_, io::encode(foreign_));
        next_status_ = now + milliseconds(1);
      }
      if (now >= next_kill_) {
        send_signal(find_ingress(daemon_), SIGKILL);
        // the pauses grow, because beside other work an ingress that is built with a sanitizer starts slowly
        next_kill_ = now + kill_every_;
        kill_every_ += kill_every_ / 10;
      }
      return condition();
    });
  }
  std::int64_t num_sent() const { return num_sent_; }

 private:
  BusClient& client_;
  const Process& daemon_;
  std::string channel_;
  status_t foreign_{};
  std::int64_t num_sent_ = 0;
  steady_clock::time_point next_status_{};
  steady_clock::time_point next_kill_{};
  milliseconds kill_every_{200};
};

/// Returns the daemon's own latest status, or nullptr if there is none yet.
const status_t* own_status(const BusClient& client) {
  const auto is_own = [&](const status_t& status) { return status.session == client.session; };
  const auto latest = std::find_if(client.statuses.rbegin(), client.statuses.rend(), is_own);
  return latest == client.statuses.rend() ? nullptr : &*latest;
}

/// Describes where the daemon writes its log.
struct LogTarget {
  std::string set_up;   // shell commands before the daemon starts
  std::string streams;  // redirections of the daemon's streams
};

/// Runs the truss for 1.5 s, with or without provocation.
std::map<std::int64_t, state_t> run_with_log(const LogTarget& target, bool is_provoked, std::string& log) {
  const std::string what = target.set_up + " " + target.streams;
  BusClient client("H");
  Process daemon(
      by_shell(target.set_up, command_line("H", {"--log-level", "debug", "--until", "1.5"}), target.streams));
  EXPECT_TRUE(client.meet()) << what << daemon.output();
  const auto has_stopped = [&] {
    const status_t* status = own_status(client);
    return status != nullptr && status->mode == status_t::STOPPED;
  };
  Provoker provoker(client, daemon, "H");
  EXPECT_TRUE(is_provoked ? provoker.until(has_stopped) : client.until(has_stopped)) << what;
  EXPECT_EQ(daemon.wait(), 0) << what;
  if (has_stopped()) {
    EXPECT_EQ(own_status(client)->tick, 1500) << what;
    EXPECT_EQ(own_status(client)->ingress_restarts > 0, is_provoked) << what;
  }
  log = daemon.output();
  return client.states;
}

TEST_F(Daemon, RunsToItsEndWithUnchangedBitsIfItsLogFails) {
  std::string log;
  const auto peaceful = run_with_log({"", ""}, false, log);
  std::array<int, 2> broken{};
  ASSERT_EQ(pipe(broken.data()), 0);
  close(broken[0]);
  // the logs are, in this order: a file limited to 512 or 1024 bytes, /dev/full, which refuses every byte
  // like a full disk, closed streams, whose numbers 0, 1 and 2 the first sockets could get, and a pipe
  // without a reader
  const std::vector<LogTarget> targets{{"ulimit -f 1;", ""},
                                       {"", "2>/dev/full"},
                                       {"", "<&- >&- 2>&-"},
                                       {"", "2>&" + std::to_string(broken[1])}};
  for (const LogTarget& target : targets) {
    const auto provoked = run_with_log(target, true, log);
    if (!target.set_up.empty()) {
      EXPECT_TRUE(log.size() == 512 || log.size() == 1024) << "the log did not reach the limit: " << log;
    }
    int num_compared = 0;
    for (const auto& [tick, state] : provoked) {
      const auto same = peaceful.find(tick);
      if (same == peaceful.end()) continue;
      ++num_compared;
      ASSERT_EQ(motion(state), motion(same->second)) << target.set_up << target.streams << tick;
    }
    EXPECT_GE(num_compared, 10) << target.set_up << target.streams;
  }
  close(broken[1]);
}

TEST_F(Daemon, EndsEvenIfThePipeOfItsLogIsFull) {
#if defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the _exit of the thread sanitizer waits until standard error is written";
#endif
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  fcntl(ends[1], F_SETFL, O_NONBLOCK);
  const std::array<char, 4096> page{};
  while (write(ends[1], page.data(), page.size()) > 0) {
  }
  EXPECT_EQ(errno, EAGAIN);
  fcntl(ends[1], F_SETFL, 0);
  const std::string streams = "2>&" + std::to_string(ends[1]);
  Process daemon(by_shell("", command_line("N", {"--until", "0.2"}), streams));
  EXPECT_EQ(daemon.wait(), 0);
  Process refused(by_shell("", {program("freeflexd"), "nowhere.yaml"}, streams));
  EXPECT_EQ(refused.wait(), 2);
  close(ends[0]);
  close(ends[1]);
}

TEST_F(Daemon, ReturnsItsExitStatusIfItsLogCannotBeWritten) {
#if defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the thread sanitizer writes a file of its own before main()";
#endif
  for (const char* argument : {"--no-such-option", "nowhere.yaml"}) {
    Process daemon(by_shell("ulimit -f 0;", {program("freeflexd"), argument}));
    EXPECT_EQ(daemon.wait(), 2) << argument;
    EXPECT_EQ(daemon.output(), "");
  }
}

TEST_F(Daemon, RedirectsTheOutputOfItsIngressToDevNull) {
  BusClient client("V");
  Process daemon(command_line("V", {"--hold"}));
  ASSERT_TRUE(client.meet()) << daemon.output();
  const std::string descriptors = "/proc/" + std::to_string(find_ingress(daemon)) + "/fd/";
  for (const char* number : {"1", "2"})
    EXPECT_EQ(std::filesystem::read_symlink(descriptors + number), "/dev/null") << number;
}

/// The lines of a log that contain certain words: their times [ms since midnight], and the numbers of
/// suppressed lines that they report.
struct Repeated {
  std::vector<int> written_ms;
  std::vector<std::int64_t> counts;  // numbers of suppressed lines
};
Repeated find_lines(const std::string& log, const std::string& words) {
  Repeated found;
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line);) {
    int hours = 0, minutes = 0, seconds = 0, millis = 0;
    long long held = 0;
    if (line.find(words) == line.npos) continue;
    if (std::sscanf(line.c_str(), "%d:%d:%d.%d", &hours, &minutes, &seconds, &millis) != 4) continue;
    found.written_ms.push_back(((hours * 60 + minutes) * 60 + seconds) * 1000 + millis);
    if (const std::size_t at = line.find("... and "); at != line.npos)
      if (std::sscanf(line.c_str() + at, "... and %lld more", &held) == 1) found.counts.push_back(held);
  }
  return found;
}

void expect_ten_a_second(const std::vector<int>& written_ms, const std::string& words) {
  constexpr int kDay = 86'400'000;  // [ms]
  constexpr int kAlmostASecond =
      990;  // [ms] less than 1000, because the clock may be adjusted in the meantime
  for (std::size_t i = LimitedLog::kMost; i < written_ms.size(); ++i) {
    const int passed = (written_ms[i] - written_ms[i - LimitedLog::kMost] + kDay) % kDay;
    EXPECT_GE(passed, kAlmostASecond) << words << ", line " << i;
  }
}

TEST_F(Daemon, LimitsEachKindOfLogLineToTenASecondAndCountsTheOthers) {
  const std::string foreign = "another freeflexd";
  BusClient client("U");
  Process daemon(command_line("U"));
  ASSERT_TRUE(client.meet()) << daemon.output();
  Provoker provoker(client, daemon, "U");
  // the test waits for ten lines, the line with the count and nine more lines, and then for 200 ms in which
  // lines are suppressed
  ASSERT_TRUE(provoker.until([&] { return find_lines(daemon.output(), foreign).written_ms.size() >= 20; }));
  std::int64_t tick = own_status(client)->tick + 200;
  ASSERT_TRUE(provoker.until([&] { return own_status(client)->tick >= tick; }));
  // without further messages the count is written within a second, so no count is due at the end
  tick = own_status(client)->tick + 1500;
  ASSERT_TRUE(client.until([&] { return own_status(client)->tick >= tick; }));
  const std::size_t num_counts = find_lines(daemon.output(), foreign).counts.size();
  daemon.signal(SIGINT);
  EXPECT_EQ(daemon.wait(), 0);
  const Repeated lines = find_lines(daemon.output(), foreign);
  EXPECT_EQ(lines.counts.size(), num_counts) << daemon.output();
  expect_ten_a_second(lines.written_ms, foreign);
  expect_ten_a_second(find_lines(daemon.output(), "the ingress process").written_ms, "the ingress process");
  const std::int64_t num_held = std::accumulate(lines.counts.begin(), lines.counts.end(), std::int64_t{0});
  EXPECT_GT(num_held, 0) << daemon.output();
  std::printf("%lld messages: %zu lines, %lld held back\n", static_cast<long long>(provoker.num_sent()),
              lines.written_ms.size(), static_cast<long long>(num_held));
}

}  // namespace
}  // namespace freeflex::testing
