// Accuracy of the sparse set-up on masts of many bays: against the same mast in many digits, and against
// itself.
#include "tests/setup/mast_accuracy.hpp"

namespace freeflex::testing {
namespace {

TEST(SparseAccuracy, AMastOf250BaysIsThatOfManyDigits) { expect_accurate(251, 20); }

TEST(SparseAccuracy, AMastOf2500BaysIsThatOfManyDigits) { expect_accurate(2501, 4); }

TEST(SparseAccuracy, StiffAndHeavyMastsDoNotDependOnTheNumbering) { expect_same_of_any_numbering(300); }

}  // namespace
}  // namespace freeflex::testing
