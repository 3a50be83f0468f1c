// These tests compare beams of the true-geometry reference with published figures and closed forms.
#include <array>
#include <cmath>
#include <complex>

#include "tests/reference/hermite_beam.hpp"
#include "tests/reference/true_geometry.hpp"

namespace freeflex::testing {
namespace {

// Returns the first two bending frequencies of a free beam under an end thrust that follows the beam.
std::array<double, 2> rocket(int elements, double thrust) {
  Scene scene = beam_of(elements, kAxial);
  push(scene, 0, Axes::kLocal, {thrust, 0.0, 0.0});
  const SteadyMotion motion = steady_motion_of(scene);
  EXPECT_NEAR(motion.acceleration.x(), thrust, 1e-9 * std::max(thrust, 1.0));
  std::vector<double> found;  // each frequency occurs in both planes
  for (const auto& rate : motion.rates)
    if (rate.imag() > 5.0) found.push_back(rate.imag());
  std::sort(found.begin(), found.end());
  EXPECT_NEAR(found[0], found[1], 1e-5 * found[0]);
  return {found[0], found[2]};
}

// The model is that of Beal (1965, AIAA J. 3, 486-494). The expected frequencies come from 60 Hermite
// elements with consistent mass.
TEST(TrueBeam, RocketConvergesToTheContinuousBeam) {
  constexpr double table[][3] = {
      {0.0, 22.3733, 61.6728}, {20.0, 19.5294, 57.7753}, {100.0, 13.9483, 34.0619}};
  for (const auto& [thrust, first, second] : table) {
    const auto coarse = rocket(20, thrust), fine = rocket(40, thrust);
    for (std::size_t k = 0; k < 2; ++k) {
      const double expected = k == 0 ? first : second;
      const double limit = fine[k] + (fine[k] - coarse[k]) / 3.0;
      const double order = std::log2((coarse[k] - expected) / (fine[k] - expected));
      std::printf("T %5.1f omega_%zu: %.4f %.4f, limit %.4f for %.4f, order %.2f\n", thrust, k + 1, coarse[k],
                  fine[k], limit, expected, order);
      EXPECT_NEAR(limit, expected, 3e-4 * expected);
      EXPECT_NEAR(order, 2.0, 0.2);
    }
  }
}

Eigen::VectorXd lumped_masses(int elements) {
  Eigen::VectorXd mass = Eigen::VectorXd::Constant(elements + 1, 1.0 / elements);
  mass[0] = mass[elements] = 0.5 / elements;
  return mass;
}

TEST(HermiteBeam, ReproducesTheTableOfTheContinuousRocket) {
  constexpr double table[][3] = {{0.0, 22.3733, 61.6728},
                                 {20.0, 19.5294, 57.7753},
                                 {100.0, 13.9483, 34.0619},
                                 {109.5, 21.6181, 24.5579}};
  constexpr int kElements = 60;
  const Eigen::VectorXd mass = Eigen::VectorXd::Constant(kElements + 1, 1.0 / kElements);
  for (const auto& [thrust, first, second] : table) {
    const auto squares = squared_frequencies(hermite_rocket(1.0, 1.0 / kElements, mass, thrust, true));
    // the tolerance is one unit of the last digit, except near flutter, where the error of a frequency is
    // proportional to the square root of the mesh error
    const double tolerance = thrust > 109.0 ? 5e-4 : 1e-4;
    EXPECT_NEAR(std::sqrt(squares[2]).real(), first, tolerance);
    EXPECT_NEAR(std::sqrt(squares[3]).real(), second, tolerance);
  }
}

// Sum and product of two squared frequencies. The sum and the product are smooth functions of the thrust even
// where the frequencies merge.
struct Pair {
  double sum = 0.0, product = 0.0;
  /// Returns the square of half the difference, which is negative in flutter.
  double split() const { return 0.25 * sum * sum - product; }
};

Pair pair_of(const SteadyMotion& motion) {
  // each frequency gives four of the rates, because it occurs in two planes and with two signs
  constexpr int kRates = 8;
  std::complex<double> sum = 0.0, squares = 0.0;
  int count = 0;
  for (const std::complex<double> rate : motion.rates) {
    if (std::abs(rate) < 5.0 || count == kRates) continue;
    ++count;
    sum += -rate * rate / 4.0;
    squares += rate * rate * rate * rate / 4.0;
  }
  EXPECT_EQ(count, kRates);
  return {sum.real(), 0.5 * (sum * sum - squares).real()};
}

Pair rocket_pair(int elements, double thrust, double EA) {
  Scene scene = beam_of(elements, EA);
  push(scene, 0, Axes::kLocal, {thrust, 0.0, 0.0});
  return pair_of(steady_motion_of(scene));
}

Pair discrete_pair(int elements, double thrust) {
  const auto squares =
      squared_frequencies(hermite_rocket(1.0, 1.0 / elements, lumped_masses(elements), thrust, false));
  return {(squares[2] + squares[3]).real(), (squares[2] * squares[3]).real()};
}

// At the thrust 109.5 the beam of 40 lumped elements already flutters, but the continuous beam does not.
TEST(TrueBeam, ARocketMatchesLumpedHermiteElementsBelowAndBeyondFlutter) {
  for (const double thrust : {100.0, 109.0, 109.5, 110.0}) {
    const Pair found = rocket_pair(40, thrust, kAxial), expected = discrete_pair(40, thrust);
    std::printf("T %5.1f: sum %.3f for %.3f, product %.1f for %.1f, split %.1f for %.1f\n", thrust, found.sum,
                expected.sum, found.product, expected.product, found.split(), expected.split());
    // The beam of the reference can change its length, and the thrust shortens the beam by a fraction of at
    // most thrust / EA. Squared frequencies change with at most the fourth power of the length, and the
    // product of two of them with the eighth.
    const double stretch = thrust / kAxial;
    EXPECT_NEAR(found.sum, expected.sum, 4.0 * stretch * expected.sum);
    EXPECT_NEAR(found.product, expected.product, 8.0 * stretch * expected.product);
  }
}

// Beal (1965) gives the critical thrust 109.9, but 60 Hermite elements with consistent mass give 109.7.
TEST(TrueBeam, RocketFluttersAtItsCriticalThrust) {
  constexpr int kElements = 60;
  const Eigen::VectorXd mass = Eigen::VectorXd::Constant(kElements + 1, 1.0 / kElements);
  const double continuous = secant_root(108.0, 110.0, [&](double thrust) {
    const auto squares = squared_frequencies(hermite_rocket(1.0, 1.0 / kElements, mass, thrust, true));
    return 0.25 * ((squares[2] - squares[3]) * (squares[2] - squares[3])).real();
  });
  std::array<double, 2> found{};
  for (std::size_t k = 0; k < 2; ++k)
    found[k] = secant_root(
        108.0, 110.0, [&](double thrust) { return rocket_pair(k == 0 ? 20 : 40, thrust, kAxial).split(); });
  const double limit = found[1] + (found[1] - found[0]) / 3.0;
  std::printf("critical thrust %.4f %.4f, limit %.4f for %.4f\n", found[0], found[1], limit, continuous);
  EXPECT_NEAR(continuous, 109.7, 0.05);
  EXPECT_NEAR(limit, continuous, 3e-4 * continuous);
}

TEST(TrueBeam, SpinningBeamConvergesToTheContinuousBeam) {
  constexpr double kFirst = 22.3733;
  constexpr double table[][4] = {{0.05, 1.003805, 2.759439, 5.406541},
                                 {0.1, 1.015134, 2.768118, 5.414389},
                                 {0.5, 1.327300, 3.032316, 5.659362},
                                 {1.0, 2.010022, 3.735482, 6.359921}};
  for (const auto& row : table) {
    const double spin = row[0] * kFirst;
    std::array<std::vector<double>, 2> across, within;
    for (std::size_t k = 0; k < 2; ++k) {
      Scene scene = beam_of(k == 0 ? 20 : 40, kAxial);
      scene.initial.angular_velocity = {0.0, 0.0, spin};
      const SteadyMotion motion = steady_motion_of(scene);
      across[k] = frequencies_along(motion, 2, 1.01 * spin);
      within[k] = frequencies_along(motion, 1, 1e-2 * kFirst);
    }
    for (std::size_t mode = 0; mode < 3; ++mode) {
      const double expected = row[mode + 1] * kFirst;
      const double limit = across[1][mode] + (across[1][mode] - across[0][mode]) / 3.0;
      const double in_plane = std::sqrt(expected * expected - spin * spin);
      const double in_plane_limit = within[1][mode] + (within[1][mode] - within[0][mode]) / 3.0;
      std::printf("Omega %.2f mode %zu: %.6f for %.6f, in the plane off by %.1e\n", row[0], mode + 1,
                  limit / kFirst, row[mode + 1], in_plane_limit / in_plane - 1.0);
      EXPECT_NEAR(limit, expected, 5e-4 * expected);
      EXPECT_NEAR(in_plane_limit, in_plane, 1e-3 * in_plane);
    }
  }
}

// Returns 11 points of 1 kg on 10 equal beams of 1 m, EI 2200 N m^2, EA 1e7 N.
Scene frame_of_eleven() {
  Scene scene;
  for (int i = 0; i < 11; ++i) add_point(scene, 1.0, {static_cast<double>(i), 0.0, 0.0});
  for (int i = 0; i < 10; ++i) add_link(scene, i, i + 1, Beam{1e7, 2200.0, 2200.0, 2200.0, {0.0, 1.0, 0.0}});
  return scene;
}

// Hermite elements under the same tension give the same frequencies. The masses at the ends are not halved.
TEST(TrueBeam, ABeamOfElevenPointsReproducesItsTable) {
  constexpr double kEI = 2200.0;
  const Eigen::VectorXd mass = Eigen::VectorXd::Ones(11);
  const auto lowest = [](const HermiteBeam& beam, std::size_t first) {
    return std::sqrt(squared_frequencies(beam)[first]).real();
  };
  // The expected frequencies have four decimals. Hermite elements do not stretch, but the beam of the
  // reference does. Squared frequencies change with at most the fourth power of the length.
  constexpr double kTolerance = 1e-4, kEA = 1e7;
  const auto expect_near = [&](double found, double expected, double discrete, double tension) {
    EXPECT_NEAR(found, expected, kTolerance);
    EXPECT_NEAR(found, discrete, (1e-6 + 2.0 * tension / kEA) * discrete);
  };
  const double first = rest_modes(true_geometry_of(frame_of_eleven())).omega[0];
  std::printf("at rest %.4f\n", first);
  expect_near(first, 8.7853, lowest(hermite_spinner(kEI, 1.0, mass, 0.0), 2), 0.0);
  constexpr double spins[][2] = {{0.06, 8.8340}, {0.11, 8.9477}, {0.34, 10.2314}};
  for (const auto& [share, expected] : spins) {
    const double spin = share * first;
    Scene scene = frame_of_eleven();
    scene.initial.angular_velocity = {0.0, 0.0, spin};
    const double found = frequencies_along(steady_motion_of(scene), 2, 1.01 * spin)[0];
    const double discrete = lowest(hermite_spinner(kEI, 1.0, mass, spin), 2);
    std::printf("spin %.2f: %.5f for %.4f, Hermite elements %.5f\n", share, found, expected, discrete);
    expect_near(found, expected, discrete, hermite_spinner(kEI, 1.0, mass, spin).tension.maxCoeff());
  }
  constexpr double thrusts[][2] = {{20.0, 7.4125}, {60.0, 4.6108}};
  for (const auto& [thrust, expected] : thrusts) {
    const double force = thrust * kEI / 100.0;
    Scene scene = frame_of_eleven();
    push(scene, 0, Axes::kLocal, {force, 0.0, 0.0});
    const SteadyMotion motion = steady_motion_of(scene);
    double found = 1e9;
    for (const auto& rate : motion.rates)
      if (rate.imag() > 1.0) found = std::min(found, rate.imag());
    const double discrete = lowest(hermite_rocket(kEI, 1.0, mass, force, false), 2);
    std::printf("thrust %.0f: %.5f for %.4f, Hermite elements %.5f\n", thrust, found, expected, discrete);
    expect_near(found, expected, discrete, force);
  }
}

// Checks a row of equal masses that spins. The frequencies obey the difference form of Legendre's equation,
// which is exact for any number of masses.
void check_chain(const Scene& scene, double spin, double tolerance) {
  const SteadyMotion motion = steady_motion_of(scene);
  const std::vector<double> across = frequencies_along(motion, 2, 1.2 * spin);
  const std::vector<double> within = frequencies_along(motion, 1, 0.2 * spin);
  for (std::size_t k = 0; k + 2 < scene.points.size(); ++k) {
    const double n = static_cast<double>(k) + 2.0;
    const double out = spin * std::sqrt(n * (n + 1.0) / 2.0),
                 in = spin * std::sqrt(n * (n + 1.0) / 2.0 - 1.0);
    std::printf("n %.0f: out of plane off by %.1e, in plane by %.1e\n", n, across[k] / out - 1.0,
                within[k] / in - 1.0);
    EXPECT_NEAR(across[k], out, tolerance * out);
    EXPECT_NEAR(within[k], in, tolerance * in);
  }
}

TEST(TrueChain, ASpinningChainOfSpringsHasLegendreFrequencies) {
  Scene scene;
  for (int i = 0; i < 6; ++i) add_point(scene, 2.0, {0.5 * i, 0.0, 0.0});
  for (int i = 0; i < 5; ++i) add_link(scene, i, i + 1, Spring{1e9});
  scene.initial.angular_velocity = {0.0, 0.0, 3.0};
  check_chain(scene, 3.0, 1e-6);
}

TEST(TrueChain, ASpinningChainOfRigidLinksHasLegendreFrequencies) {
  Scene scene;
  for (int i = 0; i < 6; ++i) add_point(scene, 2.0, {0.5 * i, 0.0, 0.0});
  for (int i = 0; i < 5; ++i) add_link(scene, i, i + 1, Rigid{});
  scene.initial.angular_velocity = {0.0, 0.0, 3.0};
  check_chain(scene, 3.0, 1e-7);
}

}  // namespace
}  // namespace freeflex::testing
