// A spinning disc on the rung `corotational`, whose only stiffness comes from its spin.
#include <array>

#include "tests/reference/relative_equilibria.hpp"

namespace freeflex::testing {
namespace {

// Lamb and Southwell (1921, Proc. R. Soc. A 99, 272-280), as in `true_geometry_long_test`: with s nodal
// circles, n nodal diameters and k = n + 2 s, 8 omega^2 / Omega^2 = (3 + nu) k (k + 2) - (1 + 3 nu) n^2.
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
  const auto expected = [](int n, int s) {
    const double k = n + 2.0 * s;
    return kSpin * std::sqrt(((3.0 + kNu) * k * (k + 2.0) - (1.0 + 3.0 * kNu) * n * n) / 8.0);
  };
  // the errors are of order h^2 and h^4, which the extrapolation from three meshes eliminates
  std::array<double, 3> weight{1.0, 1.0, 1.0};
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t other = 0; other < 3; ++other)
      if (other != k) {
        const double here = std::pow(kRings[k], 2), there = std::pow(kRings[other], 2);
        weight[k] *= here / (here - there);
      }
  // the modes of two nodal diameters are a pair; the mesh, which has six sectors, splits those of three
  const std::pair<std::size_t, double> modes[] = {
      {0, expected(2, 0)}, {2, expected(0, 1)}, {3, expected(3, 0)}};
  for (const auto& [index, frequency] : modes) {
    double limit = 0.0;
    for (std::size_t k = 0; k < 3; ++k) limit += weight[k] * found[k][index];
    std::printf("%.5f %.5f %.5f, limit %.5f for %.5f, off by %.1e\n", found[0][index], found[1][index],
                found[2][index], limit, frequency, limit / frequency - 1.0);
    // 4e-4 were measured, half of it from the stretch of the disc due to its spin
    EXPECT_NEAR(limit, frequency, 1e-3 * frequency);
  }
}

}  // namespace
}  // namespace freeflex::testing
