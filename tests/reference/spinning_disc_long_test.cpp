// A spinning disc on the rung `corotational`, whose only stiffness comes from its spin.
#include <array>

#include "tests/reference/relative_equilibria.hpp"

namespace freeflex::testing {
namespace {

TEST(SpinningFrequencies, ADiscAgreesWithLambAndSouthwell) {
  constexpr double kNu = 0.3, kSpin = 1.0;
  constexpr std::array<int, 3> kRings{4, 5, 6};
  std::array<std::vector<double>, 3> found;
  for (std::size_t mesh = 0; mesh < 3; ++mesh) {
    const Scene scene = disc_of_plates(kRings[mesh], kNu);
    const RelativeEquilibrium motion = equilibrium_of(scene, {0.0, 0.0, kSpin});
    ASSERT_EQ(motion.error, "");
    for (const SmallMotion& small : motion.motions)
      if (small.rate.imag() > 1.1 * kSpin) found[mesh].push_back(small.rate.imag());
    if (mesh > 0) continue;
    const double worst = compare(scene, motion);
    std::printf("off the reference by %.1e\n", worst);
    EXPECT_LT(worst, kSame);
  }
  // 4e-4 were measured, half of it from the stretch of the disc due to its spin
  expect_lamb_and_southwell(kRings, found, kSpin, kNu, 1e-3);
}

}  // namespace
}  // namespace freeflex::testing
