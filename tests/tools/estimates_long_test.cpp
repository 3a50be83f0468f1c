// The claim on the error estimate, on the scenes that its factor was not set on.
#include "tests/tools/estimates_cases.hpp"

namespace freeflex::testing {
namespace {

// the factor of the estimate was set on seed 1
TEST(EstimatesLong, HoldOn200RandomScenes) {
  const auto rows = tools::study_estimates(2, 200, [](double) { return true; });
  const auto sum = print(rows);
  EXPECT_EQ(sum.num_failed, 0);
  EXPECT_GE(sum.inside_position, 0.95);
  EXPECT_GE(sum.inside_elastic, 0.95);
  EXPECT_GE(sum.lower_position, 0.92);
  EXPECT_GE(sum.lower_elastic, 0.92);
  EXPECT_GE(sum.close_position, 0.80);
  EXPECT_GE(sum.close_elastic, 0.80);
  const WordTally words = tally_words(rows);
  EXPECT_EQ(words.false_good, 0);
  EXPECT_LE(words.small_outside, 0.02 * words.small);
  EXPECT_GE(words.small_good, 0.8 * words.small);
  EXPECT_GE(sum.outside, 0.15);
  EXPECT_GE(sum.auto_meets, 0.95);
  EXPECT_GE(sum.auto_cheapest, 0.80);
}

}  // namespace
}  // namespace freeflex::testing
