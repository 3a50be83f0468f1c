// Compares frequencies with published values and closed forms.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>

#include "core/structure/links/link_factor.hpp"
#include "core/structure/modes/dense/decompositions.hpp"
#include "service/io/scene/input.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {
namespace {

Scene read(const std::string& name) {
  const io::SceneResult result = io::read_scene(std::string(FREEFLEX_SOURCE_DIR) + "/service/scenes/" + name);
  for (const Fault& fault : result.faults) ADD_FAILURE() << io::format_fault(fault, result.sources);
  return result.scene.value_or(Scene{});
}

double hertz(double omega) { return omega / (2.0 * M_PI); }

// Exudyn, test rotorDiscTest: lowest free-free frequency 104.6370132606291 Hz. The other frequencies come
// from a dense eigensolver on the published matrices, and are correct to half a unit of the last digit.
TEST(Published, TheRotorHasSixRigidFreedomsAndThePublishedFrequencies) {
  const Structure rotor = build(read("rotor.yaml"));
  EXPECT_EQ(rotor.mass_properties.rigid_freedoms, 6);
  EXPECT_TRUE(rotor.mechanisms.empty());
  ASSERT_EQ(rotor.omega.size(), 3 * 115 - 6);
  EXPECT_NEAR(rotor.mass_properties.mass, 77.966, 5e-4);
  constexpr std::array<double, 8> kHertz{104.637013, 104.637013, 187.824090, 212.329703,
                                         224.552115, 238.687929, 284.204726, 284.204726};
  for (Eigen::Index mode = 0; mode < 8; ++mode)
    EXPECT_NEAR(hertz(rotor.omega[mode]), kHertz[static_cast<std::size_t>(mode)], 6e-7) << mode;
  // an eigensolver on K has an error of (3992 / 105)^2 rounding errors, some 1e-12
  EXPECT_NEAR(hertz(rotor.omega[0]), 104.6370132606291, 1e-11 * 104.6);
  EXPECT_NEAR(hertz(rotor.omega[338]), 3992.0, 0.5);
  std::printf("rotor: %.11f Hz, relative difference %.1e\n", hertz(rotor.omega[0]),
              hertz(rotor.omega[0]) / 104.6370132606291 - 1.0);
}

// ProDy, test data of the anisotropic network model of 1UBI: eigenvalues of K to five digits.
TEST(Published, TheNetworkHasSixZeroFrequenciesAndTheEigenvaluesOfProDy) {
  const Structure network = build(read("network.yaml"));
  EXPECT_EQ(network.mass_properties.rigid_freedoms, 6);
  EXPECT_TRUE(network.mechanisms.empty());
  ASSERT_EQ(network.omega.size(), 222);
  constexpr std::array<double, 30> kEigenvalues{
      0.033933, 0.15243, 0.35979, 0.71644, 1.5448, 1.6734, 1.7472, 2.1088, 2.6287, 2.7101,
      3.4322,   3.6169,  3.8034,  4.0122,  4.1684, 4.5047, 4.6214, 4.7206, 4.8334, 5.0606,
      5.3962,   5.794,   5.9457,  6.0696,  6.2235, 6.3581, 6.3971, 6.5122, 6.6829, 6.7006};
  // the first eigenvalue is within 1e-6 of the printed value, the others within half a unit of their last
  // digit
  EXPECT_NEAR(std::pow(network.omega[0], 2), kEigenvalues[0], 1e-6);
  for (std::size_t mode = 1; mode < kEigenvalues.size(); ++mode) {
    const double unit = std::pow(10.0, std::floor(std::log10(kEigenvalues[mode])) - 4.0);
    EXPECT_NEAR(std::pow(network.omega[static_cast<Eigen::Index>(mode)], 2), kEigenvalues[mode],
                0.5000001 * unit)
        << mode + 7;
  }
}

// The matrix K of the same network has six eigenvalues below 1e-10 of the largest.
TEST(Published, SixEigenvaluesOfTheNetworkAreNoLargerThanRoundingErrors) {
  Faults faults;
  const LinkFactor factor = factor_links(read("network.yaml"), false, faults);
  const Eigen::MatrixXd K = factor.rows.transpose() * factor.rows;
  const Eigen::VectorXd value = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(K).eigenvalues();
  for (Eigen::Index k = 0; k < 6; ++k) EXPECT_LT(std::abs(value[k]), 1e-10 * value.tail<1>()[0]);
  EXPECT_GT(value[6], 1e-10 * value.tail<1>()[0]);
}

TEST(Published, FrequenciesOfLumpedFreeBeamsAreExactToSevenDigits) {
  struct Case {
    int num_points;
    std::vector<double> omega;  // [rad/s] exact for the lumped beam; each frequency occurs in both planes
  };
  for (const Case& each : {Case{3, {std::sqrt(192.0)}}, Case{5, {18.908034, 48.0, 86.844198}},
                           Case{21, {22.201614, 60.877261}}, Case{81, {22.362461}}}) {
    const Structure beam = build(lumped_beam(each.num_points));
    EXPECT_EQ(beam.mass_properties.rigid_freedoms, 5);
    EXPECT_EQ(beam.omega.size(), 3 * each.num_points - 5);
    EXPECT_TRUE(beam.mechanisms.empty());
    for (std::size_t k = 0; k < each.omega.size(); ++k)
      for (std::size_t plane = 0; plane < 2; ++plane)
        EXPECT_NEAR(beam.omega[static_cast<Eigen::Index>(2 * k + plane)], each.omega[k], 6e-7)
            << each.num_points;
  }
}

// beta L = 4.730040744862704 is the first root of cos x cosh x = 1.
TEST(Published, TheLumpedFreeBeamConvergesWithTheSquareOfItsSpacing) {
  const double exact = std::pow(4.730040744862704, 2);
  double coarser = 0.0;
  for (const int num_spans : {10, 20, 40, 80}) {
    const double error = exact - build(lumped_beam(num_spans + 1)).omega[0];
    EXPECT_GT(error, 0.0);
    // relative to the first term of the error, the next term is about 1 / spans^2
    if (coarser > 0.0) {
      EXPECT_NEAR(coarser / error, 4.0, 16.0 * 4.0 / (num_spans * num_spans)) << num_spans;
      std::printf("lumped beam of %d spans: error %.3e rad/s, falls by %.3f\n", num_spans, error,
                  coarser / error);
    }
    coarser = error;
  }
}

// w1^2 = k / m_O, w3^2 = (k / m_O)(1 + 2 m_O / m_C); without a bending spring there is a bending mechanism in
// each of two planes.
TEST(Published, CarbonDioxideStretchesInTheKnownRatioAndBendsFreely) {
  constexpr double kOxygen = 15.9949, kCarbon = 12.0, kStiffness = 1600.0;
  Scene scene;
  add_point(scene, kOxygen, {-1.16, 0.0, 0.0});
  add_point(scene, kCarbon, {0.0, 0.0, 0.0});
  add_point(scene, kOxygen, {1.16, 0.0, 0.0});
  add_link(scene, 0, 1, Spring{kStiffness});
  add_link(scene, 1, 2, Spring{kStiffness});
  Faults warnings;
  const Structure molecule = build(scene, &warnings);
  EXPECT_EQ(molecule.mass_properties.rigid_freedoms, 5);
  ASSERT_EQ(molecule.omega.size(), 4);
  EXPECT_EQ(molecule.mechanisms.size(), 2U);
  EXPECT_EQ(molecule.omega[0], 0.0);
  EXPECT_EQ(molecule.omega[1], 0.0);
  EXPECT_NEAR(molecule.omega[2], std::sqrt(kStiffness / kOxygen), 1e-14 * molecule.omega[2]);
  EXPECT_NEAR(molecule.omega[3] / molecule.omega[2], std::sqrt(1.0 + 2.0 * kOxygen / kCarbon), 1e-14);
  std::printf("CO2: stretching ratio %.10f, off by %.1e\n", molecule.omega[3] / molecule.omega[2],
              molecule.omega[3] / molecule.omega[2] - std::sqrt(1.0 + 2.0 * kOxygen / kCarbon));
  ASSERT_EQ(warnings.size(), 2U);
  EXPECT_NE(warnings[0].message.find("mechanism 1 of 2"), std::string::npos) << warnings[0].message;
}

}  // namespace
}  // namespace freeflex::testing
