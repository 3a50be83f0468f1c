// These tests check the times at which the publisher checks its ring buffers.
#include <gtest/gtest.h>

#include "service/publisher.hpp"

namespace freeflex::testing {
namespace {

using service::LookPace;

constexpr std::int64_t kIdle = 250;  // [ns]

/// Returns how many checks end within `time` if each takes `cost` and the rings are never empty.
int count_looks(std::int64_t cost, std::int64_t time) {
  LookPace pace(kIdle);
  std::int64_t now = pace.next(0, false);
  int num_looks = 0;
  for (; now <= time; ++num_looks) now = pace.next(now + cost, true);
  return num_looks;
}

TEST(LookPace, TheDurationOfALookAtTheRingsIsNotAddedToTheIdleTime) {
  EXPECT_EQ(count_looks(0, 100 * kIdle), 100);
  EXPECT_EQ(count_looks(kIdle - 1, 100 * kIdle), 100);
  // checks that last longer than the idle time follow each other without a pause
  EXPECT_EQ(count_looks(2 * kIdle, 100 * kIdle), 50);
}

TEST(LookPace, ALateWakeUpIsNotFollowedByABurstOfLooksAtTheRings) {
  LookPace pace(kIdle);
  EXPECT_EQ(pace.next(1000, false), 1250);
  // woken 10,000 ns late
  EXPECT_EQ(pace.next(11'250, true), 11'250);
  EXPECT_EQ(pace.next(11'260, true), 11'500) << "the next look is one idle time after the late one";
}

TEST(LookPace, IfTheRingsAreEmptyWaitsForAFullIdleTime) {
  LookPace pace(kIdle);
  pace.next(0, true);
  EXPECT_EQ(pace.next(10, false), 10 + kIdle);
}

}  // namespace
}  // namespace freeflex::testing
