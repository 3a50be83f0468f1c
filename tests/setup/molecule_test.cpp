// These tests check bending and torsion springs on molecules with closed-form frequencies (E. B. Wilson, J.
// C. Decius, P. C. Cross, Molecular Vibrations, 1955, chapters 4 and 8; G. Herzberg, Infrared and Raman
// Spectra, 1945, section II,4).
#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>

#include "core/structure/links/link_factor.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {
namespace {

void expect_frequencies(const Structure& molecule, std::vector<double> squares, double tolerance) {
  std::sort(squares.begin(), squares.end());
  ASSERT_EQ(molecule.omega.size(), static_cast<Eigen::Index>(squares.size()));
  for (std::size_t k = 0; k < squares.size(); ++k) {
    const double omega = molecule.omega[static_cast<Eigen::Index>(k)];
    EXPECT_NEAR(omega, std::sqrt(squares[k]), tolerance * std::sqrt(squares[k])) << k;
  }
}

// w1^2 = k / m_O, w3^2 = (k / m_O)(1 + 2 m_O / m_C), w2^2 = 2 k_d / (l^2 m_O) (1 + 2 m_O / m_C), a double
// frequency.
TEST(Molecules, CarbonDioxideHasTwoBendingAndTwoStretchingModes) {
  constexpr double kOxygen = 15.9949, kCarbon = 12.0, kStretch = 1600.0, kBend = 77.0, kLength = 1.16;
  Scene scene;
  for (const double x : {-kLength, 0.0, kLength})
    add_point(scene, x == 0.0 ? kCarbon : kOxygen, {x, 0.0, 0.0});
  add_link(scene, {0, 1}, Spring{kStretch});
  add_link(scene, {1, 2}, Spring{kStretch});
  add_link(scene, {0, 1, 2}, BendingSpring{kBend});
  const Structure molecule = build(scene);
  EXPECT_EQ(molecule.mass_properties.rigid_freedoms, 5);
  EXPECT_TRUE(molecule.mechanisms.empty());
  const double ratio = 1.0 + 2.0 * kOxygen / kCarbon;
  const double bend = 2.0 * kBend / (kLength * kLength * kOxygen) * ratio;
  expect_frequencies(molecule, {bend, bend, kStretch / kOxygen, kStretch / kOxygen * ratio}, 1e-14);
}

// Bent XY2 with valence forces: lambda_3 = k (mu_Y + mu_X (1 - cos a)); lambda_1 + lambda_2 = k (mu_Y + mu_X
// (1 + cos a)) + 2 k_d / l^2 (mu_Y + mu_X (1 - cos a)); lambda_1 lambda_2 = 2 k k_d / l^2 mu_Y (mu_Y + 2
// mu_X).
TEST(Molecules, WaterHasTheFrequenciesOfItsGFMatrix) {
  constexpr double kHydrogen = 1.00783, kOxygen = 15.99491, kStretch = 780.0, kBend = 63.0, kLength = 0.9575;
  const double angle = 104.51 * M_PI / 180.0;
  Scene scene;
  add_point(scene, kOxygen, {0.3, -0.2, 0.1});
  const Eigen::Matrix3d R =
      Eigen::AngleAxisd(1.1, Eigen::Vector3d(1.0, 2.0, -0.5).normalized()).toRotationMatrix();
  for (const double side : {-0.5, 0.5})
    add_point(scene, kHydrogen,
              scene.points[0].position + R * Eigen::Vector3d(kLength * std::sin(side * angle),
                                                             kLength * std::cos(side * angle), 0.0));
  add_link(scene, {0, 1}, Spring{kStretch});
  add_link(scene, {0, 2}, Spring{kStretch});
  add_link(scene, {1, 0, 2}, BendingSpring{kBend});
  const double c = std::cos(angle), x = 1.0 / kOxygen, y = 1.0 / kHydrogen, l2 = kLength * kLength;
  const double sum = kStretch * (y + x * (1.0 + c)) + 2.0 * kBend / l2 * (y + x * (1.0 - c));
  const double product = 2.0 * kStretch * kBend / l2 * y * (y + 2.0 * x);
  const double high = 0.5 * sum + std::sqrt(0.25 * sum * sum - product);
  const Structure molecule = build(scene);
  EXPECT_EQ(molecule.mass_properties.rigid_freedoms, 6);
  expect_frequencies(molecule, {high, product / high, kStretch * (y + x * (1.0 - c))}, 1e-13);
}

// X3, equilateral: lambda_1 = 3 k / m, lambda_2 = 3 k / (2 m), a frequency of multiplicity two.
TEST(Molecules, EquilateralTriangleHasTheFrequenciesOfItsGFMatrix) {
  constexpr double kMass = 15.99491, kStretch = 570.0;
  Scene scene;
  for (int i = 0; i < 3; ++i)
    add_point(scene, kMass, {std::cos(2.0 * M_PI * i / 3.0), std::sin(2.0 * M_PI * i / 3.0), 0.4});
  join_all(scene, kStretch);
  expect_frequencies(build(scene), {3.0 * kStretch / kMass, 1.5 * kStretch / kMass, 1.5 * kStretch / kMass},
                     1e-14);
}

// Deformation rows of angles agree with central differences of the angles.
TEST(Molecules, DeformationRowsAreTheDerivativesOfTheAngles) {
  Scene scene;
  add_point(scene, 1.0, {0.1, 0.9, -0.2});
  add_point(scene, 2.0, {-0.4, 0.1, 0.3});
  add_point(scene, 3.0, {0.8, -0.2, 0.1});
  add_point(scene, 1.5, {1.0, 0.7, 0.8});
  add_link(scene, {0, 1, 2}, BendingSpring{1.0});
  add_link(scene, {0, 1, 2, 3}, TorsionSpring{1.0});
  const auto at = [&](int i) { return Eigen::Vector3d(scene.points[static_cast<std::size_t>(i)].position); };
  const auto angle = [&] {
    const Eigen::Vector3d a = at(0) - at(1), c = at(2) - at(1);
    return std::atan2(a.cross(c).norm(), a.dot(c));
  };
  const auto dihedral = [&] {
    const Eigen::Vector3d b1 = at(1) - at(0), b2 = at(2) - at(1), b3 = at(3) - at(2);
    return std::atan2(b2.norm() * b1.dot(b2.cross(b3)), b1.cross(b2).dot(b2.cross(b3)));
  };
  Eigen::VectorXd bending = Eigen::VectorXd::Zero(12), torsion = bending;
  const DeformationRows bend_rows = bending_rows(scene, scene.links[0]),
                        twist_rows = torsion_rows(scene, scene.links[1]);
  for (const auto& [freedom, value] : bend_rows.at(0).coefficients) bending[freedom] += value;
  for (const auto& [freedom, value] : twist_rows.at(0).coefficients) torsion[freedom] += value;
  constexpr double kStep = 1e-5;  // truncation and rounding errors are both some 1e-10
  for (int freedom = 0; freedom < 12; ++freedom) {
    double& x = scene.points[static_cast<std::size_t>(freedom / 3)].position[freedom % 3];
    const double rest = x;
    x = rest + kStep;
    const double bend_up = angle(), twist_up = dihedral();
    x = rest - kStep;
    const double bend_down = angle(), twist_down = dihedral();
    x = rest;
    EXPECT_NEAR(bending[freedom], (bend_up - bend_down) / (2.0 * kStep), 1e-9) << freedom;
    EXPECT_NEAR(torsion[freedom], (twist_up - twist_down) / (2.0 * kStep), 1e-9) << freedom;
  }
}

// Without torsional stiffness, hydrogen peroxide rotates freely about its middle bond. With torsional
// stiffness there is no mechanism.
TEST(Molecules, ATorsionSpringRemovesTheOnlyMechanism) {
  Scene scene;
  add_point(scene, 1.0, {-0.3, 0.9, 0.0});
  add_point(scene, 16.0, {0.0, 0.0, 0.0});
  add_point(scene, 16.0, {1.45, 0.0, 0.0});
  add_point(scene, 1.0, {1.75, -0.3, 0.85});
  for (int i = 0; i < 3; ++i) add_link(scene, {i, i + 1}, Spring{700.0});
  add_link(scene, {0, 1, 2}, BendingSpring{80.0});
  add_link(scene, {1, 2, 3}, BendingSpring{80.0});
  Faults warnings;
  const Structure without = build(scene, &warnings);
  ASSERT_EQ(without.mechanisms.size(), 1u);
  EXPECT_EQ(without.omega[0], 0.0);
  add_link(scene, {0, 1, 2, 3}, TorsionSpring{5.0});
  const Structure with = build(scene);
  EXPECT_TRUE(with.mechanisms.empty());
  EXPECT_EQ(with.omega.size(), 6);
  EXPECT_GT(with.omega[0], 0.0);
}

}  // namespace
}  // namespace freeflex::testing
