// Compares the error estimate with the full system on many scenes.
#include "tests/tools/estimates_cases.hpp"

namespace freeflex::testing {
namespace {

TEST(EstimatesLong, MeetTheErrorOn200RandomScenes) {
  const auto rows = tools::study_estimates(2, 200, [](double) { return true; });
  const auto sum = print(rows);
  EXPECT_EQ(sum.num_failed, 0);
  EXPECT_GE(sum.close_attitude, 0.95);
  EXPECT_GE(sum.close_elastic, 0.95);
  EXPECT_GE(sum.lower_attitude, 0.92);
  EXPECT_GE(sum.lower_elastic, 0.92);
  const VerdictTally verdicts = tally_verdicts(rows);
  EXPECT_EQ(verdicts.false_good, 0);
  EXPECT_LE(verdicts.small_outside, 0.02 * verdicts.small);
  EXPECT_GE(verdicts.small_good, 0.8 * verdicts.small);
  EXPECT_GE(sum.outside, 0.15);
  EXPECT_GE(sum.auto_meets, 0.98);
  EXPECT_GE(sum.auto_cheapest, 0.95);
}

}  // namespace
}  // namespace freeflex::testing
