// Accuracy of the sparse set-up on masts of up to 25,000 bays.
#include "tests/setup/mast_accuracy.hpp"

namespace freeflex::testing {
namespace {

// A mast of n bays bends like a beam. Its first frequency is proportional to n^-2, except that shear and
// rotary inertia reduce it by a fraction of order n^-2 (Timoshenko 1921, Phil. Mag. 41, 744-746).
TEST(SparseAccuracyLong, LongMastsMatchHighPrecisionAndConvergeToABeam) {
  std::array<double, 3> scaled{};
  const std::array<int, 3> bays{250, 2500, 25000};
  for (std::size_t i = 0; i < bays.size(); ++i)
    scaled[i] = expect_accurate(bays[i] + 1, 20) * std::pow(bays[i] + 1.0, 2);
  const double first = scaled[2] - scaled[0], second = scaled[2] - scaled[1];
  std::printf("omega_1 n^2: %.9g %.9g %.9g, off by %.3e and %.3e\n", scaled[0], scaled[1], scaled[2], first,
              second);
  EXPECT_NEAR(first / second, 100.0, 10.0);
}

TEST(SparseAccuracyLong, FrequenciesOfMastsOf10000PointsDoNotDependOnTheNumbering) {
  expect_same_of_any_numbering(2500);
}

// Above some 10,000 points SCOTCH could use threads, and its ordering would depend on previous orderings.
TEST(SparseAccuracyLong, RepeatedSetUpGivesTheSameModesToTheBit) {
  const Scene scene = mast(6000, 30);
  const Structure one = build(scene), two = build(scene);
  EXPECT_EQ((one.omega - two.omega).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_EQ((one.shapes - two.shapes).cwiseAbs().maxCoeff(), 0.0);
}

}  // namespace
}  // namespace freeflex::testing
