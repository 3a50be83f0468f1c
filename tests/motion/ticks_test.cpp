// These tests step wheels, orbits and loads in scenes at long ticks, and check the verdicts on these motions.
#include <gtest/gtest.h>

#include <cmath>

#include "core/step/readout.hpp"
#include "core/step/vector.hpp"
#include "tests/motion/lagrange_equations.hpp"
#include "tests/motion/watched.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/simulation.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Vector3d;
using Level = Verdict::Level;

Scene single_body(double mass, const Vector3d& moments, double rate) {
  Scene scene;
  add_point(scene, mass, Vector3d::Zero());
  scene.points[0].inertia = moments.asDiagonal();
  scene.publication.points = scene.pushable = {0};
  scene.rate = rate;
  return scene;
}

double spin_of_run(const Watched& watched) { return length(angular_velocity(watched.plan, watched.state())); }

// A small satellite nutates at 10 rad/s because of its wheel. In the closed form |w| is constant.
TEST(Ticks, ABodyWithAWheelMayNutateByALargeAngleInOneTick) {
  for (const Fidelity rung :
       {Fidelity::kRigid, Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled})
    for (const double rate : {30.0, 10.0, 5.0, 1.0}) {
      Scene scene = single_body(1.0, Vector3d::Constant(0.002), rate);
      scene.fidelity = rung;
      scene.initial.angular_velocity = {0.01, 0.0, 0.01};
      scene.wheels.push_back({"w", 0, Vector3d::UnitZ(), 0.02, {}});
      Watched watched(scene);
      watched.run_to(600.0);
      EXPECT_NEAR(spin_of_run(watched), std::sqrt(2.0) * 0.01, 1e-14)
          << name_of(rung) << " at " << rate << " Hz";
      EXPECT_EQ(watched.motion.worst().tick, -1) << describe(watched.plan, watched.motion.worst());
    }
}

// At a nutation of 1e6 rad/s, a tick of one second needs more than the allowed 4096 substeps.
TEST(Ticks, TooLongTicksAreRatedOutsideAndASufficientRateIsReported) {
  Scene scene = single_body(1.0, {0.001, 0.002, 0.0025}, 1.0);
  scene.initial.angular_velocity = {0.01, 0.02, 0.01};
  scene.wheels.push_back({"w", 0, Vector3d(0.6, 0.0, 0.8), 1000.0, {}});
  Faults warnings;
  compile(scene, &warnings);
  const auto structure = build(scene);
  Faults faults;
  ASSERT_TRUE(make_plan(scene, structure, faults));
  std::string messages;
  for (const Fault& fault : faults) messages += fault.message;
  EXPECT_NE(messages.find("raise the rate to "), std::string::npos) << messages;
  Watched watched(scene);
  watched.run_to(3.0);
  EXPECT_EQ(watched.motion.worst().level, Level::kOutside);
  const std::string text = describe(watched.plan, watched.motion.worst());
  EXPECT_NE(text.find("; raise the rate"), std::string::npos) << text;
}

TEST(Ticks, APointMassCirclesAnAttractorOnEveryRung) {
  constexpr double kMu = 3.986004418e14, kRadius = 6.78e6;
  for (const Fidelity rung : {Fidelity::kRigid, Fidelity::kSeparated, Fidelity::kSpinLoaded,
                              Fidelity::kCoupled, Fidelity::kCorotational, Fidelity::kFull})
    for (const double rate : {1.0, 0.01}) {
      Scene scene;
      add_point(scene, 100.0, Vector3d::Zero());
      scene.publication.points = scene.pushable = {0};
      scene.rate = rate;
      scene.fidelity = rung;
      scene.attractor.mu = kMu;
      scene.initial.position = {kRadius, 0.0, 0.0};
      scene.initial.velocity = {0.0, std::sqrt(kMu / kRadius), 0.0};
      Watched watched(scene);
      watched.run_to(5500.0);
      const double angle = std::sqrt(kMu / kRadius) / kRadius * 5500.0;
      const Vector3d right = kRadius * Vector3d(std::cos(angle), std::sin(angle), 0.0);
      const Eigen::Map<const Vector3d> p(watched.state().p_WB.data());
      EXPECT_LT((p - right).norm(), 1e-11 * kRadius) << name_of(rung) << " at " << rate << " Hz";
      EXPECT_EQ(watched.motion.worst().tick, -1) << describe(watched.plan, watched.motion.worst());
    }
}

// The scene has a body, a point mass and rigid links. Loads of the scene and of a command act on points,
// groups and bodies.
TEST(Ticks, LoadsInBodyAxesMoveABodyWithoutModesOnEveryRung) {
  const auto state_after = [](Scene scene, Fidelity rung, const Load& load, bool is_command) {
    scene.fidelity = rung;
    ForceCommand command = make_command(0, 1, Axes::kBody);
    for (const PointLoad& each : load.forces) add_force(command, each.point, each.force);
    if (!is_command) scene.loads = {load};
    Watched watched(scene);
    watched.run_to(3.0, std::span(&command, is_command ? 1U : 0U));
    EXPECT_EQ(watched.plan.num_elastic, 0);
    return watched.state();
  };
  Scene body = single_body(8.0, {2.0, 3.0, 4.0}, 100.0);
  body.initial.angular_velocity = {0.1, 0.2, -0.3};
  Scene point;
  add_point(point, 8.0, Vector3d::Zero());
  point.publication.points = point.pushable = {0};
  point.rate = 100.0;
  Scene rigid;
  for (const Vector3d& at : {Vector3d(0.0, 0.0, 0.0), Vector3d(1.0, 0.5, 0.0), Vector3d(0.2, 0.9, 0.4)})
    add_point(rigid, 3.0, at);
  add_link(rigid, {0, 1, 2}, Rigid{});
  rigid.groups = {{"all", {0, 1, 2}}};
  rigid.publication.points = rigid.pushable = {0};
  rigid.rate = 100.0;
  rigid.initial.angular_velocity = body.initial.angular_velocity;
  Load force, torque, wrench;
  force.name = torque.name = wrench.name = "thrust";
  force.axes = torque.axes = wrench.axes = Axes::kBody;
  force.forces = {{0, {1.0, 0.5, 0.2}}};
  torque.torques = {{0, {0.1, -0.2, 0.3}}};
  wrench.wrenches = {{0, {0.3, 0.2, 0.1}, {0.1, 0.2, 0.4}}};
  for (const auto& [scene, load] :
       {std::pair(&body, &force), std::pair(&body, &torque), std::pair(&point, &force),
        std::pair(&rigid, &force), std::pair(&rigid, &wrench)})
    for (const bool is_command : {false, true}) {
      if (is_command && load->forces.empty()) continue;
      const State right = state_after(*scene, Fidelity::kSeparated, *load, is_command);
      EXPECT_GT(dot(right.v_WB, right.v_WB) + dot(right.H_W, right.H_W), 0.01);
      for (const Fidelity rung : {Fidelity::kCoupled, Fidelity::kCorotational, Fidelity::kFull}) {
        if (scene != &point && rung != Fidelity::kCoupled) continue;
        const State found = state_after(*scene, rung, *load, is_command);
        for (std::size_t c = 0; c < 3; ++c) {
          EXPECT_NEAR(found.p_WB[c], right.p_WB[c], 1e-13) << name_of(rung);
          EXPECT_NEAR(found.v_WB[c], right.v_WB[c], 1e-13) << name_of(rung);
          EXPECT_NEAR(found.H_W[c], right.H_W[c], 1e-13) << name_of(rung);
        }
      }
    }
  // the closed form is for 1 N on 8 kg and 0.1 N m about an axis of 2 kg m^2
  body.initial.angular_velocity.setZero();
  force.forces = {{0, {1.0, 0.0, 0.0}}};
  torque.torques = {{0, {0.1, 0.0, 0.0}}};
  EXPECT_NEAR(state_after(body, Fidelity::kCoupled, force, false).p_WB[0], 9.0 / 16.0, 1e-13);
  EXPECT_NEAR(state_after(body, Fidelity::kCoupled, torque, false).H_W[0], 0.3, 1e-13);
}

TEST(Ticks, OneBodyFarFromAnAttractorIsRatedGood) {
  Scene scene = single_body(500.0, {100.0, 300.0, 350.0}, 10.0);
  scene.attractor.mu = 3.986004418e14;
  scene.initial.position = {7e6, 0.0, 0.0};
  scene.initial.velocity = {0.0, 7546.05329, 0.0};
  Watched watched(scene);
  watched.run_to(6000.0);
  EXPECT_EQ(watched.motion.worst().tick, -1) << describe(watched.plan, watched.motion.worst());
}

// Two points of 1 kg, 10 m apart along the radius on a spring of 1e-6 N/m, rotate with the orbit. In the
// rotating frame the elongation follows Hill's equations with the spring. The expected value comes from an
// independent integration of the two points with order 8 (DOP853).
TEST(Ticks, TheGravityFieldActsOnEachPointOfASoftPair) {
  Scene scene;
  add_point(scene, 1.0, {5.0, 0.0, 0.0});
  add_point(scene, 1.0, {-5.0, 0.0, 0.0});
  add_link(scene, 0, 1, Spring{1e-6});
  scene.publication.points = scene.pushable = {0, 1};
  scene.rate = 10.0;
  scene.fidelity = Fidelity::kFull;
  scene.attractor.mu = 3.986004418e14;
  scene.initial.position = {7e6, 0.0, 0.0};
  scene.initial.velocity = {0.0, 7546.053290107541, 0.0};
  scene.initial.angular_velocity = {0.0, 0.0, 0.0010780076128725059};
  Simulation simulation(scene);
  simulation.run(6000);
  const Eigen::Matrix3Xd p = simulation.positions_W();
  const double stretch = (p.col(0) - p.col(1)).norm() - 10.0;
  std::printf("a soft pair in orbit, 600 s: stretch %.6f m (5.90674)\n", stretch);
  EXPECT_NEAR(stretch, 5.90674, 1e-5);
}

// Two points 10 m apart on a spring of negligible stiffness drift about each other in a closed ellipse (Hill
// 1878; Clohessy and Wiltshire 1960). The reference integrates the orbit of each point by extrapolation of
// order 12.
TEST(Ticks, TwoPointsFollowHillsEquationsForTenRevolutions) {
  constexpr double kMu = 3.986004418e14, kRadius = 7e6, kStiffness = 1e-12;
  const double n = std::sqrt(kMu / kRadius) / kRadius, end = std::round(10.0 * 2.0 * M_PI / n);
  Scene scene;
  add_point(scene, 1.0, {5.0, 0.0, 0.0});
  add_point(scene, 1.0, {-5.0, 0.0, 0.0});
  add_link(scene, 0, 1, Spring{kStiffness});
  scene.publication.points = scene.pushable = {0, 1};
  scene.rate = 1.0;
  scene.fidelity = Fidelity::kFull;
  scene.attractor.mu = kMu;
  scene.initial.position = {kRadius, 0.0, 0.0};
  scene.initial.velocity = {0.0, n * kRadius, 0.0};
  // at the ends of the minor axis x' = 0 and y' = -2 n x, in addition to the velocity n x of the rotating
  // frame
  scene.initial.angular_velocity = {0.0, 0.0, -n};
  Eigen::VectorXd y(12);  // positions, then velocities of both points
  y << kRadius + 5.0, 0.0, 0.0, kRadius - 5.0, 0.0, 0.0, 0.0, n * kRadius - 5.0 * n, 0.0, 0.0,
      n * kRadius + 5.0 * n, 0.0;
  const auto rates = [&](double, const Eigen::VectorXd& at) {
    Eigen::VectorXd dot(12);
    dot.head<6>() = at.tail<6>();
    for (Eigen::Index k = 0; k < 2; ++k) {
      const Vector3d p = at.segment<3>(3 * k);
      dot.segment<3>(6 + 3 * k) = -kMu / std::pow(p.norm(), 3) * p;
    }
    const Vector3d d = at.segment<3>(3) - at.head<3>(),
                   pull = kStiffness * (d.norm() - 10.0) * d.normalized();
    dot.segment<3>(6) += pull;
    dot.segment<3>(9) -= pull;
    return dot;
  };
  for (int k = 0; k < 4000; ++k) y = extrapolated_step(rates, 0.0, y, end / 4000);
  Simulation simulation(scene);
  simulation.run(std::llround(end));
  const Eigen::Matrix3Xd p = simulation.positions_W();
  const double off = ((p.col(0) - p.col(1)) - (y.head<3>() - y.segment<3>(3))).norm();
  std::printf("two points in orbit, ten revolutions: relative position off by %.1e m of 10 m\n", off);
  EXPECT_LT(off, 1e-4);
}

// A force that is fixed in the world rotates in body axes, but the elastic step interpolates the force
// linearly over a tick.
TEST(Ticks, AMotionWhoseLoadsRotateWithinATickIsNotRatedGood) {
  const auto worst_at = [](double rate) {
    Scene scene;
    for (const double x : {0.0, 1.0, 2.0, 3.0}) add_point(scene, 1.0, {x, 0.1 * x * (3.0 - x), 0.2 * x});
    join_all(scene, 1e7);
    scene.publication.points = scene.pushable = {0, 1, 2, 3};
    scene.rate = rate;
    scene.fidelity = Fidelity::kSpinLoaded;
    scene.initial.angular_velocity = {0.0, 0.0, 2.0};
    Load load;
    load.name = "wind";
    load.forces = {{0, {0.0, 100.0, 0.0}}, {1, {0.0, -100.0, 0.0}}};
    scene.loads.push_back(load);
    Watched watched(scene);
    watched.run_to(5.0);
    return watched.motion.worst();
  };
  EXPECT_NE(worst_at(4.0).tick, -1) << "the body rotates by 0.5 rad per tick";
}

// The torque varies within a tick. Simpson's rule has an error of (2 pi / n)^4 / 2880, which is 1.4e-5 for n
// = 14 ticks per cycle.
TEST(Ticks, ASineTorqueOfAMotorKeepsItsImpulse) {
  Scene scene = single_body(1.0, {1.0, 2.0, 2.5}, 1.4);
  scene.wheels.push_back({"w", 0, Vector3d::UnitZ(), 0.0, {}});
  Load load;
  load.name = "motor";
  load.wheels = {{0, 0.02}};
  load.history = SineHistory{0.1, 0.0};
  scene.loads.push_back(load);
  Simulation simulation(scene);
  simulation.run(7);  // half a cycle
  const double right = 0.02 * 2.0 / (2.0 * M_PI * 0.1);
  EXPECT_NEAR(simulation.state.wheel_momentum[0] / right, 1.0, 2e-5);
  EXPECT_NEAR(angular_velocity(simulation.plan, simulation.state)[2], -right / 2.5, 2e-5 * right);
}

// A body passes an attractor within a tick, and the gravity gradient rotates the body at the closest
// approach.
TEST(Ticks, AFlyByWithinATickIsResolvedOrNotRatedGood) {
  const auto passed = [](double rate) {
    Scene scene = single_body(1.0, {0.1, 0.2, 0.25}, rate);
    scene.attractor.mu = 1e7;
    scene.initial.position = {-30000.0, 300.0, 0.0};
    scene.initial.velocity = {20000.0, 0.0, 0.0};
    scene.initial.attitude = Eigen::Vector4d(0.95, 0.0, 0.0, 0.3).normalized();
    Watched watched(scene);
    watched.run_to(3.0);
    return std::pair{angular_velocity(watched.plan, watched.state())[2], watched.motion.worst().tick == -1};
  };
  const auto [coarse, is_good] = passed(1.0);
  const auto [fine, is_fine_good] = passed(10000.0);
  std::printf("fly-by at 300 m: spin %.6f in ticks of 1 s, %.6f of 0.1 ms\n", coarse, fine);
  EXPECT_TRUE(!is_good || std::abs(coarse / fine - 1.0) < 1e-3);
  EXPECT_EQ(is_good, is_fine_good);
}

// A force of 1 N on 1 kg jumps at 1 s. The motion takes it as a parabola from tick to tick; the shadow takes
// the jump. At 1.5 s, the mass is at 0.5^2 / 2 m.
TEST(Ticks, AMotionWhoseLoadHistoryJumpsIsNotRatedGood) {
  Scene scene = single_body(1.0, {1.0, 1.0, 1.0}, 10.0);
  Load load;
  load.name = "step";
  load.forces = {{0, {1.0, 0.0, 0.0}}};
  load.history = TableHistory{{0.0, 1.0, 1.0 + 1e-8, 2.0}, {0.0, 0.0, 1.0, 1.0}};
  scene.loads.push_back(load);
  Watched watched(scene);
  const Verdict& verdict = watched.run_to(1.5);
  EXPECT_NE(verdict.level, Verdict::Level::kGood);
  const double error = std::abs(0.125 - watched.state().p_WB[0]);
  EXPECT_GT(error, 5e-3);
  EXPECT_NEAR(verdict.error.position, error, 0.1 * error);  // Boole's rule over a jump
}

TEST(Ticks, APulseKeepsItsImpulseWhereverItsEndsLieInATick) {
  for (const double duration : {0.04, 0.098, 0.102, 0.14, 0.25, 0.3, 1.23}) {
    Scene scene = single_body(2.0, {1.0, 1.0, 1.0}, 10.0);
    Load load;
    load.name = "tap";
    load.forces = {{0, {3.0, 0.0, 0.0}}};
    load.history = PulseHistory{0.149, duration};
    scene.loads.push_back(load);
    Simulation simulation(scene);
    simulation.run(30);
    EXPECT_NEAR(simulation.state.v_WB[0], 3.0 * duration / 2.0, 1e-14) << duration;
  }
}

// The body rotates by a radian between the start of its pulse and the tick to which the pulse is moved. The
// shadow steps at the middle of the tick, where the pulse ends.
TEST(Ticks, ARotatingBodyWhosePulseIsMovedToATickIsNotRatedGood) {
  const auto worst_of = [](double duration) {
    Scene scene = single_body(10.0, {1.0, 2.0, 2.5}, 2.0);
    scene.initial.angular_velocity = {0.2, 4.0, 0.1};
    Load load;
    load.name = "brake";
    load.torques = {{0, {0.0, 0.0, 0.1}}};
    load.history = PulseHistory{1.0, duration};
    scene.loads.push_back(load);
    Watched watched(scene);
    watched.run_to(5.0);
    return watched.motion.worst();
  };
  EXPECT_NE(worst_of(1.75).level, Level::kGood);
  EXPECT_EQ(worst_of(1.5).level, Level::kGood);
}

// A pulse at 2 s that lasts 0.4 s acts from 2 to 3 s at 1 Hz. In the added 0.6 s, the body rotates by 0.6 s
// times the spin that the pulse or an earlier load gives the body. If only the pulse acts, with the torque L
// on a moment of 1 kg m^2, the attitude is wrong by 0.4 s L (0.5 - 0.2) s from 3 s on.
TEST(Ticks, AMotionWithAMovedPulseIsNotRatedGoodIfLoadsRotateTheBody) {
  const auto verdict_of = [](double torque, double earlier, double rate) {
    Scene scene = single_body(10.0, {1.0, 2.0, 2.5}, rate);
    Load pulse;
    pulse.name = "brake";
    pulse.torques = {{0, {torque, 0.0, 0.0}}};
    pulse.history = PulseHistory{2.0, 0.4};
    Load load = pulse;
    load.name = "earlier";
    load.torques = {{0, {earlier, 0.0, 0.0}}};
    load.history = PulseHistory{0.0, 1.0};
    scene.loads = {load, pulse};
    Watched watched(scene);
    watched.run_to(5.0);
    return watched.motion.verdict();
  };
  for (const double torque : {0.5, 0.05, 0.005}) {
    const Verdict verdict = verdict_of(torque, 0.0, 1.0);
    const double error = 0.4 * torque * 0.3;
    std::printf("a moved pulse of %g N m: attitude off by %.4f rad, estimate %.4f rad, %s\n", torque, error,
                verdict.error.attitude, name_of(verdict.level));
    EXPECT_GT(verdict.error.attitude, 0.5 * error);
    EXPECT_LT(verdict.error.attitude, 2.0 * error);
    EXPECT_EQ(verdict.level == Level::kGood, torque < 0.01);
  }
  EXPECT_NE(verdict_of(0.05, 0.5, 1.0).level, Level::kGood);
  EXPECT_EQ(verdict_of(0.5, 0.5, 10.0).level, Level::kGood) << "no end is moved";
}

// A pulse of 0.04 s in a tick of 0.1 s acts for the whole tick with a smaller force.
TEST(Ticks, APulseShorterThanATickKeepsItsImpulse) {
  Scene scene = single_body(2.0, {1.0, 1.0, 1.0}, 10.0);
  Load load;
  load.name = "tap";
  load.forces = {{0, {3.0, 0.0, 0.0}}};
  load.history = PulseHistory{0.53, 0.04};
  scene.loads.push_back(load);
  Faults warnings;
  const auto structure = build(scene);
  ASSERT_TRUE(make_plan(scene, structure, warnings));
  std::string messages;
  for (const Fault& fault : warnings) messages += fault.message;
  EXPECT_NE(messages.find("so that the impulse is the same"), std::string::npos) << messages;
  Simulation simulation(scene);
  simulation.run(5);
  EXPECT_EQ(simulation.state.v_WB[0], 0.0);
  simulation.run(1);
  EXPECT_NEAR(simulation.state.v_WB[0], 3.0 * 0.04 / 2.0, 1e-16);
  simulation.run(10);
  EXPECT_NEAR(simulation.state.v_WB[0], 3.0 * 0.04 / 2.0, 1e-16);
}

}  // namespace
}  // namespace freeflex::testing
