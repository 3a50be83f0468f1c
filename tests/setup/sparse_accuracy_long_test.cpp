// Accuracy of the sparse set-up on masts of up to 25,000 bays.
#include "tests/setup/mast_accuracy.hpp"

namespace freeflex::testing {
namespace {

// In bays, a mast bends as a beam whose first frequency goes with n^-2 but for shear and rotary inertia,
// which take a part of the order of n^-2 (Timoshenko 1921, Phil. Mag. 41, 744-746)
TEST(SparseAccuracyLong, MastsOfUpTo25000BaysAreThoseOfManyDigitsAndTendToABeam) {
  std::array<double, 3> scaled{};
  const std::array<int, 3> bays{250, 2500, 25000};
  for (std::size_t i = 0; i < bays.size(); ++i)
    scaled[i] = expect_accurate(bays[i] + 1, 20) * std::pow(bays[i] + 1.0, 2);
  const double first = scaled[2] - scaled[0], second = scaled[2] - scaled[1];
  std::printf("omega_1 n^2: %.9g %.9g %.9g, off by %.3e and %.3e\n", scaled[0], scaled[1], scaled[2], first,
              second);
  EXPECT_NEAR(first / second, 100.0, 10.0);
}

TEST(SparseAccuracyLong, StiffAndHeavyMastsOf10000PointsDoNotDependOnTheNumbering) {
  expect_same_of_any_numbering(2500);
}

// beyond some 10,000 points SCOTCH would order by threads, and by what it ordered before
TEST(SparseAccuracyLong, TheSameSceneHasTheSameModesToTheBit) {
  const Scene scene = mast(6000, 30);
  const Structure one = build(scene), two = build(scene);
  EXPECT_EQ((one.omega - two.omega).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_EQ((one.shapes - two.shapes).cwiseAbs().maxCoeff(), 0.0);
}

}  // namespace
}  // namespace freeflex::testing
