// These tests compare verdicts with the true error on three hundred random structures with links of every
// kind, and on three hundred of a second seed. No constant was tuned on the second seed.
#include <gtest/gtest.h>

#include "tests/motion/verdict_bodies.hpp"

namespace freeflex::testing {
namespace {

TEST(VerdictLong, IsCorrectForThreeHundredRandomStructures) {
  VerdictCounts counts;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) judge_scene(seed, counts);
  expect_true_verdicts(counts);
}

TEST(VerdictLong, IsCorrectForThreeHundredStructuresOfAnotherSeed) {
  VerdictCounts counts;
  for (std::uint64_t seed = 0; seed < 300; ++seed) judge_scene(27182818'000 + seed, counts);
  expect_true_verdicts(counts);
}

TEST(VerdictLong, IsNeverGoodIfTheMotionIsWrongOnSixtyStructuresWithBodies) { expect_honest(201, 260); }

}  // namespace
}  // namespace freeflex::testing
