// These tests push bodies whose centres are offset from their points, and check that verdicts include such
// bodies, wheels and superelements.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/plan/make_plan.hpp"
#include "tests/motion/rotations.hpp"
#include "tests/motion/rung_cases.hpp"
#include "tests/motion/watched.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Vector3d;

constexpr double kMass = 10.0, kArm = 0.5, kInertia = 0.1, kSpring = 40.0, kHub = 1e4, kTurn = 1e5;

// Returns a heavy hub and, ahead of it, a body on a joint. The joint is a beam of 2 mm with EI / L = 40 N
// m/rad, and the centre of the body is half a metre further ahead.
Scene pendulum(double thrust, Fidelity fidelity) {
  Scene scene;
  add_point(scene, kHub, {0.0, 0.0, 0.0});
  scene.points[0].inertia = Vector3d(kTurn, kTurn, kTurn).asDiagonal();
  add_point(scene, kMass, {0.002, 0.0, 0.0});
  scene.points[1].inertia = Vector3d(kInertia, kInertia, kInertia).asDiagonal();
  scene.points[1].offset = {kArm, 0.0, 0.0};
  const double bending = kSpring * 0.002;
  add_link(scene, 0, 1, Beam{4e4, 4.0, bending, bending, {0.0, 1.0, 0.0}});
  Load load;
  load.name = "thrust";
  load.axes = Axes::kBody;
  load.forces.push_back({0, {thrust, 0.0, 0.0}});
  if (thrust != 0.0) scene.loads.push_back(load);
  scene.fidelity = fidelity;
  scene.rate = 2000.0;
  scene.publication.points = scene.pushable = {0, 1};
  return scene;
}

// Returns the angles of the joint over four seconds. The joint starts at rest at a small angle.
std::vector<double> joint_angles(const Scene& scene) {
  const Structure structure = build(scene);
  const Freedoms freedoms(scene);
  Plan plan = compile(scene);
  plan.initial.q[0] = 1e-5;
  Simulation simulation(std::move(plan));
  std::vector<double> angles;
  for (int tick = 0; tick < 8000; ++tick) {
    const Vector3d rotation = joint_rotation(structure, freedoms, 1, simulation.state) -
                              joint_rotation(structure, freedoms, 0, simulation.state);
    angles.push_back(std::abs(rotation.z()) > std::abs(rotation.y()) ? rotation.z() : rotation.y());
    simulation.run(1);
  }
  return angles;
}

// The body is an inverted pendulum in an accelerating frame:
//   (J + mu d'^2) theta'' + (k - m a d) theta = 0.
// Here mu is the reduced mass, a = F / M, and d' is the distance to the middle of the beam, which acts as
// the joint. The equation omits the inertia of the hub, which changes the frequency by a fraction of 1e-5.
TEST(Push, ABodyAheadOfItsJointIsAnInvertedPendulum) {
  const double mu = kMass * kHub / (kMass + kHub), arm = kArm + 0.001;
  // the rungs below `coupled` omit this effect
  for (const double share : {-0.5, 0.25, 0.75}) {
    const double a = share * kSpring / (kMass * kArm), thrust = a * (kHub + kMass);
    const std::vector<double> angles = joint_angles(pendulum(thrust, Fidelity::kCoupled));
    // the frequency follows from the times of the first and the last zero
    std::vector<double> zeros;
    for (std::size_t k = 1; k < angles.size(); ++k)
      if (angles[k - 1] * angles[k] < 0.0)
        zeros.push_back(static_cast<double>(k - 1) + angles[k - 1] / (angles[k - 1] - angles[k]));
    ASSERT_GE(zeros.size(), 2u);
    const double found =
        M_PI * static_cast<double>(zeros.size() - 1) / (zeros.back() - zeros.front()) * 2000.0;
    const double expected =
        std::sqrt((kSpring - kMass * a * kArm) * (1.0 / (kInertia + mu * arm * arm) + 1.0 / kTurn));
    std::printf("thrust takes %.2f of the stiffness: %.6f rad/s, closed form %.6f\n", share, found, expected);
    // the beam of 2 mm has a geometric stiffness of its own, 1.3e-3 of that by the arm, which is left out
    // here
    EXPECT_NEAR(found * found, expected * expected,
                2e-3 * std::abs(share) / (1.0 - share) * expected * expected + 4e-4 * expected * expected);
  }
}

/// Holds the true error at the end of a run [m], rms over the mass of the points, and the verdict.
struct TrueError {
  double error = 0.0;
  Verdict verdict;
};
// Steps a scene on the rung `separated` and, as the truth, on the rung `corotational`.
TrueError true_error(Scene scene, int ticks) {
  publish_everything(scene);
  scene.fidelity = Fidelity::kCorotational;
  Watched truth(judged_plan_of(scene));
  scene.fidelity = Fidelity::kSeparated;
  Watched separated(judged_plan_of(scene));
  truth.run(ticks);
  const Verdict& verdict = separated.run(ticks);
  EXPECT_EQ(verdict.tick, ticks);
  return {distance_between(scene, truth, separated), verdict};
}

// The rung `separated` omits this effect, and its verdict estimates the resulting error.
TEST(Push, VerdictEstimatesTheErrorDueToThrustOnBodiesAheadOfTheirJoints) {
  for (const double share : {0.001, 0.05, 0.25, 1.2}) {
    const double thrust = share * kSpring / (kMass * kArm) * (kHub + kMass);
    Scene scene = pendulum(thrust, Fidelity::kSeparated);
    scene.initial.modes = {{1, 1e-5, 0.0}};
    const TrueError found = true_error(scene, 8000);
    const Verdict& verdict = found.verdict;
    std::printf("thrust takes %.3f of the stiffness: off by %.1e of %.1e m, %s at %.1e m\n", share,
                found.error, verdict.scale, name_of(verdict.level), verdict.error.deformation);
    EXPECT_EQ(verdict.level, share > 0.1    ? Verdict::Level::kOutside
                             : share > 0.01 ? Verdict::Level::kWatch
                                            : Verdict::Level::kGood);
    if (share > 1.0) continue;
    // the initial displacement is perpendicular to the beam, so it stretches the beam
    EXPECT_NEAR(verdict.error.deformation, found.error, 0.02 * found.error + 1e-4 * verdict.scale);
  }
}

// Returns a hub with a wheel and with panels on beams. An impulse of torque makes the hub rotate slowly.
Scene hub_with_panels(double momentum, Fidelity fidelity) {
  Scene scene;
  add_point(scene, 300.0, {0.0, 0.0, 0.0});
  scene.points[0].inertia = Vector3d(95.0, 110.0, 90.0).asDiagonal();
  for (const double y : {4.0, -4.0}) {
    const int tip = add_point(scene, 10.0, {0.0, y, 0.0});
    scene.points.back().inertia = Vector3d(2.0, 2.0, 2.0).asDiagonal();
    add_link(scene, 0, tip, Beam{1e5, 1e3, 2e3, 2e3, {0.0, 0.0, 1.0}});
  }
  scene.wheels.push_back({"wheel", 0, Vector3d::UnitZ(), momentum, {}});
  Load impulse;
  impulse.name = "impulse";
  impulse.torques.push_back({0, {0.05, 0.0, 0.0}});
  impulse.history = PulseHistory{0.0, 0.2};
  scene.loads.push_back(impulse);
  scene.fidelity = fidelity;
  scene.rate = 500.0;
  scene.publication.points = {0, 1, 2};
  return scene;
}

TEST(Push, VerdictEstimatesTheErrorDueToTheWheelOfAHub) {
  for (const double momentum : {0.5, 20.0, 50.0}) {
    const TrueError found = true_error(hub_with_panels(momentum, Fidelity::kSeparated), 30000);
    const Verdict& verdict = found.verdict;
    std::printf("wheel of %g N m s: off by %.1e of %.1e m, %s at %.1e m\n", momentum, found.error,
                verdict.scale, name_of(verdict.level), verdict.error.deformation);
    EXPECT_NEAR(verdict.error.deformation, found.error, 0.02 * found.error);
  }
}

// The scene has a wheel on a stiff mount. The modes of the mount have higher frequencies than the modes of
// many soft arms.
TEST(Push, VerdictEstimatesTheErrorDueToAWheelThatActsOnHighModes) {
  Scene scene;
  add_point(scene, 2000.0, {0.0, 0.0, 0.0});
  scene.points[0].inertia = Vector3d(5000.0, 5000.0, 5000.0).asDiagonal();
  add_point(scene, 20.0, {0.0, 0.0, 1.0});
  scene.points[1].inertia = Vector3d(1.0, 1.0, 1.0).asDiagonal();
  add_link(scene, 0, 1, Beam{1e6, 2000.0, 2000.0, 2000.0, {1.0, 0.0, 0.0}});
  for (int k = 0; k < 6; ++k) {
    const int tip = add_point(scene, 1.0, {(k % 2 == 0 ? -3.0 : 3.0) - 0.1 * k, 0.5 * k - 1.0, -0.2 * k});
    scene.points.back().inertia = Vector3d(0.5 + 0.02 * k, 0.5, 0.5).asDiagonal();
    add_link(scene, 0, tip, Beam{300.0, 20.0, 40.0 + k, 50.0 + k, {0.1, 0.2, 1.0}});
  }
  scene.wheels.push_back({"wheel", 1, Vector3d::UnitZ(), 10.0, {}});
  scene.rate = 1000.0;
  scene.publication.points = {0, 1};
  const Structure structure = build(scene);
  const Freedoms freedoms(scene);
  const auto rows = structure.rotations.middleRows<3>(freedoms.rotation(1) - freedoms.num_displacements());
  Eigen::Index mode = 0;
  rows.topRows(2).rightCols(structure.omega.size() - 16).colwise().norm().maxCoeff(&mode);
  scene.initial.modes = {{static_cast<int>(mode) + 17, 1e-6, 0.0}};
  const TrueError found = true_error(scene, 10000);
  const Verdict& verdict = found.verdict;
  std::printf("wheel among %ld modes: %s, off by %.1e of %.1e m, estimate %.1e m\n",
              static_cast<long>(structure.omega.size()), name_of(verdict.level), found.error, verdict.scale,
              verdict.error.deformation);
  EXPECT_GT(found.error, 0.05 * verdict.scale);
  EXPECT_NE(verdict.level, Verdict::Level::kGood);
  EXPECT_NEAR(verdict.error.deformation, found.error, 0.05 * found.error);
}

// An inner coordinate of the superelement stands for a particle of 5 kg at a distance of 8 m. The matrices do
// not contain the position of the particle.
TEST(Push, SpinLoadsOnInnerMassesOfASuperelementAreNotRatedGood) {
  for (const double spin : {1e-5, 0.03}) {
    Scene scene;
    add_point(scene, 500.0, {0.0, 0.0, 0.0});
    scene.points[0].inertia = Vector3d(5000.0, 5000.0, 5000.0).asDiagonal();
    constexpr double kOut = 8.0, kParticle = 5.0, kOmega = 2.0;
    Eigen::MatrixXd M = Eigen::MatrixXd::Zero(7, 7), K = M;
    const Vector3d r(0.0, kOut, 0.0);
    Eigen::MatrixXd moves(3, 7);
    moves << Eigen::Matrix3d::Identity(), -Eigen::Matrix3d::Identity(), Vector3d::UnitZ();
    for (int axis = 0; axis < 3; ++axis) moves.col(3 + axis) = Vector3d::Unit(axis).cross(r);
    M = kParticle * moves.transpose() * moves;
    K(6, 6) = kParticle * kOmega * kOmega;
    MatrixLink matrix;
    matrix.matrix = K.sparseView();
    matrix.mass = M.sparseView();
    matrix.has_rotations = true;
    matrix.num_inner = 1;
    add_link(scene, {0}, matrix);
    scene.initial.angular_velocity = spin * Vector3d(0.0, 0.6, 0.8);
    scene.initial.modes = {{1, 3e-5, 0.0}};
    scene.rate = 200.0;
    scene.fidelity = Fidelity::kSpinLoaded;
    scene.publication.points = {0};
    Watched watched(scene);
    const Verdict verdict = watched.run(1000);
    // the force w_y w_z (5 kg)(8 m) on the inner coordinate, divided by the stiffness of this coordinate, as
    // a root mean square over the mass
    const double missing =
        0.48 * spin * spin * kOut / (kOmega * kOmega) * std::sqrt(kParticle / (500.0 + kParticle));
    std::printf("spin %g rad/s: %s, %.1e m of %.1e m is missing\n", spin,
                describe(watched.plan, verdict).c_str(), missing, verdict.scale);
    EXPECT_EQ(missing > kGoodElastic * verdict.scale, spin > 1e-3);
    EXPECT_EQ(verdict.level, spin > 1e-3 ? Verdict::Level::kWatch : Verdict::Level::kGood);
    EXPECT_EQ(verdict.cause, spin > 1e-3 ? Verdict::Cause::kShared : Verdict::Cause::kNone);
  }
}

TEST(Push, OneRotatingRigidBodyIsRatedGood) {
  Scene scene;
  add_point(scene, 3.0, {0.0, 0.0, 0.0});
  scene.points[0].inertia = Eigen::Vector3d(0.4, 0.5, 0.6).asDiagonal();
  scene.initial.angular_velocity = {1.0, 0.1, 0.2};
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled}) {
    scene.fidelity = rung;
    Watched watched(scene);
    watched.run(100);
    EXPECT_GT(watched.motion.verdict().tick, 90);
    EXPECT_EQ(watched.motion.worst().level, Verdict::Level::kGood) << name_of(rung);
  }
}

TEST(Push, AnInitialStateOfMasslessPointsGivesAWarning) {
  Scene scene;
  for (int k = 0; k < 3; ++k) add_point(scene, k == 1 ? 0.0 : 1.0, {1.0 * k, 0.0, 0.0});
  for (int k = 0; k < 2; ++k) add_link(scene, {k, k + 1}, Beam{1e5, 100.0, 100.0, 100.0, {0.0, 0.0, 1.0}});
  scene.initial.points = {{1, Eigen::Vector3d(0.0, 1e-3, 0.0), Eigen::Vector3d::Zero()}};
  Faults faults;
  EXPECT_TRUE(make_plan(scene, build(scene), faults));
  const auto found = std::ranges::find_if(faults, [](const Fault& fault) {
    return fault.message.find("which has no mass, are ignored") != std::string::npos;
  });
  EXPECT_NE(found, faults.end());
}

// If the tip of a beam is massless, no mode contains the bending that a load on the tip causes.
TEST(Push, ALoadOnAMasslessPointGivesAWarning) {
  Scene scene;
  for (const double x : {0.0, 1.0}) add_point(scene, 2.0, {x, 0.0, 0.0});
  add_point(scene, 0.0, {2.0, 0.0, 0.0});
  for (int k = 0; k < 2; ++k) add_link(scene, k, k + 1, Beam{1e5, 1e3, 2e3, 2e3, {0.0, 0.0, 1.0}});
  scene.pushable = {0};
  const auto warned = [&] {
    Faults faults;
    EXPECT_TRUE(make_plan(scene, build(scene), faults).has_value());
    return std::any_of(faults.begin(), faults.end(), [](const Fault& fault) {
      return fault.message.find("has no mass. If a load acts there, the deformation that it causes") !=
             std::string::npos;
    });
  };
  EXPECT_FALSE(warned());
  scene.pushable.push_back(2);
  EXPECT_TRUE(warned());
  std::get<Beam>(scene.links.back().kind).mass_per_length = 0.1;
  EXPECT_FALSE(warned());
}

}  // namespace
}  // namespace freeflex::testing
