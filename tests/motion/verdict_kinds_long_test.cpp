// These tests compare verdicts with the true error on forty random motions of each family of structures, and
// on forty of a second seed. The environment variables FREEFLEX_VERDICT_STRUCTURES and FREEFLEX_VERDICT_SEED
// set the number of structures in a family and the seed of the first one. With 300 structures:
//   FREEFLEX_VERDICT_STRUCTURES=300 build/release/tests/verdict_kinds_long_test
#include "tests/motion/verdict_kinds.hpp"

namespace freeflex::testing {
namespace {

unsigned number_from(const char* variable, unsigned otherwise) {
  const char* const given = std::getenv(variable);
  return given == nullptr ? otherwise : static_cast<unsigned>(std::strtoul(given, nullptr, 10));
}

class VerdictOnKindsLong : public ::testing::TestWithParam<Family> {};

void expect_correct(const Family& family, unsigned first_seed) {
  const KindCounts counts =
      judge_family(family, first_seed, static_cast<int>(number_from("FREEFLEX_VERDICT_STRUCTURES", 40)));
  EXPECT_GE(counts.close, 0.95 * counts.comparable);
  // corotational refuses scenes with the lowest modes alone, and dashpots that are too fast for its ticks.
  // Some of the random dashpots are
  const int with_few_modes = family.keeps_lowest_modes ? counts.all / 3 : 0;
  EXPECT_LE(counts.refused, with_few_modes + 0.02 * counts.all);
  EXPECT_LE(counts.too_fast, 0.1 * counts.all);
  EXPECT_LE(counts.stopped, 0.02 * counts.all);
}

TEST_P(VerdictOnKindsLong, IsCorrectForRandomMotions) {
  expect_correct(GetParam(), number_from("FREEFLEX_VERDICT_SEED", 1));
}
TEST_P(VerdictOnKindsLong, IsCorrectForRandomMotionsOfAnotherSeed) {
  expect_correct(GetParam(), number_from("FREEFLEX_VERDICT_SEED", 1) + 2'718'281);
}

INSTANTIATE_TEST_SUITE_P(All, VerdictOnKindsLong, ::testing::ValuesIn(all_families()),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace freeflex::testing
