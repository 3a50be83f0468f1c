// If a command needs an omitted feature, the fallback plan replaces the plan at the tick of the command, and
// the motion equals that of a plan that had the feature from the start.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "core/step/scope.hpp"
#include "tests/service/rig.hpp"
#include "tests/support/omissions.hpp"

namespace freeflex::testing {
namespace {

/// Returns a ladder of 8 points and beams in the xy plane of the body. If `has_kick`, a pulse of force acts
/// in this plane. If `is_turned`, the initial attitude rotates the ladder against the world axes.
Scene ladder(OnNeed on_need, bool has_kick = true, bool is_turned = false) {
  Scene scene;
  scene.name = "ladder";
  for (int i = 0; i < 8; ++i) {
    PointMass point;
    point.name = std::to_string(i);
    point.mass = 1.0 + 0.1 * i;
    point.position = {static_cast<double>(i / 2), 0.5 * (i % 2), 0.0};
    scene.points.push_back(point);
  }
  const auto join = [&](int a, int b) {
    Link link;
    link.name = std::to_string(scene.links.size());
    link.points = {a, b};
    link.kind = Beam{.EA = 1e5, .GJ = 30.0, .EI_y = 40.0, .EI_z = 50.0, .y_axis = Eigen::Vector3d::UnitZ()};
    scene.links.push_back(link);
  };
  for (int i = 0; i < 8; i += 2) join(i, i + 1);
  for (int i = 0; i + 2 < 8; ++i) join(i, i + 2);
  publish_everything(scene);
  scene.groups = {{"end", {6, 7}, {}}};
  if (has_kick) {
    Load load;
    load.name = "kick";
    load.axes = Axes::kBody;
    load.forces = {{7, {1.0, 2.0, 0.0}}};
    load.history = PulseHistory{0.01, 0.05};
    scene.loads = {load};
  }
  if (is_turned) scene.initial.attitude = Eigen::Vector4d(0.5, 0.5, 0.5, 0.5);
  scene.leave_out.on_need = on_need;
  return scene;
}

ForceCommand push_across() {
  ForceCommand command = make_command(0, 1, Axes::kBody, 400);
  add_force(command, 3, {0.2, 0.1, 0.7});
  return command;
}

TEST(Replan, AReplannedRunHasTheMotionOfTheFullPlan) {
  Scene scene = ladder(OnNeed::kReplan);
  Simulation reduced(reduced_plan_of(scene));
  scene.leave_out.keeps.fill(true);
  Simulation full(reduced_plan_of(scene));
  ASSERT_EQ(reduced.plan.fallback.size(), 1U);
  ASSERT_LT(reduced.plan.num_elastic, full.plan.num_elastic);
  reduced.run(200);
  full.run(200);
  EXPECT_FALSE(reduced.state.uses_fallback);
  const ForceCommand command = push_across();
  double largest = 0.0, change = 0.0;
  for (int tick = 0; tick < 1500; ++tick) {
    const std::span<const ForceCommand> due(&command, tick == 0 ? 1U : 0U);
    reduced.run(1, due);
    full.run(1, due);
    largest = std::max(largest, full.displacements_B().cwiseAbs().maxCoeff());
    change = std::max(change, (reduced.displacements_B() - full.displacements_B()).cwiseAbs().maxCoeff());
    change = std::max(change, (reduced.positions_W() - full.positions_W()).cwiseAbs().maxCoeff());
  }
  EXPECT_TRUE(reduced.state.uses_fallback);
  EXPECT_EQ(reduced.state.fallback_tick, 200);
  EXPECT_EQ(static_cast<Need>(reduced.state.fallback_need), Need::kOutOfPlane);
  EXPECT_EQ(reduced.plan.fallback.front().num_elastic, full.plan.num_elastic);
  std::printf("change %.1e of the largest displacement\n", change / largest);
  // the bound allows for rounding errors of the phase of a mode of 1e4 rad/s after 1.7 s, and of positions of
  // 3 m relative to displacements of 1e-2 m
  EXPECT_LE(change, 5e-11 * largest);
}

TEST(Replan, CommandsThatNeedNoOmittedFeatureDoNotChangeThePlan) {
  Simulation reduced(reduced_plan_of(ladder(OnNeed::kReplan)));
  ForceCommand command = make_command(0, 1, Axes::kBody);
  add_force(command, 3, {0.2, 0.1, 0.0});
  reduced.run(100, {&command, 1});
  EXPECT_FALSE(reduced.state.uses_fallback);
  EXPECT_EQ(reduced.state.q.size(), static_cast<std::size_t>(reduced.plan.num_padded));
}

TEST(Replan, AResetRestoresTheInitialPlan) {
  Simulation reduced(reduced_plan_of(ladder(OnNeed::kReplan)));
  Simulation fresh(reduced.plan);
  const ForceCommand command = push_across();
  reduced.run(50, {&command, 1});
  ASSERT_TRUE(reduced.state.uses_fallback);
  reset_state(reduced.plan, reduced.state);
  EXPECT_FALSE(reduced.state.uses_fallback);
  reduced.run(300);
  fresh.run(300);
  EXPECT_EQ(reduced.state.q, fresh.state.q);
  EXPECT_EQ(reduced.state.q_dot, fresh.state.q_dot);
  EXPECT_EQ(reduced.state.q_WB, fresh.state.q_WB);
  // after the reset, the command again switches to the fallback plan
  reduced.run(50, {&command, 1});
  EXPECT_TRUE(reduced.state.uses_fallback);
}

TEST(Replan, AFailedStepLeavesTheStateUnchanged) {
  Simulation reduced(reduced_plan_of(ladder(OnNeed::kReplan)));
  reduced.run(50);
  const State before = reduced.state;
  ForceCommand command = make_command(0, 1, Axes::kBody);
  add_force(command, 3, {0.0, 0.0, 1.7e308});
  add_force(command, 4, {0.0, 0.0, 1.7e308});
  step(reduced.plan, reduced.state, {{&command, 1}}, reduced.workspace, reduced.report);
  ASSERT_EQ(reduced.report.status, StepStatus::kNotFinite);
  EXPECT_FALSE(reduced.state.uses_fallback);
  EXPECT_EQ(reduced.state.fallback_tick, before.fallback_tick);
  EXPECT_EQ(reduced.state.fallback_need, before.fallback_need);
  EXPECT_EQ(reduced.state.q, before.q);
  EXPECT_EQ(reduced.state.q_low, before.q_low);
  EXPECT_EQ(reduced.state.q_dot, before.q_dot);
  Simulation other(reduced.plan);
  other.run(60);
  reduced.run(10);
  EXPECT_EQ(reduced.state.q, other.state.q) << "the motion continues as if the command had not been sent";
}

TEST(Replan, TheLoopReplansAtTheTickOfTheCommandWithTheBitsOfTheStep) {
  const Plan plan = reduced_plan_of(ladder(OnNeed::kReplan));
  Rig rig(plan, {.timing = {service::Timing::Kind::kAsap, 1.0}, .until_tick = 600});
  ForceCommand command = push_across();
  command.start_tick = 123;
  rig.push(command);
  rig.run();
  Simulation again(plan);
  again.run(123);
  again.run(477, {&command, 1});
  EXPECT_EQ(rig.simulation.state().fallback_tick, 123);
  EXPECT_EQ(motion_bits(rig.simulation.state()), motion_bits(again.state));
}

TEST(Replan, ACommandWithAMomentRestoresTheOmittedRotation) {
  Scene scene = ladder(OnNeed::kReplan, false, true);
  Simulation reduced(reduced_plan_of(scene));
  EXPECT_FALSE(reduced.plan.has_rotation);
  scene.leave_out.keeps.fill(true);
  Simulation full(reduced_plan_of(scene));
  // opposite forces on one line have no moment, so they need no rotation, even in world axes
  ForceCommand line = make_command(0, 1, Axes::kWorld, 50);
  const Mat3 R = rotation_matrix(reduced.plan.initial.q_WB);
  const Eigen::Vector3d along(R[0], R[3], R[6]);
  add_force(line, 0, 2.0 * along);
  add_force(line, 6, -2.0 * along);
  reduced.run(100, {&line, 1});
  full.run(100, {&line, 1});
  EXPECT_FALSE(reduced.state.uses_fallback);
  ForceCommand moment = make_command(1, 2, Axes::kWorld, 50);
  add_force(moment, 0, 2.0 * along.unitOrthogonal());
  reduced.run(400, {&moment, 1});
  full.run(400, {&moment, 1});
  EXPECT_TRUE(reduced.state.uses_fallback);
  EXPECT_EQ(static_cast<Need>(reduced.state.fallback_need), Need::kRotation);
  // the body rotates at some 0.1 rad/s for 0.4 s, and the rounding errors of 400 small rotations add up
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(reduced.state.q_WB[i], full.state.q_WB[i], 1e-13);
  EXPECT_LE((reduced.displacements_B() - full.displacements_B()).norm(),
            5e-11 * full.displacements_B().norm());
}

TEST(Scope, TheFeatureThatAForceNeedsDoesNotDependOnTheSizeOfTheForce) {
  const Plan plan = reduced_plan_of(ladder(OnNeed::kRefuse));
  for (const double size : {5e-324, 1e-300, 1.0, 1e300, std::numeric_limits<double>::max()}) {
    ForceCommand command = make_command(0, 1, Axes::kBody);
    add_force(command, 1, {0.0, size, 0.0});
    EXPECT_EQ(find_need(plan, command), Need::kNone) << size;
    add_force(command, 2, {0.0, 0.0, size});
    EXPECT_EQ(find_need(plan, command), Need::kOutOfPlane) << size;
  }
}

TEST(Scope, WrenchesOutOfThePlaneAreDetected) {
  const Plan plan = reduced_plan_of(ladder(OnNeed::kRefuse));
  const auto need = [&](const Vec3& force, const Vec3& torque) {
    ForceCommand command = make_command(0, 1, Axes::kBody);
    command.num_wrenches = 1;
    command.wrenches[0] = {0, 0, force, torque};
    return find_need(plan, command);
  };
  EXPECT_EQ(need({1.0, 2.0, 0.0}, {0.0, 0.0, 3.0}), Need::kNone);
  EXPECT_EQ(need({0.0, 0.0, 1.0}, {}), Need::kOutOfPlane);
  EXPECT_EQ(need({}, {1.0, 0.0, 3.0}), Need::kOutOfPlane);
}

}  // namespace
}  // namespace freeflex::testing
