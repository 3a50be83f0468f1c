// The rung `coupled` conserves energy over a long time.
#include "tests/motion/rung_cases.hpp"

namespace freeflex::testing {
namespace {

TEST(RungsLong, TheCoupledRungKeepsTheEnergyOfAStiffTrussFor1e7Ticks) {
  expect_energy_kept(truss_s4(), 100'000, 100);
}

}  // namespace
}  // namespace freeflex::testing
