// These tests check the error estimate on scenes that were not used to choose the factor of the estimate.
#include "tests/tools/estimates_cases.hpp"

namespace freeflex::testing {
namespace {

// the factor of the estimate was chosen on the scenes of seed 1, so this test uses seed 2
TEST(EstimatesLong, CoverTheErrorOn200RandomScenes) {
  const auto rows = tools::study_estimates(2, 200, [](double) { return true; });
  const auto sum = print(rows);
  EXPECT_EQ(sum.num_failed, 0);
  EXPECT_GE(sum.inside_position, 0.95);
  EXPECT_GE(sum.inside_elastic, 0.95);
  EXPECT_GE(sum.lower_position, 0.92);
  EXPECT_GE(sum.lower_elastic, 0.92);
  EXPECT_GE(sum.close_position, 0.80);
  EXPECT_GE(sum.close_elastic, 0.80);
  const VerdictTally verdicts = tally_verdicts(rows);
  EXPECT_EQ(verdicts.false_good, 0);
  EXPECT_LE(verdicts.small_outside, 0.02 * verdicts.small);
  EXPECT_GE(verdicts.small_good, 0.8 * verdicts.small);
  EXPECT_GE(sum.outside, 0.15);
  EXPECT_GE(sum.auto_meets, 0.95);
  EXPECT_GE(sum.auto_cheapest, 0.80);
}

}  // namespace
}  // namespace freeflex::testing
