#include "tests/motion/verdict_bodies.hpp"

namespace freeflex::testing {
namespace {

// Sixty more structures are in tests/motion/verdict_long_test.
TEST(VerdictOnBodies, IsNeverGoodIfTheMotionIsWrong) { expect_honest(1, 8); }

}  // namespace
}  // namespace freeflex::testing
