// Parts that turn far against one another on the rung `corotational`.
#include <gtest/gtest.h>

#include <cmath>

#include "core/motion.hpp"
#include "core/step/readout.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Vector3d;

// Opposite torques on two groups keep the angular momentum at zero while the arm turns by 3 rad. With the
// arms at rest the net torque was -1.9 N m of 1 N m at 2.9 rad.
void turn_arm(IntegrateBy by, double most_momentum) {
  Scene scene;
  scene.integration.by = by;
  const Vector3d corners[] = {{0.0, 0.0, 0.0}, {-1.0, 0.5, 0.0}, {-1.0, -0.5, 0.3}, {-1.0, 0.0, -0.6},
                              {1.0, 0.0, 0.0}, {0.6, 0.5, 0.1},  {0.7, -0.1, 0.5}};
  for (int i = 0; i < 7; ++i) add_point(scene, i < 4 ? 50.0 : 1.0, corners[i]);
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < i; ++j) add_link(scene, i, j, Spring{1e6});
  for (const int i : {4, 5, 6}) add_link(scene, 0, i, Spring{2e4});
  for (const auto& [i, j] : {std::pair{4, 5}, {5, 6}, {4, 6}}) add_link(scene, i, j, Spring{2e4});
  scene.groups = {{"hub", {0, 1, 2, 3}}, {"arm", {4, 5, 6}}};
  Load load;
  load.axes = Axes::kBody;
  load.wrenches = {{0, Vector3d::Zero(), {0.0, 0.0, -1.0}}, {1, Vector3d::Zero(), {0.0, 0.0, 1.0}}};
  scene.loads = {load};
  scene.fidelity = Fidelity::kCorotational;
  scene.rate = 1000.0;
  const Plan plan = compile(scene);
  Motion motion(plan, kMotionAlone);
  double angle = 0.0, momentum = 0.0, turn = 0.0;
  for (int k = 0; k < 5000 && turn < 3.0; ++k) {
    ASSERT_EQ(motion.advance().status, StepStatus::kOk);
    const Vec3 a = read_point(plan, motion.state(), 4).p_W, b = read_point(plan, motion.state(), 0).p_W;
    const double now = std::atan2(a[1] - b[1], a[0] - b[0]);
    turn += std::remainder(now - angle, 2.0 * M_PI);
    angle = now;
    momentum = std::max(momentum, length(motion.state().H_W));
  }
  std::printf("turned by %.2f rad, angular momentum up to %.1e N m s\n", turn, momentum);
  EXPECT_GT(turn, 3.0);
  EXPECT_LT(momentum, most_momentum);
}

TEST(FarTurns, OppositeTorquesOnGroupsKeepTheAngularMomentum) {
  turn_arm(IntegrateBy::kModes, 1e-12);
  turn_arm(IntegrateBy::kPoints, 1e-11);  // by rounding errors of positions: 2e-12 were measured
}

// A rotor on a hinge turns until its rotation vector reaches 5.5 rad, or 1 rad if its beam has spread mass.
// The fault names it. Without the fault its energy rose from 1.2 to 1500 J at a full turn.
TEST(FarTurns, ABodyThatTurnsTooFarIsAFault) {
  for (const bool has_mass : {false, true}) {
    Scene scene;
    add_point(scene, 1e4, {0.0, 0.0, 0.0});
    scene.points[0].inertia = Vector3d(5000.0, 6000.0, 7000.0).asDiagonal();
    add_point(scene, 2.0, {1.0, 0.0, 0.0});
    scene.points[1].inertia = Vector3d(0.1, 0.1, 0.1).asDiagonal();
    scene.points[1].name = "rotor";
    Beam beam{1e5, 500.0, 500.0, 500.0, {0.0, 1.0, 0.0}};
    beam.released[1][0] = true;
    if (has_mass) beam.mass_per_length = 0.1;
    add_link(scene, 0, 1, beam);
    Load load;
    load.axes = Axes::kLocal;
    load.torques = {{1, {0.5, 0.0, 0.0}}, {0, {-0.5, 0.0, 0.0}}};
    scene.loads = {load};
    scene.fidelity = Fidelity::kCorotational;
    scene.rate = 4000.0;
    const Plan plan = compile(scene);
    Motion motion(plan, kMotionAlone);
    StepReport report;
    std::int64_t tick = 0;
    for (; tick < 8000 && report.status == StepStatus::kOk; ++tick) report = motion.advance();
    EXPECT_EQ(report.status, StepStatus::kTurnedTooFar);
    // half of 5 rad/s^2 times t^2
    const double angle = has_mass ? 1.0 : 5.5;
    EXPECT_NEAR(static_cast<double>(tick) / scene.rate, std::sqrt(2.0 * angle / 5.0), 2e-3);
    const char* const said = has_mass ? "'rotor' has turned by more than 57 degrees"
                                      : "'rotor' has turned by more than 315 degrees";
    EXPECT_NE(lost_shape_text(plan, report, tick).find(said), std::string::npos);
  }
}

}  // namespace
}  // namespace freeflex::testing
