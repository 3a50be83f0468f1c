// When the publisher looks at its rings.
#include <gtest/gtest.h>

#include "service/publisher.hpp"

namespace freeflex::testing {
namespace {

using service::LookPace;

constexpr std::int64_t kIdle = 250;  // [ns]

/// Looks that end within this time, each of the cost and with something left behind.
int count_looks(std::int64_t cost, std::int64_t time) {
  LookPace pace(kIdle);
  std::int64_t now = pace.next(0, false);
  int num_looks = 0;
  for (; now <= time; ++num_looks) now = pace.next(now + cost, true);
  return num_looks;
}

TEST(LookPace, WhatALookCostsDoesNotComeOnTopOfTheIdleTime) {
  EXPECT_EQ(count_looks(0, 100 * kIdle), 100);
  EXPECT_EQ(count_looks(kIdle - 1, 100 * kIdle), 100);
  // one that costs more follows the one before at once
  EXPECT_EQ(count_looks(2 * kIdle, 100 * kIdle), 50);
}

TEST(LookPace, ALateWakeUpIsCaughtUpByNoBurst) {
  LookPace pace(kIdle);
  EXPECT_EQ(pace.next(1000, false), 1250);
  // woken 10,000 late
  EXPECT_EQ(pace.next(11'250, true), 11'250);
  EXPECT_EQ(pace.next(11'260, true), 11'500) << "the next is an idle time later";
}

TEST(LookPace, WithNothingLeftItRestsForAWholeIdleTime) {
  LookPace pace(kIdle);
  pace.next(0, true);
  EXPECT_EQ(pace.next(10, false), 10 + kIdle);
}

}  // namespace
}  // namespace freeflex::testing
