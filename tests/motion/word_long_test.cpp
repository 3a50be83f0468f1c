// The word beside the truth on three hundred random structures of every kind of link, and on as many of a
// second seed, on which nothing was set.
#include <gtest/gtest.h>

#include "tests/motion/word_bodies.hpp"

namespace freeflex::testing {
namespace {

TEST(WordLong, IsTrueOfThreeHundredRandomStructures) {
  WordCounts counts;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) judge_scene(seed, counts);
  expect_true_words(counts);
}

TEST(WordLong, IsTrueOfThreeHundredOthers) {
  WordCounts counts;
  for (std::uint64_t seed = 0; seed < 300; ++seed) judge_scene(27182818'000 + seed, counts);
  expect_true_words(counts);
}

TEST(WordLong, OfSixtyRandomStructuresWithBodiesIsNotGoodWhereItIsWrong) { expect_honest(201, 260); }

}  // namespace
}  // namespace freeflex::testing
