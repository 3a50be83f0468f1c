// Signals that arrive at inconvenient moments end the process cleanly or are ignored. Each case runs in a
// process of its own.
#include "service/signals.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include "service/clock.hpp"

namespace freeflex::testing {
namespace {

using service::SignalWatch;
using ::testing::ExitedWithCode;

constexpr int kNotEnded = 9;

TEST(SignalsDeathTest, EndTheProcessAtOnceAndCleanlyDuringStartUp) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    EXPECT_EXIT(
        {
          const SignalWatch signals;
          raise(number);
          _exit(kNotEnded);
        },
        ExitedWithCode(0), "before the first tick");
  }
}

TEST(SignalsDeathTest, AreReceivedEvenIfTheParentIgnoredOrBlockedThem) {
  for (const int number : {SIGINT, SIGTERM}) {
    EXPECT_EXIT(
        {
          signal(number, SIG_IGN);
          sigset_t all;
          sigfillset(&all);
          pthread_sigmask(SIG_BLOCK, &all, nullptr);
          SignalWatch signals;
          signals.end_start_up();
          raise(number);
          _exit(signals.received() == number ? 0 : kNotEnded);
        },
        ExitedWithCode(0), "");
  }
}

TEST(SignalsDeathTest, SighupStaysIgnoredUnderNohup) {
  EXPECT_EXIT(
      {
        signal(SIGHUP, SIG_IGN);
        SignalWatch signals;
        signals.end_start_up();
        raise(SIGHUP);
        _exit(signals.received());
      },
      ExitedWithCode(0), "");
}

TEST(SignalsDeathTest, TheFirstSignalIsReportedAndSimultaneousOnesAreIgnored) {
  EXPECT_EXIT(
      {
        SignalWatch signals;
        signals.end_start_up();
        raise(SIGTERM);
        raise(SIGINT);
        raise(SIGHUP);
        _exit(signals.received() == SIGTERM ? 0 : kNotEnded);
      },
      ExitedWithCode(0), "");
}

TEST(SignalsDeathTest, EndTheProcessDuringStartUpEvenIfThePipeOfItsLogIsFull) {
  EXPECT_EXIT(
      {
        int ends[2];
        if (pipe2(ends, O_NONBLOCK) != 0) _exit(kNotEnded);
        while (write(ends[1], "", 1) == 1) {
        }
        fcntl(ends[1], F_SETFL, 0);
        dup2(ends[1], STDERR_FILENO);
        const SignalWatch signals;
        raise(SIGTERM);
        _exit(kNotEnded);
      },
      ExitedWithCode(0), "");
}

TEST(SignalsDeathTest, SignalsFromFailedWritesAreIgnored) {
  for (const int number : {SIGPIPE, SIGXFSZ, SIGTTOU}) {
    EXPECT_EXIT(
        {
          service::ignore_signals_of_writing();
          raise(number);
          _exit(0);
        },
        ExitedWithCode(0), "");
  }
}

TEST(SignalsDeathTest, ALaterSignalEndsAShutdownThatHangs) {
  EXPECT_EXIT(
      {
        SignalWatch signals;
        signals.end_start_up();
        service::MonotonicClock clock;
        const std::int64_t give_up_ns = clock.now_ns() + 10 * SignalWatch::kPatience;
        while (clock.now_ns() < give_up_ns) raise(SIGINT);
        _exit(kNotEnded);
      },
      ExitedWithCode(1), "");
}

}  // namespace
}  // namespace freeflex::testing
