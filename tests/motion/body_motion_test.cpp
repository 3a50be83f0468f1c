// These tests compare the motion of bodies with inertia with closed forms.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "core/step/readout.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/simulation.hpp"

namespace freeflex::testing {
namespace {

constexpr double kJ = 0.4, kL = 1.7, kGJ = 700.0;

Scene two_on_a_beam() {
  Scene scene;
  for (const double x : {0.0, kL}) {
    add_point(scene, 3.0, {x, 0.0, 0.0});
    scene.points.back().inertia = Eigen::Vector3d(kJ, 0.5, 0.7).asDiagonal();
  }
  add_link(scene, 0, 1, Beam{5e5, kGJ, 900.0, 1300.0, {0.0, 1.0, 0.0}});
  for (const int point : {0, 1}) {
    Group group;
    group.name = "g" + std::to_string(point);
    group.points = {point};
    scene.groups.push_back(group);
    scene.publication.groups.push_back(point);
  }
  scene.rate = 1000.0;
  return scene;
}

ForceCommand torque_on(int point, const Vec3& torque) {
  ForceCommand command = make_command(0, 1, Axes::kBody);
  command.num_torques = 1;
  command.torques[0] = {point, 0, torque};
  return command;
}

Scene two_published_bodies() {
  Scene scene = two_on_a_beam();
  scene.publication.points = {0, 1};
  scene.pushable = {0, 1};
  return scene;
}

// A wrench on a group of one body alone is spread over the particles of the body, so the wrench has the same
// effect as a torque on the body.
TEST(BodyMotion, ATorqueOnABodyEqualsAWrenchOnTheGroupOfThatBody) {
  for (const Axes axes : {Axes::kBody, Axes::kWorld}) {
    Simulation by_torque(two_published_bodies()), by_wrench(two_published_bodies());
    const Vec3 torque{0.3, -0.2, 0.5};
    ForceCommand wrench = make_command(0, 1, axes), direct = torque_on(1, torque);
    direct.axes = wrench.axes;
    wrench.num_wrenches = 1;
    wrench.wrenches[0] = {1, 0, {}, torque};
    by_torque.run(500, std::span(&direct, 1));
    by_wrench.run(500, std::span(&wrench, 1));
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(by_torque.state.H_W[k], by_wrench.state.H_W[k], 1e-13) << k;
    const Eigen::Map<const Eigen::VectorXd> a(by_torque.state.q.data(), 8), b(by_wrench.state.q.data(), 8);
    EXPECT_GT(b.norm(), 1e-6);
    EXPECT_LT((a - b).norm(), 1e-11 * b.norm());
  }
}

// On the rung `coupled`, a torque on a body and a wrench on its group also give the same motion. For small
// rotations, this motion is the one on the rung `separated`.
TEST(BodyMotion, OnTheCoupledRungATorqueOnABodyEqualsAWrench) {
  Scene scene = two_published_bodies();
  scene.fidelity = Fidelity::kCoupled;
  Simulation coupled(scene), by_wrench(scene);
  scene.fidelity = Fidelity::kSeparated;
  Simulation separated(scene);
  const Vec3 torque{3e-4, -2e-4, 5e-4};
  ForceCommand wrench = make_command(0, 1, Axes::kBody);
  const ForceCommand direct = torque_on(1, torque);
  wrench.num_wrenches = 1;
  wrench.wrenches[0] = {1, 0, {}, torque};
  coupled.run(500, std::span(&direct, 1));
  by_wrench.run(500, std::span(&wrench, 1));
  separated.run(500, std::span(&direct, 1));
  const Eigen::Map<const Eigen::VectorXd> a(coupled.state.q.data(), 8), b(by_wrench.state.q.data(), 8),
      c(separated.state.q.data(), 8);
  EXPECT_GT(c.norm(), 1e-9);
  EXPECT_LT((a - b).norm(), 1e-6 * b.norm());
  EXPECT_LT((a - c).norm(), 1e-3 * c.norm());
}

// The angular velocity equals the difference of two attitudes over the time between them. Without
// deformation, the axes of the body are those of the scene.
TEST(BodyMotion, AngularVelocityIsTheDerivativeOfTheAttitude) {
  Scene scene = two_published_bodies();
  scene.initial.angular_velocity = {0.4, -0.7, 0.2};
  Simulation simulation(scene);
  EXPECT_EQ(read_body(simulation.plan, simulation.state, 0).q_WP, (Quat{1.0, 0.0, 0.0, 0.0}));
  const ForceCommand command = torque_on(1, {3.0, -20.0, 25.0});
  simulation.run(200, std::span(&command, 1));
  const BodyState before = read_body(simulation.plan, simulation.state, 1);
  simulation.run(1);
  const BodyState now = read_body(simulation.plan, simulation.state, 1);
  simulation.run(1);
  const BodyState after = read_body(simulation.plan, simulation.state, 1);
  const auto quaternion = [](const Quat& q) { return Eigen::Quaterniond(q[0], q[1], q[2], q[3]); };
  const Eigen::Quaterniond step = quaternion(before.q_WP).conjugate() * quaternion(after.q_WP);
  const Eigen::AngleAxisd rotation(step);
  const Eigen::Vector3d found = rotation.angle() * rotation.axis() / 2e-3,
                        reported(now.w_P[0], now.w_P[1], now.w_P[2]);
  const GroupPose pose = read_group(simulation.plan, simulation.state, 1);
  EXPECT_GT(Eigen::Vector3d(pose.w_B[0], pose.w_B[1], pose.w_B[2]).norm(), 0.1);
  EXPECT_LT((found - reported).norm(), 1e-4 * reported.norm());
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(after.q_WP[k], pose.q_WG[k], 1e-13);
}

// In body axes, a torque T in local axes gives dH/dt = T + theta x T, where theta is the elastic rotation of
// its body.
TEST(BodyMotion, ATorqueInLocalAxesRotatesWithItsBody) {
  Scene scene = two_published_bodies();
  scene.initial.modes = {{1, 0.05, 0.0}, {2, -0.03, 0.0}};
  Load load;
  load.name = "turned";
  load.axes = Axes::kLocal;
  load.torques = {{1, {1e-3, 2e-3, -1e-3}}};
  scene.loads.push_back(load);
  scene.rate = 1e5;
  Simulation simulation(scene);
  const BodyState at_rest = read_body(simulation.plan, simulation.state, 1);
  const Eigen::Vector3d theta =
      2.0 / at_rest.q_WP[0] * Eigen::Vector3d(at_rest.q_WP[1], at_rest.q_WP[2], at_rest.q_WP[3]);
  EXPECT_GT(theta.norm(), 1e-3);
  const Eigen::Vector3d torque(1e-3, 2e-3, -1e-3), expected = torque + theta.cross(torque);
  simulation.run(1);
  const Vec3& H = simulation.state.H_W;
  const Eigen::Vector3d rate = Eigen::Vector3d(H[0], H[1], H[2]) * 1e5;
  EXPECT_GT((expected - torque).norm(), 1e-3 * torque.norm());
  EXPECT_LT((rate - expected).norm(), 0.05 * (expected - torque).norm());
}

TEST(BodyMotion, ATorqueOnAPointMassIsRefused) {
  Scene scene = two_published_bodies();
  scene.points[1].inertia.setZero();
  Load load;
  load.name = "turned";
  load.torques = {{1, {1e-3, 0.0, 0.0}}};
  scene.loads.push_back(load);
  Faults faults;
  EXPECT_FALSE(build_structure(scene, faults));
  ASSERT_FALSE(faults.empty());
  EXPECT_NE(faults[0].message.find("has no attitude"), std::string::npos) << faults[0].message;
}

// A constant torque T along the beam acts on one body. The bodies rotate by T t^2 / (4 J) on average, and
// their angles differ by T / (2 k) (1 - cos w t) with w^2 = 2 k / J and k = GJ / L.
TEST(BodyMotion, ATorqueTwistsTheBeamBetweenTwoBodies) {
  constexpr double kTorque = 1e-3, kStiffness = kGJ / kL;
  Simulation simulation(two_on_a_beam());
  ForceCommand command = make_command(0, 1, Axes::kBody);
  command.num_wrenches = 1;
  command.wrenches[0].group = 0;
  command.wrenches[0].torque = {kTorque, 0.0, 0.0};
  const double omega = std::sqrt(2.0 * kStiffness / kJ);
  const double largest = kTorque / (2.0 * kStiffness);
  for (int k = 0; k < 200; ++k) {
    simulation.run(1, k == 0 ? std::span(&command, 1) : std::span<const ForceCommand>());
    const double t = 1e-3 * (k + 1);
    const double mean = kTorque * t * t / (4.0 * kJ), half = 0.5 * largest * (1.0 - std::cos(omega * t));
    const auto angle = [&](int group) {
      const Quat q = read_group(simulation.plan, simulation.state, group).q_WG;
      return 2.0 * std::atan2(q[1], q[0]);
    };
    EXPECT_NEAR(angle(0), mean + half, 1e-10 * largest + 1e-15) << t;
    EXPECT_NEAR(angle(1), mean - half, 1e-10 * largest + 1e-15) << t;
    const GroupPose pose = read_group(simulation.plan, simulation.state, 0);
    EXPECT_NEAR(pose.w_B[0], kTorque * t / (2.0 * kJ) + 0.5 * largest * omega * std::sin(omega * t), 1e-12)
        << t;
  }
}

// Two bodies at the ends of a beam along x have the products of inertia +-Jxz and spin about z. The spin
// loads each body with the torque -w x J w = -+ w^2 Jxz about y, and the beam bends to an arc of a circle
// with theta_2 = -theta_1 = T L / (2 EI).
TEST(BodyMotion, ASpinBendsTheBeamBetweenTiltedBodies) {
  constexpr double kProduct = 0.1, kSpin = 0.05, kEIy = 900.0;
  Scene scene = two_on_a_beam();
  scene.fidelity = Fidelity::kSpinLoaded;
  for (const int body : {0, 1}) {
    Eigen::Matrix3d& J = scene.points[static_cast<std::size_t>(body)].inertia;
    J(0, 2) = J(2, 0) = body == 0 ? kProduct : -kProduct;
  }
  scene.initial.angular_velocity = {0.0, 0.0, kSpin};
  scene.damping.modal_ratio = 0.5;
  Simulation simulation(scene);
  simulation.run(2000);
  const double expected = kSpin * kSpin * kProduct * kL / (2.0 * kEIy);
  const Quat q0 = read_group(simulation.plan, simulation.state, 0).q_WG,
             q1 = read_group(simulation.plan, simulation.state, 1).q_WG;
  // q_WB^-1 q_WG is the rotation in body axes, and the vector part of this quaternion is half the angle of a
  // small rotation
  const auto rotation_about_y = [&](const Quat& q) {
    const Quat& b = simulation.state.q_WB;
    return 2.0 * (b[0] * q[2] - b[2] * q[0] - b[3] * q[1] + b[1] * q[3]);
  };
  EXPECT_NEAR(rotation_about_y(q1), expected, 1e-9 * expected);
  EXPECT_NEAR(rotation_about_y(q0), -expected, 1e-9 * expected);
}

}  // namespace
}  // namespace freeflex::testing
