// Accuracy of the sparse set-up on masts of many bays, compared with a solution in many digits and with
// another numbering of the same mast.
#include "tests/setup/mast_accuracy.hpp"

namespace freeflex::testing {
namespace {

TEST(SparseAccuracy, FrequenciesOfAMastOf250BaysMatchAHighPrecisionSolution) { expect_accurate(251, 20); }

TEST(SparseAccuracy, FrequenciesOfAMastOf2500BaysMatchAHighPrecisionSolution) { expect_accurate(2501, 4); }

TEST(SparseAccuracy, FrequenciesOfStiffAndHeavyMastsDoNotDependOnTheNumbering) {
  expect_same_of_any_numbering(300);
}

}  // namespace
}  // namespace freeflex::testing
