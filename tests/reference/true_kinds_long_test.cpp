// The table of errors of the rung `corotational` on every kind of link, body and load, over five random
// structures a kind. See `true_kinds_test.cpp`.
#include <gtest/gtest.h>

#include "tests/reference/kinds.hpp"

namespace freeflex::testing {
namespace {

TEST(TrueKinds, EveryKindOverFiveStructures) {
  for (const Kind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name);
    std::vector<KindErrors> all;
    for (unsigned seed = 1; seed <= 5; ++seed) {
      all.push_back(errors_of(kind, seed));
      check(kind, all.back());
    }
    print_row(kind, all);
  }
}

}  // namespace
}  // namespace freeflex::testing
