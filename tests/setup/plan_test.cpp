// Contents of the plans that compile() makes.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "core/plan/compile.hpp"
#include "core/plan/file/plan_bytes.hpp"
#include "core/plan/rungs/rates.hpp"
#include "core/rounding.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

Eigen::Vector3d vector(const Vec3& v) { return {v[0], v[1], v[2]}; }
Eigen::Matrix3d matrix(const Mat3& m) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(m.data());
}

bool mentions(const Faults& faults, const std::string& words) {
  for (const Fault& fault : faults)
    if (fault.message.find(words) != std::string::npos) return true;
  return false;
}

TEST(Plans, HaveModeShapeRowsForThePointsThatAreUsed) {
  Scene scene = square_truss(3);
  scene.pushable = {7};
  scene.publication.points = {2, 7, 2};
  scene.groups.push_back({"end", {0, 1}, {}});
  add_corner_pulse(scene);
  const Structure structure = build(scene);
  const Plan plan = compile(scene);
  EXPECT_EQ(plan.num_elastic, 30);
  EXPECT_EQ(plan.num_padded, 32);
  EXPECT_EQ(plan.published_points, (std::vector<std::int32_t>{2, 7}));
  int num_with_rows = 0;
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const std::int32_t row = plan.points[i].row;
    const bool is_used = i == 0 || i == 1 || i == 2 || i == 7 || i == 10;
    EXPECT_EQ(row >= 0, is_used) << i;
    if (row < 0) continue;
    ++num_with_rows;
    for (int axis = 0; axis < 3; ++axis)
      for (int mode = 0; mode < 32; ++mode)
        EXPECT_EQ(plan.rows[static_cast<std::size_t>((3 * row + axis) * 32 + mode)],
                  mode < 30 ? structure.shapes(3 * static_cast<Eigen::Index>(i) + axis, mode) : 0.0);
  }
  EXPECT_EQ(num_with_rows, 5);
  EXPECT_EQ(plan.rows.size(), 5U * 3U * 32U);
}

TEST(Plans, TheInverseInertiaIsTheInverseOfTheInertia) {
  const Plan plan = compile(random_structure(4, 8));
  EXPECT_LT((matrix(plan.inertia) * matrix(plan.inverse_inertia) - Eigen::Matrix3d::Identity()).norm(),
            1e-14);
  const Plan line = compile(lumped_beam(4));
  const Eigen::Matrix3d product = matrix(line.inertia) * matrix(line.inverse_inertia);
  EXPECT_LT((product - Eigen::Vector3d(0.0, 1.0, 1.0).asDiagonal().toDenseMatrix()).norm(), 1e-14);
}

// decay = zeta omega + alpha / 2 + beta omega^2 / 2
TEST(Plans, TheDampingOfAModeIsTheSumOfItsModalAndRayleighDamping) {
  Scene scene = square_truss(2);
  scene.damping.modal_ratio = 0.01;
  scene.damping.mode_ratios = {{3, 0.2}, {5, 0.0}};
  scene.damping.alpha = 0.4;
  scene.damping.beta = 1e-5;
  const Plan plan = compile(scene);
  for (std::size_t l = 0; l < static_cast<std::size_t>(plan.num_elastic); ++l) {
    const double zeta = l == 2 ? 0.2 : (l == 4 ? 0.0 : 0.01);
    const double expected = zeta * plan.omega[l] + 0.2 + 0.5e-5 * plan.omega[l] * plan.omega[l];
    EXPECT_NEAR(plan.decay[l], expected, 4.0 * kEpsilon * expected);
  }
}

// V_i = sum q b reproduces initial displacements that contain no rigid motion.
TEST(Plans, TheModesReproduceInitialDisplacements) {
  Scene scene = square_truss(3);
  const Structure structure = build(scene);
  const Eigen::VectorXd V = 1e-3 * structure.shapes.col(4) - 2e-3 * structure.shapes.col(11);
  for (int i = 0; i < 12; ++i)
    scene.initial.points.push_back({i, V.segment<3>(3 * i), -2.0 * V.segment<3>(3 * i)});
  scene.initial.modes.push_back({2, 5e-3, 0.25});
  Faults warnings;
  const Plan plan = compile(scene, &warnings);
  EXPECT_FALSE(mentions(warnings, "rigid motion"));
  for (std::size_t l = 0; l < plan.initial.q.size(); ++l) {
    const double q = l == 4 ? 1e-3 : (l == 11 ? -2e-3 : 0.0);
    EXPECT_NEAR(plan.initial.q[l], q + (l == 1 ? 5e-3 : 0.0), 1e-16) << l;
    EXPECT_NEAR(plan.initial.q_dot[l], -2.0 * q + (l == 1 ? 0.25 : 0.0), 1e-15) << l;
  }
}

TEST(Plans, RigidMotionInInitialDisplacementsIsRemovedWithAWarning) {
  Scene scene = square_truss(3);
  for (int i = 0; i < 12; ++i) scene.initial.points.push_back({i, {1e-3, 0.0, 0.0}, Eigen::Vector3d::Zero()});
  Faults warnings;
  const Plan plan = compile(scene, &warnings);
  EXPECT_TRUE(mentions(warnings, "initial displacements of the points contain 100 % of rigid motion"));
  for (const double q : plan.initial.q) EXPECT_LT(std::abs(q), 1e-17);
}

TEST(Plans, InitialPoseMovesTheCentreOfMass) {
  Scene scene = square_truss(3);
  for (PointMass& point : scene.points) point.position += Eigen::Vector3d(1.0, 2.0, 3.0);
  scene.initial.position = {10.0, 0.0, 0.0};
  scene.initial.attitude = {2.0, 0.0, 0.0, 2.0};  // a quarter turn about z, not yet normalised
  const Plan plan = compile(scene);
  EXPECT_LT((vector(plan.initial.p_WB) - Eigen::Vector3d(8.0, 1.0, 3.0)).norm(), 1e-14);
  EXPECT_NEAR(plan.initial.q_WB[0], std::sqrt(0.5), kEpsilon);
  EXPECT_NEAR(plan.initial.q_WB[3], std::sqrt(0.5), kEpsilon);
}

TEST(Plans, SpinAboutALineIsRemovedWithAWarning) {
  Scene scene = lumped_beam(4);
  scene.initial.angular_velocity = {3.0, 1.0, 0.0};
  Faults warnings;
  const Plan plan = compile(scene, &warnings);
  EXPECT_TRUE(mentions(warnings, "3 rad/s about the line of the points"));
  EXPECT_LT((vector(plan.initial.w_B) - Eigen::Vector3d(0.0, 1.0, 0.0)).norm(), 1e-15);
}

TEST(Plans, WheelsAndTorquesAboutALineOfPointsAreRefused) {
  Scene scene;
  add_point(scene, 2.0, Eigen::Vector3d::Zero());
  scene.points[0].inertia = Eigen::Vector3d(1.0, 1.0, 0.0).asDiagonal();
  const auto refused = [&](const char* text) {
    Faults faults;
    const Structure structure = build(scene);
    EXPECT_EQ(structure.mass_properties.rigid_freedoms, 5);
    return !make_plan(scene, structure, faults) && mentions(faults, text);
  };
  Wheel wheel;
  wheel.name = "spin";
  wheel.point = 0;
  scene.wheels = {wheel};
  EXPECT_TRUE(refused("wheel 'spin' has an axis with a component along the line of the points"));
  scene.wheels.clear();
  Load load;
  load.name = "roll";
  load.axes = Axes::kBody;
  load.torques = {{0, {0.5, 0.0, 0.1}}};
  scene.loads = {load};
  EXPECT_TRUE(refused("load 'roll' has a torque with a component along the line of the points"));
  scene.loads[0].torques = {{0, {0.5, 0.0, 0.0}}};
  EXPECT_FALSE(refused("load"));
}

// The sum of f_i is the force, and the sum of d_i x f_i is the part of the torque that the group can carry.
TEST(Plans, GroupWeightsReproduceTheForceAndTorqueOfAWrench) {
  Scene scene = random_structure(9, 9);
  scene.groups.push_back({"body", {0, 2, 3, 5, 8}, {}});
  scene.groups.push_back({"pair", {1, 4}, {}});
  scene.groups.push_back({"dot", {6}, {}});
  const Plan plan = compile(scene);
  EXPECT_EQ(plan.groups[0].torque_rank, 3);
  EXPECT_EQ(plan.groups[1].torque_rank, 2);
  EXPECT_EQ(plan.groups[2].torque_rank, 0);
  const Eigen::Vector3d F(1.0, -2.0, 0.5), T(0.3, 0.7, -0.9);
  for (const PlanGroup& group : plan.groups) {
    Eigen::Vector3d force = Eigen::Vector3d::Zero(), torque = Eigen::Vector3d::Zero();
    for (const std::int32_t index : group.points) {
      const PlanPoint& point = plan.points[static_cast<std::size_t>(index)];
      const Eigen::Vector3d d = vector(point.r) - vector(group.centre);
      const Eigen::Vector3d f = point.mass * (F / group.mass + (matrix(group.inverse_inertia) * T).cross(d));
      force += f;
      torque += d.cross(f);
    }
    Eigen::Vector3d carried = T - vector(group.line) * vector(group.line).dot(T);
    if (group.torque_rank == 0) carried.setZero();
    EXPECT_LT((force - F).norm(), 1e-14);
    EXPECT_LT((torque - carried).norm(), 1e-14);
  }
}

TEST(Plans, PulseEdgesAreRoundedToTicksWithAWarning) {
  Scene scene = square_truss(2);
  scene.rate = 1000.0;
  const auto add = [&](const char* name, const History& history) {
    Load load;
    load.name = name;
    load.forces.push_back({0, {1.0, 0.0, 0.0}});
    load.history = history;
    scene.loads.push_back(load);
  };
  add("on", PulseHistory{0.1, 0.3});
  add("off", PulseHistory{0.0104, 0.1});
  add("short", PulseHistory{0.0, 1e-4});
  add("sine", SineHistory{5.0, M_PI});
  Faults warnings;
  Plan plan = compile(scene, &warnings);
  EXPECT_EQ(plan.histories[0].start_tick, 100);
  EXPECT_EQ(plan.histories[0].end_tick, 400);
  EXPECT_EQ(plan.histories[1].start_tick, 10);
  EXPECT_EQ(plan.histories[1].end_tick, 110);
  EXPECT_DOUBLE_EQ(plan.histories[3].phase, 0.5);
  EXPECT_FALSE(mentions(warnings, "'on'"));
  EXPECT_TRUE(mentions(warnings, "load 'off': the pulse starts at 0.0104 s"));
  EXPECT_TRUE(mentions(warnings, "'short': the pulse ends at "));
  EXPECT_TRUE(mentions(warnings, "so that the impulse is the same"));

  set_rate(plan, 10000.0);
  EXPECT_EQ(plan.histories[1].start_tick, 104);
  scene.rate = 10000.0;
  EXPECT_EQ(plan_to_bytes(plan), plan_to_bytes(compile(scene)));
}

TEST(Plans, WarnOfLoadsThatVaryFasterThanTheTicks) {
  Scene scene = square_truss(2);
  scene.rate = 1000.0;
  const auto add = [&](const char* name, const History& history) {
    Load load;
    load.name = name;
    load.forces.push_back({0, {1.0, 0.0, 0.0}});
    load.history = history;
    scene.loads.push_back(load);
  };
  add("slow", SineHistory{75.0, 0.0});
  add("aliased", SineHistory{999.0, 0.0});
  add("coarse", TableHistory{{0.0, 0.001, 0.002}, {0.0, 1.0, 0.0}});
  add("fine", TableHistory{{1e-4, 4e-4, 9e-4}, {0.0, 1000.0, 0.0}});
  Faults warnings;
  compile(scene, &warnings);
  EXPECT_EQ(warnings.size(), 2u);
  EXPECT_TRUE(mentions(warnings,
                       "load 'aliased': the sine of 999 Hz has fewer than 13 ticks a cycle at 1000 Hz, but "
                       "the load is linear between ticks; raise the rate to 12987 Hz or more"));
  EXPECT_TRUE(mentions(
      warnings, "load 'fine': rows 1 and 2 of the table are 0.0003 s apart, less than a tick of 0.001 s"));
}

TEST(Plans, LinkForceRowsGiveTheTensionFromTheModes) {
  const Scene scene = square_truss(3);
  const Structure structure = build(scene);
  const Plan plan = compile(scene);
  ASSERT_EQ(plan.link_outputs.size(), scene.links.size());
  Eigen::VectorXd q = Eigen::VectorXd::LinSpaced(plan.num_elastic, 1e-3, 2e-3);
  const Eigen::VectorXd V = structure.shapes * q;
  for (std::size_t k = 0; k < plan.link_outputs.size(); ++k) {
    const auto a = scene.links[k].points[0], b = scene.links[k].points[1];
    const Eigen::Vector3d span = scene.points[static_cast<std::size_t>(b)].position -
                                 scene.points[static_cast<std::size_t>(a)].position;
    const double tension = 1e5 * span.normalized().dot(V.segment<3>(3 * b) - V.segment<3>(3 * a));
    double sum = 0.0;
    for (int l = 0; l < plan.num_elastic; ++l)
      sum +=
          plan.link_rows[k * static_cast<std::size_t>(plan.num_padded) + static_cast<std::size_t>(l)] * q[l];
    EXPECT_NEAR(sum, tension, 1e-12 * 1e5 * V.norm());
  }
}

TEST(Plans, PointMassAloneHasNoModes) {
  Scene scene;
  add_point(scene, 2.0, {1.0, 2.0, 3.0});
  scene.pushable = {0};
  const Plan plan = compile(scene);
  EXPECT_EQ(plan.rigid_freedoms, 3);
  EXPECT_EQ(plan.num_elastic, 0);
  EXPECT_EQ(find_inconsistency(plan), "");
}

}  // namespace
}  // namespace freeflex::testing
