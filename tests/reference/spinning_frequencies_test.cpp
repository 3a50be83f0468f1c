// Frequencies about steady motions on the rung `corotational`, by the linearised equations of the step and by
// the motion itself: in the plane of spin, chains, and plates under in-plane loads.
#include <array>

#include "tests/reference/relative_equilibria.hpp"
#include "tests/reference/structures.hpp"
#include "tests/support/mixed_structures.hpp"

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

// Expects that the rung vibrates at rest with the frequencies of the modes [rad/s].
void expect_frequencies(const Scene& scene, const Eigen::VectorXd& omega, const char* name) {
  const RelativeEquilibrium found = equilibrium_of(scene, Vector3d::Zero());
  std::vector<double> rates;
  for (const SmallMotion& small : found.motions) rates.push_back(small.rate.imag());
  std::sort(rates.begin(), rates.end());
  ASSERT_EQ(rates.size(), static_cast<std::size_t>(omega.size())) << name;
  double worst = 0.0;
  for (std::size_t k = 0; k < rates.size(); ++k)
    worst = std::max(worst, std::abs(rates[k] / omega[static_cast<Eigen::Index>(k)] - 1.0));
  std::printf("%s: off by %.1e\n", name, worst);
  // 3e-10 was measured
  EXPECT_LT(worst, 1e-8) << name;
}

// Links of every kind, some of which end on a rigid body of three point masses. If the plates ignored the
// rotation of the body, frequencies would be up to 4 % off.
TEST(SmallMotions, LinksOnRigidBodiesHaveTheFrequenciesOfTheReference) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Scene scene = random_mixture(seed, 8);
    if (scene.links.back().points.size() < 3) continue;
    expect_frequencies(scene, rest_modes(true_geometry_of(scene)).omega, scene.name.c_str());
  }
}

// Two superelements, made of a beam each, end on a rigid body.
TEST(SmallMotions, SuperelementsOnARigidBodyHaveTheFrequenciesOfBeams) {
  Scene beams;
  for (const Vector3d& at : {Vector3d(0.0, 0.0, 0.0), Vector3d(0.6, 0.0, 0.1), Vector3d(0.1, 0.5, 0.0),
                             Vector3d(1.6, 0.2, 0.3), Vector3d(-0.2, 1.5, 0.4)})
    add_point(beams, 1.0, at);
  add_link(beams, {0, 1, 2}, Rigid{});
  const Beam beam{.EA = 1e5, .GJ = 300.0, .EI_y = 200.0, .EI_z = 200.0};
  Scene matrices = beams;
  for (const auto& [i, j] : {std::pair{1, 3}, {2, 4}, {3, 4}}) {
    add_link(beams, i, j, beam);
    if (i == 3) {
      add_link(matrices, i, j, beam);
      continue;
    }
    const Vector3d span = beams.points[index(j)].position - beams.points[index(i)].position;
    MatrixLink matrix;
    matrix.has_rotations = true;
    matrix.matrix =
        beam_stiffness(beam, Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitX(), span).toRotationMatrix(),
                       span.norm())
            .sparseView();
    add_link(matrices, i, j, matrix);
  }
  const Eigen::VectorXd omega = rest_modes(true_geometry_of(beams)).omega;
  expect_frequencies(beams, omega, "beams");
  expect_frequencies(matrices, omega, "superelements");
}

}  // namespace
}  // namespace freeflex::testing
