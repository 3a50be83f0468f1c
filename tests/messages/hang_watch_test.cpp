// A process that hangs is reported, but a process that only waits for the processor or a disk is not
// reported.
#include "service/hang_watch.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <thread>

#include "tests/support/send_signal.hpp"

namespace freeflex::testing {
namespace {

using service::HangWatch;
using service::ProcessReading;
using std::chrono::milliseconds;

constexpr std::int64_t kMilli = 1'000'000;  // [ns]

/// Runs a HangWatch that checks the process every 2 ms of simulated time.
struct Watched {
  Watched() { watch.start(0); }
  /// Lets `millis` [ms] pass without a beat. Returns the report, or "" if there is none.
  std::string silent(int millis, const std::function<ProcessReading()>& read) {
    for (int i = 0; i < millis; i += 2) {
      now_ns += 2 * kMilli;
      if (std::string hang = watch.look(now_ns, beat, read); !hang.empty()) return hang;
    }
    return {};
  }
  HangWatch watch;
  std::int64_t now_ns = 0;
  std::uint64_t beat = 1;
};

TEST(HangWatch, AProcessWithAHeartbeatIsNeverExamined) {
  Watched process;
  for (int i = 0; i < 1000; ++i) {
    ++process.beat;
    EXPECT_EQ(process.silent(40, [] { return ADD_FAILURE(), ProcessReading{}; }), "");
  }
}

TEST(HangWatch, AProcessWithoutProcessorTimeIsNotReportedAsHung) {
  Watched process;
  std::int64_t cpu_ns = 0;
  // the process is ready to run but gets no processor time for 10 s, and then 15 ms of processor time every
  // 400 ms, which is less than an endless loop would use
  EXPECT_EQ(process.silent(10'000, [] { return ProcessReading{'R', 0}; }), "");
  for (int i = 0; i < 50; ++i) {
    cpu_ns += 15 * kMilli;
    EXPECT_EQ(process.silent(400, [&] { return ProcessReading{'R', cpu_ns}; }), "");
    ++process.beat;
  }
}

TEST(HangWatch, AProcessThatWaitsForADiskIsNotReportedAsHung) {
  Watched process;
  EXPECT_EQ(process.silent(10'000, [] { return ProcessReading{'D', 0}; }), "");
}

TEST(HangWatch, TimeInWhichTheWatchDidNotRunIsNotCounted) {
  Watched process;
  for (int i = 0; i < 9; ++i) {
    process.now_ns +=
        3'600'000 * kMilli;  // an hour during which the daemon was stopped or the machine was suspended
    EXPECT_EQ(process.watch.look(process.now_ns, process.beat, [] { return ProcessReading{'T', 0}; }), "");
  }
}

TEST(HangWatch, TheFirstHeartbeatMayTakeLongerThanLaterOnes) {
  Watched process;
  process.beat = 0;
  std::int64_t cpu_ns = 0;
  EXPECT_EQ(process.silent(1000, [&] { return ProcessReading{'R', cpu_ns += 2 * kMilli}; }), "");
  EXPECT_EQ(process.silent(2000,
                           [&] {
                             return ProcessReading{'R', cpu_ns += 2 * kMilli};
                           }),
            "was in an endless loop");
}

/// Returns the report on a real process that calls the function and never beats.
std::string watch_child(void (*does)()) {
  const pid_t child = fork();
  if (child == 0) {
    does();
    _exit(0);
  }
  HangWatch watch;
  const auto now_ns = [] { return std::chrono::steady_clock::now().time_since_epoch().count(); };
  watch.start(now_ns());
  std::string hang;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (hang.empty() && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(milliseconds(2));
    hang = watch.look(now_ns(), 1, [child] { return service::read_process(child); });
  }
  EXPECT_TRUE(send_signal(child, SIGKILL));
  waitpid(child, nullptr, 0);
  return hang;
}

TEST(HangWatch, ReportsWhyARealProcessHangs) {
  EXPECT_EQ(watch_child([] { raise(SIGSTOP); }), "was stopped");
  EXPECT_EQ(watch_child([] {
              for (std::atomic<int> i{0};;) i.fetch_add(1);
            }),
            "was in an endless loop");
  EXPECT_EQ(watch_child([] { pause(); }), "slept and did not wake");
}

}  // namespace
}  // namespace freeflex::testing
