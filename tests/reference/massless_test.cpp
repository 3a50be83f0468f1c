// Massless points and rods on the rung `corotational`. corotational_test compares a random structure with the
// reference.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/motion.hpp"
#include "core/plan/make_plan.hpp"
#include "core/step/readout.hpp"
#include "tests/reference/energy_drift.hpp"
#include "tests/reference/structures.hpp"
#include "tests/reference/true_geometry.hpp"
#include "tools/verification/reference/integrate.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Vector3d;

Vector3d vector_at(const Vec3& v) { return {v[0], v[1], v[2]}; }

// A box of eight points with springs along all lines between them, and a node in it on springs alone.
Scene box(double mass_of_node) {
  Scene scene;
  for (int i = 0; i < 8; ++i)
    add_point(scene, 1.0 + 0.1 * i, {2.0 * (i % 2), 1.3 * (i / 2 % 2), 0.8 * (i / 4)});
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < i; ++j) add_link(scene, j, i, Spring{1e2});
  const int node = add_point(scene, mass_of_node, {0.9, 0.5, 0.6});
  for (int i = 0; i < 8; ++i) add_link(scene, i, node, Spring{3e2});
  scene.fidelity = Fidelity::kFull;
  scene.initial.angular_velocity = {0.7, -0.4, 1.1};
  scene.initial.points = {{0, Vector3d::Zero(), {0.5, 1.0, -0.7}}, {6, Vector3d::Zero(), {-0.9, 0.3, 0.6}}};
  return scene;
}

// The energy of a motion with joints and nodes that have no mass stays, and its change is of order h^4.
TEST(MasslessPoints, EnergyIsConserved) {
  Random random(7);
  Scene scene = massless(random);
  scene.fidelity = Fidelity::kCorotational;
  scene.initial.angular_velocity = {0.7, -0.4, 1.1};
  scene.initial.points = {{3, Vector3d::Zero(), {0.0, 1.0, 2.0}}, {6, Vector3d::Zero(), {0.0, -1.5, 1.0}}};
  double before = 0.0;
  for (const double rate : {1000.0, 2000.0}) {
    scene.rate = rate;
    const auto [start, most, strain] = energy_drift(compile(scene), static_cast<int>(2 * rate));
    std::printf("%4.0f Hz: energy changes by %.1e of the largest strain energy %.3f J\n", rate, most / strain,
                strain);
    EXPECT_LT(most, 1e-4 * strain);
    if (before > 0.0) {
      EXPECT_LT(most, 0.15 * before);
    }
    before = most;
  }
}

// As the mass of a node goes to zero, the motion goes to that with a massless node, with damping of every
// kind and a load on the node. The distance is proportional to the mass.
TEST(MasslessPoints, AreTheLimitOfLightPoints) {
  Damping beta, ratio;
  beta.beta = 2e-4;
  ratio.modal_ratio = 0.02;
  for (const Damping& damping : {Damping{}, beta, ratio}) {
    const auto end_of = [&](double mass) {
      Scene scene = box(mass);
      scene.damping = damping;
      scene.rate = 2000.0;
      Load load;
      load.name = "pull";
      load.axes = Axes::kWorld;
      load.forces = {{8, {0.0, 40.0, 0.0}}};
      load.history = TableHistory{{0.0, 0.3, 1.0}, {0.0, 1.0, 1.0}};
      scene.loads = {load};
      const Plan plan = compile(scene);
      Motion motion(plan, kMotionAlone);
      for (int k = 0; k < 1000; ++k) EXPECT_EQ(motion.advance().status, StepStatus::kOk);
      Eigen::Matrix3Xd p(3, 9);
      for (int i = 0; i < 9; ++i) p.col(i) = vector_at(read_point(plan, motion.state(), i).p_W);
      return p;
    };
    const Eigen::Matrix3Xd massless = end_of(0.0);
    const double light = (end_of(1e-2) - massless).leftCols<8>().norm(),
                 lighter = (end_of(1e-3) - massless).leftCols<8>().norm();
    std::printf("beta %g ratio %g: %.1e m from the motion with 10 g, %.1e with 1 g\n", damping.beta,
                damping.modal_ratio, light, lighter);
    EXPECT_LT(light, 2.5e-3);
    EXPECT_LT(lighter, (damping.modal_ratio > 0.0 ? 0.35 : 0.12) * light);
  }
}

// The published forces on a node balance its load at every tick, and its published velocity and acceleration
// are those of its positions, which corotational_test checks.
TEST(MasslessPoints, PublishedForcesBalanceTheLoad) {
  Scene scene = box(0.0);
  scene.rate = 1000.0;
  const Vector3d force(10.0, -20.0, 15.0);
  Load load;
  load.name = "pull";
  load.axes = Axes::kWorld;
  load.forces = {{8, force}};
  scene.loads = {load};
  for (int k = 0; k < 8; ++k) scene.publication.links.push_back(28 + k);
  const Plan plan = compile(scene);
  Motion motion(plan, kMotionAlone);
  double worst = 0.0, stretch = 0.0;
  for (int tick = 0; tick < 300; ++tick) {
    ASSERT_EQ(motion.advance().status, StepStatus::kOk);
    const auto position = [&](int i) { return vector_at(read_point(plan, motion.state(), i).p_W); };
    Vector3d sum = force;
    for (int k = 0; k < 8; ++k) {
      double tension = 0.0;
      read_link(plan, motion.state(), k, {&tension, 1});
      sum += tension * (position(k) - position(8)).normalized();
      stretch = std::max(stretch, std::abs(tension) / 3e2);
    }
    worst = std::max(worst, sum.norm());
  }
  std::printf("forces on the node off by %.1e N, springs stretched by up to %.2f m\n", worst, stretch);
  EXPECT_GT(stretch, 0.05);
  EXPECT_LT(worst, 1e-8);
}

// A copy of the state gives the same bits with another workspace.
TEST(MasslessPoints, AStateDeterminesTheMotion) {
  Random random(7);
  Scene scene = massless(random);
  scene.fidelity = Fidelity::kCorotational;
  scene.rate = 500.0;
  scene.initial.angular_velocity = {0.7, -0.4, 1.1};
  const Plan plan = compile(scene);
  State state = make_state(plan);
  Workspace first = make_workspace(plan), second = make_workspace(plan);
  StepReport report;
  for (int k = 0; k < 50; ++k) step(plan, state, {}, first, report);
  State copy = state;
  for (int k = 0; k < 50; ++k) {
    step(plan, state, {}, first, report);
    step(plan, copy, {}, second, report);
  }
  ASSERT_EQ(report.status, StepStatus::kOk);
  EXPECT_EQ(static_cast<const MotionState&>(state), static_cast<const MotionState&>(copy));
  EXPECT_EQ(state.coupled.massless.size(), 3U);
}

// What would need the rate of a massless point is refused by name.
TEST(MasslessPoints, DampingAtThePointIsRefused) {
  const auto message = [](const auto& change) {
    Scene scene = box(0.0);
    change(scene);
    Faults faults;
    EXPECT_FALSE(make_full_plan(scene, build(scene), Fidelity::kCorotational, faults).has_value());
    std::string all;
    for (const Fault& fault : faults) all += fault.message + "\n";
    return all;
  };
  EXPECT_NE(message([](Scene& scene) { add_link(scene, 0, 8, Dashpot{2.0}); }).find("link 'l36' damps it"),
            std::string::npos);
  EXPECT_NE(message([](Scene& scene) { scene.links.back().viscous = 0.1; }).find("link 'l35' is viscous"),
            std::string::npos);
  EXPECT_NE(message([](Scene& scene) {
              push(scene, 8, Axes::kLocal, {1.0, 0.0, 0.0});
            }).find("acts on it in local axes"),
            std::string::npos);
}

// Two points with mass on a line, and a triangle of massless points that can turn about it.
TEST(MasslessPoints, ThatTurnAboutALineAreRefused) {
  Scene scene;
  for (const double x : {0.0, 1.0}) add_point(scene, 1.0, {x, 0.0, 0.0});
  for (int k = 0; k < 3; ++k)
    add_point(scene, 0.0, {0.5, std::cos(2.0 * M_PI * k / 3.0), std::sin(2.0 * M_PI * k / 3.0)});
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < i; ++j) add_link(scene, j, i, Spring{1e3});
  Faults faults;
  EXPECT_FALSE(make_full_plan(scene, build(scene), Fidelity::kCorotational, faults).has_value());
  EXPECT_NE(faults.back().message.find("can turn about the line"), std::string::npos)
      << faults.back().message;
}

// A rod of two points is tied at one end to a heavy tetrahedron, and turns about it.
Scene pendulum() {
  Scene scene;
  for (const Vector3d& p : {Vector3d(0.0, 0.0, 0.0), Vector3d(-1.0, 0.6, 0.0), Vector3d(-1.0, -0.6, 0.4),
                            Vector3d(-1.0, 0.0, -0.7)})
    add_point(scene, 40.0, p);
  add_link(scene, {0, 1, 2, 3}, Rigid{});
  add_point(scene, 1.0, {0.3, 0.0, 0.0});
  add_point(scene, 2.0, {1.3, 0.2, 0.1});
  add_link(scene, {4, 5}, Rigid{});
  for (int i = 0; i < 4; ++i) add_link(scene, i, 4, Spring{4e3});
  scene.fidelity = Fidelity::kFull;
  scene.rate = 1000.0;
  scene.initial.points = {{5, Vector3d::Zero(), {0.0, 1.0, 2.0}}};
  return scene;
}

TEST(Rods, TurnFarUntilTheirRotationVectorEnds) {
  const Scene scene = pendulum();
  const CartesianSystem system = true_geometry_of(scene);
  ReferenceOptions options;
  options.tolerance = 1e-10;
  const Plan plan = compile(scene);
  Motion motion(plan, kMotionAlone);
  const auto direction = [&] {
    return Vector3d(vector_at(read_point(plan, motion.state(), 5).p_W) -
                    vector_at(read_point(plan, motion.state(), 4).p_W));
  };
  const auto body = [&] {
    return Vector3d(vector_at(read_point(plan, motion.state(), 0).p_W) -
                    vector_at(read_point(plan, motion.state(), 1).p_W));
  };
  const double start = std::acos(direction().normalized().dot(body().normalized()));
  StepStatus status = StepStatus::kOk;
  double turned = 0.0, off = 0.0;
  for (int k = 1; k < 5000 && status == StepStatus::kOk; ++k) {
    status = motion.advance().status;
    turned = std::acos(direction().normalized().dot(body().normalized())) - start;
    if (k != 1300) continue;
    const double times[] = {1.3};
    const ReferenceRun run = integrate(system, times, options);
    ASSERT_TRUE(run.error.empty()) << run.error;
    for (int i = 0; i < 6; ++i)
      off = std::max(off,
                     (vector_at(read_point(plan, motion.state(), i).p_W) - run.states[0].p_W.col(i)).norm());
    std::printf("off by %.1e m at %.2f rad\n", off, turned);
    EXPECT_GT(turned, 1.5);
    EXPECT_LT(off, 3e-8);
  }
  EXPECT_NEAR(direction().norm(), Vector3d(1.0, 0.2, 0.1).norm(), 1e-12);
  EXPECT_EQ(status, StepStatus::kTurnedTooFar);
}

// What a rod cannot be is refused by name.
TEST(Rods, BodiesWithoutInertiaThatWouldNeedItAreRefused) {
  const auto message = [](const auto& change) {
    Scene scene = pendulum();
    scene.initial.points.clear();
    change(scene);
    Faults faults;
    EXPECT_FALSE(make_full_plan(scene, build(scene), Fidelity::kCorotational, faults).has_value());
    return faults.empty() ? std::string() : faults.back().message;
  };
  const std::string beam = message([](Scene& scene) {
    scene.links[1].points.push_back(add_point(scene, 1.0, {2.3, 0.4, 0.2}));
    add_link(scene, 5, add_point(scene, 1.0, {1.5, 1.0, 0.0}), kBeam);
  });
  EXPECT_NE(beam.find("turns the beam or plate at point"), std::string::npos) << beam;
  const std::string point = message([](Scene& scene) {
    scene.points[5].mass = 0.0;
    for (int i = 0; i < 4; ++i) add_link(scene, i, 5, Spring{4e3});
  });
  EXPECT_NE(point.find("give mass to a second point of it"), std::string::npos) << point;
  const std::string thin = message([](Scene& scene) {
    scene.points[5].inertia = Vector3d(0.0, 1.0, 1.0).asDiagonal();
    scene.links.erase(scene.links.begin() + 1);
    add_link(scene, 5, 0, kBeam);
  });
  EXPECT_NE(thin.find("give it inertia about this axis"), std::string::npos) << thin;
}

// Two rigid bodies that share a point, and the joint in place of which stand stiff bars: bars from this point
// to three points of one body. The distance from the reference with the ball joint is proportional to their
// flexibility.
TEST(BallJoints, StiffBarsReplaceThem) {
  const auto scene_of = [](double EA) {
    Scene scene;
    for (const Vector3d& p : {Vector3d(0.0, 0.0, 0.0), Vector3d(0.5, 0.4, 0.0), Vector3d(0.5, 0.0, 0.3),
                              Vector3d(1.0, 0.0, 0.0), Vector3d(1.5, 0.3, 0.0), Vector3d(2.0, 0.0, 0.4)})
      add_point(scene, 2.0, p);
    if (EA == 0.0) add_link(scene, {0, 1, 2, 3}, Rigid{});
    if (EA > 0.0) add_link(scene, {0, 1, 2}, Rigid{});
    add_link(scene, {3, 4, 5}, Rigid{});
    for (int i = 0; i < 3 && EA > 0.0; ++i) add_link(scene, i, 3, Bar{EA});
    scene.fidelity = Fidelity::kFull;
    scene.rate = 1000.0;
    scene.initial.angular_velocity = {0.3, 1.0, 2.0};
    return scene;
  };
  ReferenceOptions options;
  options.tolerance = 1e-10;
  const double times[] = {0.6};
  const ReferenceRun run = integrate(true_geometry_of(scene_of(0.0)), times, options);
  ASSERT_TRUE(run.error.empty()) << run.error;
  double before = 0.0;
  for (const double EA : {1e4, 1e5, 1e6}) {
    const Plan plan = compile(scene_of(EA));
    Motion motion(plan, kMotionAlone);
    for (int k = 0; k < 600; ++k) ASSERT_EQ(motion.advance().status, StepStatus::kOk);
    double off = 0.0;
    for (int i = 0; i < 6; ++i)
      off = std::max(off,
                     (vector_at(read_point(plan, motion.state(), i).p_W) - run.states[0].p_W.col(i)).norm());
    std::printf("EA %.0e N: off by %.1e m\n", EA, off);
    if (before > 0.0) {
      EXPECT_LT(off, 0.2 * before);
    }
    before = off;
  }
  EXPECT_LT(before, 5e-5);
}

// Four springs hold a massless apex above the corners of a square. A load presses it through their plane: at
// the fold it has no equilibrium nearby. It must not snap to the other side, which would take the energy out
// of the motion without a word.
TEST(MasslessPoints, AnApexThatSnapsIsAFault) {
  Scene scene;
  for (int i = 0; i < 4; ++i) add_point(scene, 1.0, {i % 2 * 2.0 - 1.0, i / 2 * 2.0 - 1.0, 0.0});
  add_point(scene, 1.0, {0.0, 0.0, -1.5});
  const int apex = add_point(scene, 0.0, {0.0, 0.0, 0.2});
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < i; ++j) add_link(scene, i, j, Spring{1e5});
  for (int i = 0; i < 4; ++i) add_link(scene, i, apex, Spring{1e3});
  scene.fidelity = Fidelity::kCorotational;
  scene.rate = 1000.0;
  const auto status_under = [&](double force) {
    scene.loads.clear();
    push(scene, apex, Axes::kBody, {0.0, 0.0, -force});
    scene.loads[0].history = TableHistory{{0.0, 1.0}, {0.0, 1.0}};
    const Plan plan = compile(scene);
    Motion motion(plan, kMotionAlone);
    StepReport report;
    for (int k = 0; k < 1000 && report.status == StepStatus::kOk; ++k) report = motion.advance();
    EXPECT_EQ(report.joint_point, report.status == StepStatus::kOk ? -1 : apex);
    return report.status;
  };
  EXPECT_EQ(status_under(2.0), StepStatus::kOk);  // the fold is near 3 N
  EXPECT_EQ(status_under(5.0), StepStatus::kNoEquilibrium);
}

// The refusal does not depend on spread mass elsewhere. The set-up went on after the error and crashed.
TEST(BallJoints, AreRefusedBesideSpreadMass) {
  Scene scene;
  for (const Vector3d& p : {Vector3d(0.0, 0.0, 0.0), Vector3d(1.0, 0.0, 0.0), Vector3d(1.0, 1.0, 0.0),
                            Vector3d(2.0, 0.0, 1.0), Vector3d(2.0, 1.0, 1.0), Vector3d(3.0, 1.0, 1.0)})
    add_point(scene, 1.0, p);
  add_link(scene, {0, 1, 2}, Rigid{});
  add_link(scene, {2, 3, 4}, Rigid{});
  Beam beam = kBeam;
  beam.mass_per_length = 1.0;
  add_link(scene, 4, 5, beam);
  scene.fidelity = Fidelity::kCorotational;
  Faults faults;
  EXPECT_FALSE(make_full_plan(scene, build(scene), Fidelity::kCorotational, faults).has_value());
  EXPECT_TRUE(std::ranges::any_of(faults, [](const Fault& fault) {
    return fault.message.find("share point 'p2', a ball joint") != std::string::npos;
  }));
}

}  // namespace
}  // namespace freeflex::testing
