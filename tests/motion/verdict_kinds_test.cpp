// These tests compare verdicts with the true error on a random motion of each family of structures, on four
// rungs. `verdict_kinds_long_test` has more of them.
#include "tests/motion/verdict_kinds.hpp"

namespace freeflex::testing {
namespace {

class VerdictOnKinds : public ::testing::TestWithParam<Family> {};

TEST_P(VerdictOnKinds, IsCorrectForARandomMotion) { judge_family(GetParam(), 1, 1); }

INSTANTIATE_TEST_SUITE_P(All, VerdictOnKinds, ::testing::ValuesIn(all_families()),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace freeflex::testing
