// Frequencies about steady motions on the rung `corotational`, by the linearised equations of the step and by
// the motion itself: in the plane of spin, chains, and plates under in-plane loads.
#include <array>

#include "tests/reference/relative_equilibria.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Vector3d;

// A kick along y, in the plane of the spin about z. Out of the plane see `relative_equilibrium_test`.
TEST(SpinningFrequencies, AKickInThePlaneOfSpinVibratesAtTheFrequenciesOfTheReference) {
  for (const double share : {0.05, 0.1, 0.5, 1.0}) {
    const Scene scene = beam_of(10, kAxial);
    const double spin = share * 22.3733;
    const RelativeEquilibrium found = equilibrium_of(scene, {0.0, 0.0, spin});
    double expected = 0.0, nearest = HUGE_VAL;
    const double measured = measured_frequency(scene, found, 1, 1.01 * spin, expected);
    for (const SmallMotion& small : found.motions)
      nearest = std::min(nearest, std::abs(small.rate.imag() - measured));
    std::printf(
        "spin %.2f: %.8f rad/s measured, %.8f of the reference (off by %.1e), linearised off by %.1e\n",
        share, measured, expected, measured / expected - 1.0, nearest / measured);
    EXPECT_LT(nearest, kSame * measured);
    EXPECT_NEAR(measured, expected, kSame * expected);
  }
}

// A spinning row of equal masses has a stiffness only by the tension. Its frequencies obey the difference
// form of Legendre's equation, which is exact for any number of masses on inextensible links.
TEST(SpinningFrequencies, AChainHasLegendreFrequencies) {
  constexpr double kSpin = 3.0;
  for (const bool has_bars : {false, true})
    for (const int num : {3, 6, 9}) {
      Scene scene;
      for (int i = 0; i < num; ++i) add_point(scene, 2.0, {0.5 * i, 0.0, 0.0});
      for (int i = 0; i + 1 < num; ++i)
        add_link(scene, i, i + 1, has_bars ? LinkKind(Bar{0.5e9}) : LinkKind(Spring{1e9}));
      const RelativeEquilibrium found = equilibrium_of(scene, {0.0, 0.0, kSpin});
      ASSERT_EQ(found.error, "");
      double worst = 0.0;
      for (int n = 2; n < num; ++n)
        for (const double square : {0.5 * n * (n + 1), 0.5 * n * (n + 1) - 1.0}) {
          const double exact = kSpin * std::sqrt(square);
          double nearest = HUGE_VAL;
          for (const SmallMotion& small : found.motions)
            nearest = std::min(nearest, std::abs(small.rate.imag() - exact) / exact);
          worst = std::max(worst, nearest);
        }
      std::printf("%s, %d masses: %zu motions, off by %.1e\n", has_bars ? "bars" : "springs", num,
                  found.motions.size(), worst);
      EXPECT_LT(worst, kSame);
      EXPECT_LT(compare(scene, found), kSame);
    }
}

// Returns the frequency of the first symmetric bending of a free beam of EI = m = L = 1 under end loads
// P along its axis, which keep their direction. With w = A cosh a x + B cos b x, the ends have neither a
// moment nor a transverse force w''' + P w', so b^3 tanh(a / 2) + a^3 tan(b / 2) = 0, with b^2 - a^2 = P and
// omega = a b.
double column_frequency(double P) {
  const auto condition = [&](double omega) {
    const double half = 0.5 * P, root = std::sqrt(half * half + omega * omega);
    const double a = std::sqrt(root - half), b = std::sqrt(root + half);
    return b * b * b * std::tanh(0.5 * a) * std::cos(0.5 * b) + a * a * a * std::sin(0.5 * b);
  };
  double low = 1.0;
  while (condition(low) * condition(low + 0.01) > 0.0 && low < 200.0) low += 0.01;
  double high = low + 0.01;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    (condition(low) * condition(middle) > 0.0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

// Opposite loads at the ends of a strip of plates keep their direction. P > 0 presses the ends together, so
// the strip tips, but its symmetric bending keeps its frequency.
TEST(SpinningFrequencies, AStripOfPlatesUnderEndLoadsVibratesLikeAColumn) {
  EXPECT_NEAR(column_frequency(0.0), 22.37328545, 1e-6);
  for (const double P : {5.0, -20.0, -100.0}) {
    const double exact = column_frequency(P);
    std::array<double, 3> error{};
    for (std::size_t k = 0; k < 3; ++k) {
      const int elements = 8 << k;
      Scene scene = strip_of_plates(elements, 2e-3);
      for (const int side : {0, 1}) {
        push(scene, side, Axes::kWorld, {0.5 * P, 0.0, 0.0});
        push(scene, 2 * elements + side, Axes::kWorld, {-0.5 * P, 0.0, 0.0});
      }
      const RelativeEquilibrium found = equilibrium_of(scene, Vector3d::Zero());
      ASSERT_EQ(found.error, "");
      double nearest = HUGE_VAL;
      for (const SmallMotion& small : found.motions)
        if (std::abs(small.rate.imag() - exact) < std::abs(nearest - exact)) nearest = small.rate.imag();
      error[k] = nearest / exact - 1.0;
      if (k == 0) {
        const double worst = compare(scene, found);
        EXPECT_LT(worst, kSame);
        std::printf("P %6.1f: reference off by %.1e, ", P, worst);
      }
    }
    const double limit = error[2] + (error[2] - error[1]) / 3.0;
    std::printf("exact %.5f, errors %.1e %.1e %.1e, order %.2f, limit %.1e\n", exact, error[0], error[1],
                error[2], std::log2(error[1] / error[2]), limit);
    EXPECT_NEAR(std::log2(error[1] / error[2]), 2.0, 0.2);
    EXPECT_LT(std::abs(limit), 2e-3);
  }
}

}  // namespace
}  // namespace freeflex::testing
