// These tests change one byte of a recording, in many trials.
#include "tests/tools/damage_cases.hpp"

namespace freeflex::testing {
namespace {

TEST(DamageLong, EachOf20000FlippedBytesIsReportedOrHarmless) {
  const Tally tally = flip_bytes(20'000, 12);
  EXPECT_GT(tally.refused, 3'000);
  EXPECT_GT(tally.differs, 6'000);
}

}  // namespace
}  // namespace freeflex::testing
