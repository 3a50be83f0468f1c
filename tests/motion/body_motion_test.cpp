// Bodies with inertia in motion, by closed forms.
#include <gtest/gtest.h>

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

// A constant torque along the beam on one body: both turn by T t^2 / (4 J) in the mean, and their difference
// by T / (2 k) (1 - cos w t), w^2 = 2 k / J, k = GJ / L.
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

// Bodies at the ends of a beam along x whose inertia has the product +-Jxz, spun about z: the spin turns each
// by the torque -w x J w = -+ w^2 Jxz about y, and the beam bends to a circle, theta_2 = -theta_1 = T L / (2
// EI).
TEST(BodyMotion, ASpinBendsWhatHoldsTiltedBodies) {
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
  // in the axes of the body: q_WB^-1 q_WG, of a small turn its vector twice
  const auto turn_about_y = [&](const Quat& q) {
    const Quat& b = simulation.state.q_WB;
    return 2.0 * (b[0] * q[2] - b[2] * q[0] - b[3] * q[1] + b[1] * q[3]);
  };
  EXPECT_NEAR(turn_about_y(q1), expected, 1e-9 * expected);
  EXPECT_NEAR(turn_about_y(q0), -expected, 1e-9 * expected);
}

}  // namespace
}  // namespace freeflex::testing
