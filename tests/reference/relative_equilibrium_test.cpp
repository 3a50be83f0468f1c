// Small motions about steady motions, from the equations of the step: against the reference, which linearises
// the Cartesian equations, against published figures, and against the motion itself.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/structure/structure.hpp"
#include "tests/reference/relative_equilibria.hpp"
#include "tests/reference/structures.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Vector3d;

// A box of eight points whose edges and diagonals are springs; those of one face have the stiffness
// `stiffness`, the others 1e2 N/m.
Scene craft_of_springs(double stiffness) {
  Scene scene;
  for (int i = 0; i < 8; ++i)
    add_point(scene, 1.0 + 0.1 * i, {2.0 * (i % 2), 1.3 * (i / 2 % 2), 0.8 * (i / 4)});
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < i; ++j) add_link(scene, j, i, Spring{i < 4 ? stiffness : 1e2});
  return scene;
}

// Rods at every angle in a spinning frame, and two rods on one line with a spring between them, whose line
// has no inertia.
TEST(RelativeEquilibrium, RodsHaveTheFrequenciesOfTheReference) {
  Random random(7);
  const Scene frame = rods(random);
  const double off_frame =
      compare(frame, equilibrium_of(frame, 0.8 * build(frame).mass_properties.principal_axes.col(2)));
  Scene line;
  for (int i = 0; i < 4; ++i) add_point(line, 1.0 + 0.2 * i, {1.0 * i, 0.0, 0.0});
  add_link(line, {0, 1}, Rigid{});
  add_link(line, 1, 2, Spring{100.0});
  add_link(line, {2, 3}, Rigid{});
  const double off_line = compare(line, equilibrium_of(line, {0.0, 0.0, 2.0}));
  std::printf("rates off by %.1e and %.1e\n", off_frame, off_line);
  EXPECT_LT(off_frame, kSame);
  EXPECT_LT(off_line, kSame);
}

// A spinning box of springs with a massless node, and a beam under thrust with massless joints.
TEST(RelativeEquilibrium, MasslessPointsHaveTheFrequenciesOfTheReference) {
  Scene box = craft_of_springs(1e2);
  const int node = add_point(box, 0.0, {0.9, 0.5, 0.6});
  for (int i = 0; i < 8; ++i) add_link(box, i, node, Spring{2e2});
  const Vector3d spin = 3.0 * build(box).mass_properties.principal_axes.col(2);
  const RelativeEquilibrium of_box = equilibrium_of(box, spin);
  const double off_box = compare(box, of_box);
  Scene rocket = beam_of(8, 1e4);
  for (const int i : {2, 5}) rocket.points[static_cast<std::size_t>(i)].mass = 0.0;
  push(rocket, 0, Axes::kLocal, {40.0, 0.0, 0.0});
  const double off_rocket = compare(rocket, equilibrium_of(rocket, Vector3d::Zero()));
  std::printf("rates off by %.1e and %.1e\n", off_box, off_rocket);
  EXPECT_LT(off_box, kSame);
  EXPECT_LT(off_rocket, kSame);
}

TEST(RelativeEquilibrium, ARocketUnderThrustHasTheFrequenciesOfTheReference) {
  for (const double thrust : {0.0, 20.0, 60.0, 100.0, 110.5}) {
    Scene scene = beam_of(20, kAxial);
    push(scene, 0, Axes::kLocal, {thrust, 0.0, 0.0});
    const RelativeEquilibrium found = equilibrium_of(scene, Vector3d::Zero());
    const double worst = compare(scene, found);
    std::printf("T %5.1f: %zu motions, off by %.1e\n", thrust, found.motions.size(), worst);
    EXPECT_LT(worst, kSame);
    const bool grows = std::any_of(found.motions.begin(), found.motions.end(),
                                   [](const SmallMotion& small) { return small.rate.real() > 1e-3; });
    EXPECT_EQ(grows, thrust == 110.5);
  }
}

TEST(RelativeEquilibrium, ASpinningBeamHasTheFrequenciesOfTheReference) {
  for (const double share : {0.05, 0.1, 0.5, 1.0}) {
    const Scene scene = beam_of(20, kAxial);
    const RelativeEquilibrium found = equilibrium_of(scene, {0.0, 0.0, share * 22.3733});
    const double worst = compare(scene, found);
    std::printf("Omega %.2f: %zu motions, off by %.1e\n", share, found.motions.size(), worst);
    EXPECT_LT(worst, kSame);
  }
}

// Checks that frequencies of lumped beams of 20, 40 and 80 elements converge to those of the continuous beam
// with the square of the mesh.
template <typename Find>
void check_slope(const std::vector<double>& expected, std::size_t first, std::size_t every,
                 const Find& find) {
  std::array<RelativeEquilibrium, 3> found;
  for (int k = 0; k < 3; ++k) {
    // the thrust shortens the beam by at most 1e-5, which changes frequencies by 4e-5
    found[static_cast<std::size_t>(k)] = find(beam_of(20 << k, 1e7));
  }
  for (std::size_t row = 0; row < expected.size(); ++row) {
    const double omega = expected[row];
    std::array<double, 3> error{};
    for (std::size_t k = 0; k < 3; ++k)
      error[k] = std::abs(found[k].motions[first + row * every].rate.imag() / omega - 1.0);
    const double coarse = std::log2(error[0] / error[1]), fine = std::log2(error[1] / error[2]);
    std::printf("%9.4f: errors %.1e %.1e %.1e, slopes %.2f %.2f\n", omega, error[0], error[1], error[2],
                coarse, fine);
    EXPECT_NEAR(fine, 2.0, 0.2);
  }
}

// The frequencies of the continuous beam were computed with 60 Hermite elements of consistent mass
// (true_beam_test).
TEST(RelativeEquilibrium, LumpedBeamsConvergeToTheContinuousBeam) {
  struct Thrust {
    double thrust;
    std::vector<double> omega;
  };
  const std::array<Thrust, 3> thrusts{
      {{0.0, {22.3733, 61.6728}}, {20.0, {19.5294, 57.7753}}, {100.0, {13.9483, 34.0619}}}};
  for (const auto& [thrust, omega] : thrusts)
    // two planes have the same frequencies
    check_slope(omega, 0, 2, [&](Scene scene) {
      push(scene, 0, Axes::kLocal, {thrust, 0.0, 0.0});
      return equilibrium_of(scene, Vector3d::Zero());
    });
  constexpr double kFirst = 22.3733;
  constexpr double spins[][4] = {{0.05, 1.003805, 2.759439, 5.406541},
                                 {0.1, 1.015134, 2.768118, 5.414389},
                                 {0.5, 1.327300, 3.032316, 5.659362},
                                 {1.0, 2.010022, 3.735482, 6.359921}};
  for (const auto& row : spins) {
    const double spin = row[0] * kFirst;
    std::vector<double> omega;
    for (int mode = 1; mode < 4; ++mode) {
      // in the plane of the spin, then out of it
      omega.push_back(std::sqrt(row[mode] * row[mode] * kFirst * kFirst - spin * spin));
      omega.push_back(row[mode] * kFirst);
    }
    check_slope(omega, 0, 1, [&](const Scene& scene) { return equilibrium_of(scene, {0.0, 0.0, spin}); });
  }
}

// The body spins about the axis of its largest moment of inertia, which moves as the body deforms.
TEST(RelativeEquilibrium, EveryKindOfLinkHasTheFrequenciesOfTheReference) {
  struct Kind {
    const char* name;
    Scene (*make)(Random&);
  };
  constexpr std::array<Kind, 6> kKinds{{{"beams", chain},
                                        {"hinge", hinged},
                                        {"plates", sheet},
                                        {"angles", angles},
                                        {"bodies", bodies},
                                        {"sprung", sprung}}};
  for (const auto& [name, make] : kKinds)
    for (const double damping : {0.0, 50.0}) {
      Random random(11);
      Scene scene = make(random);
      if (damping > 0.0) add_link(scene, 0, 2, Dashpot{damping});
      const Structure structure = build(scene);
      const double lowest =
          *std::find_if(structure.omega.begin(), structure.omega.end(), [](double w) { return w > 0.0; });
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(structure.mass_properties.inertia);
      const RelativeEquilibrium found = equilibrium_of(scene, 0.3 * lowest * axes.eigenvectors().col(2));
      const double worst = compare(scene, found);
      std::printf("%-6s %2zu motions, displacements up to %.1e m, off by %.1e\n", name, found.motions.size(),
                  found.displacements.cwiseAbs().maxCoeff(), worst);
      EXPECT_LT(worst, kSame);
      EXPECT_GT(found.displacements.cwiseAbs().maxCoeff(), 1e-3);
    }
}

// Forces along axes of the world press the ends together. The column tips, which the attitude decides.
TEST(RelativeEquilibrium, DeadEndLoadsTipAColumn) {
  Scene scene = beam_of(10, kAxial);
  push(scene, 0, Axes::kWorld, {5.0, 0.0, 0.0});
  push(scene, 10, Axes::kWorld, {-5.0, 0.0, 0.0});
  const RelativeEquilibrium found = equilibrium_of(scene, Vector3d::Zero());
  EXPECT_LT(compare(scene, found), kSame);
  // a rigid bar of length L and inertia I tips at sqrt(P L / I); the lumped inertia is 0.085, and bending
  // makes it faster
  double fastest = 0.0;
  for (const SmallMotion& small : found.motions) fastest = std::max(fastest, small.rate.real());
  std::printf("tips at %.4f 1/s\n", fastest);
  EXPECT_GT(fastest, std::sqrt(5.0 / 0.085));
}

// The free motion of the step vibrates at the frequencies of the linearised equations and of the reference.
TEST(RelativeEquilibrium, TheMotionVibratesAtTheseFrequencies) {
  const auto check = [](const char* what, double value, const Scene& scene, const RelativeEquilibrium& found,
                        double above) {
    double expected = 0.0, nearest = HUGE_VAL;
    const double measured = measured_frequency(scene, found, 2, above, expected);
    for (const SmallMotion& small : found.motions)
      nearest = std::min(nearest, std::abs(small.rate.imag() - measured));
    std::printf("%s %5.2f: %.8f rad/s measured, %.8f of the reference, linearised off by %.1e\n", what, value,
                measured, expected, nearest / measured);
    EXPECT_LT(nearest, kSame * measured);
    EXPECT_NEAR(measured, expected, kSame * expected);
  };
  for (const double share : {0.05, 0.1, 0.5, 1.0}) {
    const Scene scene = beam_of(10, kAxial);
    const RelativeEquilibrium found = equilibrium_of(scene, {0.0, 0.0, share * 22.3733});
    check("spin", share, scene, found, 1.01 * share * 22.3733);
  }
  for (const double thrust : {0.0, 20.0, 60.0, 100.0}) {
    Scene scene = beam_of(10, kAxial);
    // stiffer in the other plane, so that each mode moves in one plane
    for (Link& link : scene.links) std::get<Beam>(link.kind).EI_z *= 1.5;
    push(scene, 0, Axes::kLocal, {thrust, 0.0, 0.0});
    check("thrust", thrust, scene, equilibrium_of(scene, Vector3d::Zero()), 1.0);
  }
}

// A gyrostat: an axisymmetric body with moments A across and C along its axis, which spins at W with a wheel
// of momentum h along this axis, nutates at ((C - A) W + h) / A in its own axes. Its two light tips hang on
// stiff beams.
TEST(RelativeEquilibrium, AGyrostatNutatesAsARigidBody) {
  constexpr double kSpin = 0.4, kMomentum = 5.0, kTip = 0.01, kArm = 0.5;
  Scene scene;
  add_point(scene, 8.0, Vector3d::Zero());
  scene.points[0].inertia = Vector3d(2.0, 2.0, 3.0).asDiagonal();
  for (const double z : {kArm, -kArm}) {
    const int tip = add_point(scene, kTip, {0.0, 0.0, z});
    add_link(scene, 0, tip, Beam{1e6, 1e6, 1e6, 1e6, {1.0, 0.0, 0.0}});
  }
  scene.wheels.push_back({.name = "wheel", .point = 0, .axis = {0.0, 0.0, 1.0}, .momentum = kMomentum});
  const RelativeEquilibrium found = equilibrium_of(scene, {0.0, 0.0, kSpin});
  const double A = 2.0 + 2.0 * kTip * kArm * kArm, expected = ((3.0 - A) * kSpin + kMomentum) / A;
  ASSERT_FALSE(found.motions.empty());
  std::printf("nutates at %.9f for %.9f rad/s, %.0f %% of the energy in the body\n",
              found.motions[0].rate.imag(), expected, 100.0 * found.motions[0].share);
  EXPECT_EQ(found.motions[0].mode, -1);
  // the tips bend by (spin / omega)^2 of their rotation, omega = 49,000 rad/s
  EXPECT_NEAR(found.motions[0].rate.imag(), expected, 1e-8 * expected);
}

// A spin about the axis of intermediate inertia grows at w sqrt((J_2 - J_1) (J_3 - J_2) / (J_1 J_3)), however
// slow it is beside the lowest frequency.
TEST(RelativeEquilibrium, SlowMotionsOfTheBodyAreFound) {
  const Scene scene = craft_of_springs(1e3);
  const Structure structure = build(scene);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(structure.mass_properties.inertia);
  const Vector3d J = axes.eigenvalues();
  const double share = std::sqrt((J[1] - J[0]) * (J[2] - J[1]) / (J[0] * J[2]));
  for (const double spin : {0.3, 1e-3, 1e-5}) {
    const RelativeEquilibrium found = equilibrium_of(scene, spin * axes.eigenvectors().col(1));
    double fastest = 0.0;
    for (const SmallMotion& small : found.motions) fastest = std::max(fastest, small.rate.real());
    // the springs of 1e2 N/m stretch by (spin / omega)^2
    EXPECT_NEAR(fastest, share * spin, 0.02 * share * spin) << spin;
  }
}

// The stiffest springs are 1e7 times as stiff as the softest. The shape under spin hardly depends on them.
TEST(RelativeEquilibrium, StiffLinksDoNotHideSoftDirections) {
  const auto lowest_at = [](double stiffness) {
    const Scene scene = craft_of_springs(stiffness);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(build(scene).mass_properties.inertia);
    const RelativeEquilibrium found = equilibrium_of(scene, 1.5 * axes.eigenvectors().col(2));
    double lowest = HUGE_VAL;
    for (const SmallMotion& small : found.motions)
      if (small.mode >= 0) lowest = std::min(lowest, small.rate.imag());
    return lowest;
  };
  const double soft = lowest_at(1e6), stiff = lowest_at(1e9);
  std::printf("lowest frequency %.6f and %.6f rad/s\n", soft, stiff);
  EXPECT_NEAR(soft, stiff, 1e-3 * stiff);
}

// In the shape under a force that turns a spinning chain, the accelerations that the reference computes are
// those of a rigid body: the part that no a + alpha x (r + V) fits is zero.
TEST(RelativeEquilibrium, AShapeUnderALoadThatTurnsTheBodyAcceleratesAsARigidBody) {
  Random random(3);
  Scene scene = chain(random);
  push(scene, 0, Axes::kBody, {2.0, -1.0, 5.0});
  for (const Vector3d& spin : {Vector3d(0.0, 0.0, 0.0), Vector3d(0.5, 1.5, -1.0)}) {
    RelativeEquilibria equilibria(true_plan(scene), 0.0);
    const RelativeEquilibrium found = equilibria.respond(spin);
    ASSERT_EQ(found.error, "");
    CartesianSystem system = true_geometry_of(scene);
    system.spin = spin;
    const Eigen::VectorXd e = found.displacements.reshaped();
    const std::vector<double> at(e.begin(), e.end()), still(at.size());
    Eigen::VectorXd e_ddot(e.size());
    accelerations(system, 0.0, 1e-9, at, still, std::span(e_ddot.data(), at.size()));
    Eigen::MatrixXd rigid(e.size(), 6);
    for (Eigen::Index i = 0; i < found.displacements.cols(); ++i)
      for (int a = 0; a < 3; ++a) {
        rigid.block<3, 1>(3 * i, a) = Vector3d::Unit(a);
        rigid.block<3, 1>(3 * i, 3 + a) =
            Vector3d::Unit(a).cross(system.r.col(i) + found.displacements.col(i));
      }
    const Eigen::VectorXd left = e_ddot - rigid * rigid.colPivHouseholderQr().solve(e_ddot);
    const double deflection = found.displacements.cwiseAbs().maxCoeff();
    std::printf("deflection %.3f m, accelerations %.1e, not rigid %.1e\n", deflection, e_ddot.norm(),
                left.norm());
    EXPECT_GT(deflection, 0.02);
    EXPECT_LT(left.norm(), 1e-6 * e_ddot.norm());
  }
}

TEST(RelativeEquilibrium, AMotionThatIsNotSteadyIsRefused) {
  Random random(3);
  const Scene scene = chain(random);
  RelativeEquilibria equilibria(true_plan(scene), std::nullopt);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(build(scene).mass_properties.inertia);
  const Vector3d between = axes.eigenvectors().col(0) + axes.eigenvectors().col(2);
  EXPECT_NE(equilibria.find(0.1 * between).error.find("only about a principal axis"), std::string::npos)
      << equilibria.find(0.1 * between).error;
  Scene pushed = scene;
  push(pushed, 0, Axes::kBody, {0.0, 0.0, 1.0});
  EXPECT_NE(RelativeEquilibria(true_plan(pushed), 0.0).find(Vector3d::Zero()).error.find("turn the body"),
            std::string::npos);
  pushed.loads[0].axes = Axes::kWorld;
  EXPECT_NE(RelativeEquilibria(true_plan(pushed), 0.0)
                .find(axes.eigenvectors().col(2))
                .error.find("world axes are not steady"),
            std::string::npos);
  const Scene row = beam_of(4, kAxial);
  EXPECT_NE(RelativeEquilibria(true_plan(row), std::nullopt).find({0.1, 0.0, 1.0}).error.find("on a line"),
            std::string::npos);
  // two masses on a spring do not hold a spin above sqrt(2 k / m)
  Scene pair;
  for (const double x : {-1.0, 1.0}) add_point(pair, 1.0, {x, 0.0, 0.0});
  add_link(pair, 0, 1, Spring{1e3});
  RelativeEquilibria pairs(true_plan(pair), std::nullopt);
  EXPECT_EQ(pairs.find({0.0, 0.0, 40.0}).error, "");
  for (const double spin : {45.0, 1e3, 1e9})
    EXPECT_NE(pairs.find({0.0, 0.0, spin}).error.find("do not hold this spin"), std::string::npos) << spin;
  // a motor changes the momentum of its wheel
  Scene craft;
  add_point(craft, 8.0, Vector3d::Zero());
  craft.points[0].inertia = Vector3d(2.0, 2.0, 3.0).asDiagonal();
  add_point(craft, 0.1, {0.0, 0.0, 1.0});
  add_link(craft, 0, 1, Beam{1e6, 1e6, 1e6, 1e6, {1.0, 0.0, 0.0}});
  craft.wheels.push_back({.name = "wheel", .point = 0, .axis = {0.0, 0.0, 1.0}, .momentum = 1.0});
  Load motor;
  motor.wheels.push_back({0, 0.5});
  craft.loads.push_back(motor);
  EXPECT_NE(RelativeEquilibria(true_plan(craft), 0.0).find(Vector3d::Zero()).error.find("drives a wheel"),
            std::string::npos);
  // the load acts only when it is asked for, and only while its history acts
  EXPECT_EQ(RelativeEquilibria(true_plan(pushed), std::nullopt).find(Vector3d::Zero()).error, "");
  pushed.loads[0].history = PulseHistory{1.0, 2.0};
  EXPECT_EQ(RelativeEquilibria(true_plan(pushed), 0.0).find(Vector3d::Zero()).error, "");
  EXPECT_NE(RelativeEquilibria(true_plan(pushed), 1.5).find(Vector3d::Zero()).error, "");
}

}  // namespace
}  // namespace freeflex::testing
