// A command that needs a part left out brings it back at its tick, and the motion is that of a plan that had
// it all along.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "core/step/scope.hpp"
#include "tests/service/rig.hpp"
#include "tests/support/omissions.hpp"

namespace freeflex::testing {
namespace {

/// A ladder in the xy plane, 8 points, beams, with a kick in the plane; `turned`: not along the world's axes.
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

TEST(Replan, AfterItTheMotionIsThatOfThePlanWithEverythingIn) {
  Scene scene = ladder(OnNeed::kReplan);
  Simulation lean(lean_plan_of(scene));
  scene.leave_out.keeps.fill(true);
  Simulation whole(lean_plan_of(scene));
  ASSERT_EQ(lean.plan.wide.size(), 1U);
  ASSERT_LT(lean.plan.num_elastic, whole.plan.num_elastic);
  lean.run(200);
  whole.run(200);
  EXPECT_FALSE(lean.state.is_wide);
  const ForceCommand command = push_across();
  double largest = 0.0, change = 0.0;
  for (int tick = 0; tick < 1500; ++tick) {
    const std::span<const ForceCommand> due(&command, tick == 0 ? 1U : 0U);
    lean.run(1, due);
    whole.run(1, due);
    largest = std::max(largest, whole.displacements_B().cwiseAbs().maxCoeff());
    change = std::max(change, (lean.displacements_B() - whole.displacements_B()).cwiseAbs().maxCoeff());
    change = std::max(change, (lean.positions_W() - whole.positions_W()).cwiseAbs().maxCoeff());
  }
  EXPECT_TRUE(lean.state.is_wide);
  EXPECT_EQ(lean.state.wide_tick, 200);
  EXPECT_EQ(static_cast<Need>(lean.state.wide_need), Need::kOutOfPlane);
  EXPECT_EQ(lean.plan.wide.front().num_elastic, whole.plan.num_elastic);
  std::printf("change %.1e of the largest displacement\n", change / largest);
  // phases of 1e4 rad/s over 1.7 s, eps each way; and position of 3 m to eps against displacements of 1e-2
  EXPECT_LE(change, 5e-11 * largest);
}

TEST(Replan, CommandsThatNeedNothingLeaveThePlanAsItIs) {
  Simulation lean(lean_plan_of(ladder(OnNeed::kReplan)));
  ForceCommand command = make_command(0, 1, Axes::kBody);
  add_force(command, 3, {0.2, 0.1, 0.0});
  lean.run(100, {&command, 1});
  EXPECT_FALSE(lean.state.is_wide);
  EXPECT_EQ(lean.state.q.size(), static_cast<std::size_t>(lean.plan.num_padded));
}

TEST(Replan, AResetGoesBackToThePlanAsItStarted) {
  Simulation lean(lean_plan_of(ladder(OnNeed::kReplan)));
  Simulation fresh(lean.plan);
  const ForceCommand command = push_across();
  lean.run(50, {&command, 1});
  ASSERT_TRUE(lean.state.is_wide);
  reset_state(lean.plan, lean.state);
  EXPECT_FALSE(lean.state.is_wide);
  lean.run(300);
  fresh.run(300);
  EXPECT_EQ(lean.state.q, fresh.state.q);
  EXPECT_EQ(lean.state.q_dot, fresh.state.q_dot);
  EXPECT_EQ(lean.state.q_WB, fresh.state.q_WB);
  // and again
  lean.run(50, {&command, 1});
  EXPECT_TRUE(lean.state.is_wide);
}

TEST(Replan, AStepThatFailsLeavesTheStateAsItWas) {
  Simulation lean(lean_plan_of(ladder(OnNeed::kReplan)));
  lean.run(50);
  const State before = lean.state;
  ForceCommand command = make_command(0, 1, Axes::kBody);
  add_force(command, 3, {0.0, 0.0, 1.7e308});
  add_force(command, 4, {0.0, 0.0, 1.7e308});
  step(lean.plan, lean.state, {{&command, 1}}, lean.workspace, lean.report);
  ASSERT_EQ(lean.report.status, StepStatus::kNotFinite);
  EXPECT_FALSE(lean.state.is_wide);
  EXPECT_EQ(lean.state.q, before.q);
  EXPECT_EQ(lean.state.q_low, before.q_low);
  EXPECT_EQ(lean.state.q_dot, before.q_dot);
  Simulation other(lean.plan);
  other.run(60);
  lean.run(10);
  EXPECT_EQ(lean.state.q, other.state.q) << "it goes on as if nothing had been asked";
}

TEST(Replan, TheLoopReplansAtTheTickOfTheCommandToTheBit) {
  const Plan plan = lean_plan_of(ladder(OnNeed::kReplan));
  Rig rig(plan, {.timing = {service::Timing::Kind::kAsap, 1.0}, .until_tick = 600});
  ForceCommand command = push_across();
  command.start_tick = 123;
  rig.push(command);
  rig.run();
  Simulation again(plan);
  again.run(123);
  again.run(477, {&command, 1});
  EXPECT_EQ(rig.simulation.state().wide_tick, 123);
  EXPECT_EQ(motion_bits(rig.simulation.state()), motion_bits(again.state));
}

TEST(Replan, RotationComesBackWithAMoment) {
  Scene scene = ladder(OnNeed::kReplan, false, true);
  Simulation lean(lean_plan_of(scene));
  EXPECT_FALSE(lean.plan.turns);
  scene.leave_out.keeps.fill(true);
  Simulation whole(lean_plan_of(scene));
  // a force through the centre of mass needs no rotation: opposite ones on a line, in world axes
  ForceCommand line = make_command(0, 1, Axes::kWorld, 50);
  const Mat3 R = rotation_matrix(lean.plan.initial.q_WB);
  const Eigen::Vector3d along(R[0], R[3], R[6]);
  add_force(line, 0, 2.0 * along);
  add_force(line, 6, -2.0 * along);
  lean.run(100, {&line, 1});
  whole.run(100, {&line, 1});
  EXPECT_FALSE(lean.state.is_wide);
  ForceCommand moment = make_command(1, 2, Axes::kWorld, 50);
  add_force(moment, 0, 2.0 * along.unitOrthogonal());
  lean.run(400, {&moment, 1});
  whole.run(400, {&moment, 1});
  EXPECT_TRUE(lean.state.is_wide);
  EXPECT_EQ(static_cast<Need>(lean.state.wide_need), Need::kRotation);
  // attitudes after 0.4 s of some 0.1 rad/s, rounding of a sum of 400 turns
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(lean.state.q_WB[i], whole.state.q_WB[i], 1e-13);
  EXPECT_LE((lean.displacements_B() - whole.displacements_B()).norm(),
            5e-11 * whole.displacements_B().norm());
}

TEST(Scope, SizesFromDenormalToTheLargestAreJudgedAlike) {
  const Plan plan = lean_plan_of(ladder(OnNeed::kRefuse));
  for (const double size : {5e-324, 1e-300, 1.0, 1e300, std::numeric_limits<double>::max()}) {
    ForceCommand command = make_command(0, 1, Axes::kBody);
    add_force(command, 1, {0.0, size, 0.0});
    EXPECT_EQ(find_need(plan, command), Need::kNone) << size;
    add_force(command, 2, {0.0, 0.0, size});
    EXPECT_EQ(find_need(plan, command), Need::kOutOfPlane) << size;
  }
}

TEST(Scope, WrenchesAreHeldToThePlane) {
  const Plan plan = lean_plan_of(ladder(OnNeed::kRefuse));
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
