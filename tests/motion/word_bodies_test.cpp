#include "tests/motion/word_bodies.hpp"

namespace freeflex::testing {
namespace {

// sixty more in tests/motion/word_long_test
TEST(WordOnBodies, IsNotGoodWhereItIsWrong) { expect_honest(1, 8); }

}  // namespace
}  // namespace freeflex::testing
