// Plans that integrate the points of a structure of springs in place of its modes   (THEORY 12.127
// to 12.136).
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "core/motion.hpp"
#include "core/plan/file/plan_bytes.hpp"
#include "core/plan/make_plan.hpp"
#include "core/step/points/reading.hpp"
#include "tests/motion/rung_cases.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {
namespace {

Scene by_points(Scene scene, double rate, double accuracy = 1e-6) {
  scene.fidelity = Fidelity::kCorotational;
  scene.rate = rate;
  scene.integration = {IntegrateBy::kPoints, accuracy, {}};
  return scene;
}
Scene by_modes(Scene scene, double rate) {
  scene.fidelity = Fidelity::kCorotational;
  scene.rate = rate;
  scene.integration.by = IntegrateBy::kModes;
  return scene;
}

Simulation run_for(const Scene& scene, double end) {
  Simulation simulation(scene);
  simulation.run(std::llround(end * scene.rate));
  return simulation;
}

TEST(Points, TheErrorIsBelowTheAccuracyThatIsAskedForAtAnyRate) {
  constexpr double kEnd = 1.0;
  const Scene scene = boxed_truss(0.5, 10.0);
  const Truth truth = truth_of(scene, kEnd);
  for (const double rate : {10.0, 100.0, 250.0, 1000.0, 4000.0, 10000.0})
    for (const double accuracy : {1e-3, 1e-5, 1e-7}) {
      const Simulation simulation = run_for(by_points(scene, rate, accuracy), kEnd);
      const PlanPoints& method = simulation.plan.points_method;
      const double error = errors_of(simulation, truth).elastic;
      std::printf("%5g Hz, accuracy %.0e: %3d steps in %d ticks, %d columns, elastic error %.1e\n", rate,
                  accuracy, method.steps, method.ticks, method.columns, error);
      // 850 rad of the fastest mode, and a floor by rounding errors and by the truth
      EXPECT_LT(error, 0.85 * accuracy + 2e-8);
    }
}

// An equilateral triangle of equal springs that breathes is a harmonic oscillator at any amplitude: three
// springs of stiffness D between points of mass m have r'' = -(3 D / m) (r - L / sqrt 3).
TEST(Points, ABreathingTriangleIsExactAtLargeStrains) {
  constexpr double kMass = 2.0, kStiffness = 600.0, kLength = 1.5;
  const double radius = kLength / std::sqrt(3.0), omega = std::sqrt(3.0 * kStiffness / kMass);
  for (const double strain : {1e-6, 0.03, 0.3}) {
    Scene scene;
    for (int i = 0; i < 3; ++i) {
      const double angle = 2.0 * M_PI * i / 3.0;
      PointMass point;
      point.mass = kMass;
      point.position = {radius * std::cos(angle), radius * std::sin(angle), 0.0};
      scene.publication.points.push_back(i);
      scene.initial.points.push_back({i, strain * point.position, Eigen::Vector3d::Zero()});
      scene.points.push_back(point);
      Link link;
      link.points = {i, (i + 1) % 3};
      link.kind = Spring{kStiffness};
      scene.links.push_back(link);
    }
    const Simulation simulation = run_for(by_points(scene, 100.0, 1e-9), 20.0);
    double worst = 0.0;
    const Eigen::Matrix3Xd p = simulation.positions_W();
    for (Eigen::Index i = 0; i < 3; ++i) {
      const double exact = radius * (1.0 + strain * std::cos(20.0 * omega));
      worst = std::max(worst, std::abs(p.col(i).norm() - exact));
    }
    std::printf("strain %g: off by %.1e of the amplitude after %.0f rad\n", strain, worst / (strain * radius),
                20.0 * omega);
    EXPECT_LT(worst, 2e-9 * strain * radius + 2e-14);
  }
}

TEST(Points, FrameModesAndLoadsAgreeWithThoseOfTheStepOnModes) {
  Scene scene = boxed_truss(0.5, 10.0);
  for (std::size_t k = 0; k < scene.links.size(); ++k) scene.publication.links.push_back(static_cast<int>(k));
  scene.gravity = {0.1, -0.2, 0.3};
  scene.initial.position = {1e3, -2e3, 5e2};
  scene.initial.velocity = {3.0, 2.0, -1.0};
  const Simulation points = run_for(by_points(scene, 1000.0, 1e-9), 0.5),
                   modes = run_for(by_modes(scene, 8000.0), 0.5);
  const auto expect_near = [](const Vec3& a, const Vec3& b, double bound, const char* what) {
    EXPECT_LT(length(sub(a, b)), bound) << what;
  };
  // displacements are some 3e-5 m; the step on modes at 8 kHz is good to 1e-8 of them
  expect_near(points.state.p_WB, modes.state.p_WB, 1e-11, "position");
  expect_near(points.state.v_WB, modes.state.v_WB, 1e-11, "velocity");
  expect_near(points.state.H_W, modes.state.H_W, 1e-9, "angular momentum");
  expect_near(points.state.coupled.w_B, modes.state.coupled.w_B, 1e-10, "angular velocity");
  double sign = 0.0, off = 0.0;
  for (std::size_t a = 0; a < 4; ++a) sign += points.state.q_WB[a] * modes.state.q_WB[a];
  for (std::size_t a = 0; a < 4; ++a)
    off = std::max(off, std::abs(points.state.q_WB[a] - (sign < 0.0 ? -1.0 : 1.0) * modes.state.q_WB[a]));
  EXPECT_LT(off, 1e-11) << "attitude";
  const auto relative = [](const Array& a, const Array& b) {
    double difference = 0.0, size = 0.0;
    for (std::size_t l = 0; l < a.size(); ++l)
      difference += (a[l] - b[l]) * (a[l] - b[l]), size += b[l] * b[l];
    return std::sqrt(difference / size);
  };
  EXPECT_LT(relative(points.state.q, modes.state.q), 1e-7);
  EXPECT_LT(relative(points.state.q_dot, modes.state.q_dot), 1e-7);
  EXPECT_LT(relative(points.state.coupled.momentum, modes.state.coupled.momentum), 1e-7);
  const Eigen::VectorXd forces = points.link_forces(), others = modes.link_forces();
  EXPECT_LT((forces - others).norm(), 1e-7 * others.norm());
  EXPECT_NEAR(energy_of(points), energy_of(modes), 1e-10 * energy_of(modes));
  for (const int i : {0, 7, 19}) {
    const PointState a = read_point(points.plan, points.state, i), b = read_point(modes.plan, modes.state, i);
    expect_near(a.p_W, b.p_W, 1e-11, "point");
    expect_near(a.v_W, b.v_W, 1e-9, "velocity of a point");
    expect_near(a.a_W, b.a_W, 1e-6, "acceleration of a point");
    expect_near(a.V_B, b.V_B, 1e-11, "displacement of a point");
  }
}

TEST(Points, DampedSpringsAreExtrapolatedToTheAccuracy) {
  constexpr double kEnd = 0.5;
  Scene scene = boxed_truss(0.5, 10.0);
  for (std::size_t k = 0; k < 8; ++k) {
    Link link;
    link.points = {static_cast<int>(2 * k), static_cast<int>(2 * k + 5)};
    link.kind = Dashpot{k == 3 ? 300.0 : 5.0};
    scene.links.push_back(link);
  }
  scene.damping.beta = 1e-5;
  const Truth truth = truth_of(scene, kEnd);
  for (const double rate : {100.0, 1000.0})
    for (const double accuracy : {1e-3, 1e-5, 1e-7}) {
      const Simulation simulation = run_for(by_points(scene, rate, accuracy), kEnd);
      const PlanPoints& method = simulation.plan.points_method;
      const double error = errors_of(simulation, truth).elastic;
      std::printf("%5g Hz, accuracy %.0e: %3d steps of %d columns, elastic error %.1e\n", rate, accuracy,
                  method.pieces, method.columns, error);
      EXPECT_LT(error, accuracy + 5e-8);
    }
}

/// Returns random commands on random points and in random axes, each with the tick at which it is sent.
std::vector<std::pair<std::int64_t, ForceCommand>> random_commands(std::uint64_t seed, std::int64_t ticks) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<std::pair<std::int64_t, ForceCommand>> commands;
  for (std::int64_t tick = 0; tick < ticks; tick += static_cast<std::int64_t>(random() % 60)) {
    ForceCommand command = make_command(
        static_cast<int>(random() % 3), static_cast<std::int64_t>(commands.size() + 1),
        random() % 2 == 0 ? Axes::kWorld : Axes::kBody, static_cast<std::int64_t>(1 + random() % 40));
    add_force(command, static_cast<int>(random() % 20), {normal(random), normal(random), normal(random)});
    commands.emplace_back(tick, command);
  }
  return commands;
}

State run_with(const Plan& plan, const std::vector<std::pair<std::int64_t, ForceCommand>>& commands,
               std::int64_t ticks, std::uint64_t reads) {
  Motion motion(plan, kMotionAlone);
  std::size_t next = 0;
  std::vector<ForceCommand> now;
  std::mt19937_64 random(reads);
  double sum = 0.0;
  for (std::int64_t tick = 0; tick < ticks; ++tick) {
    now.clear();
    for (; next < commands.size() && commands[next].first == tick; ++next)
      now.push_back(commands[next].second);
    EXPECT_EQ(motion.advance(now).status, StepStatus::kOk);
    if (reads == 0) continue;
    const std::uint64_t kind = random() % 4;
    if (kind == 0) sum += motion.state().q[0];
    if (kind == 1) sum += motion.points().x[0];
    if (kind == 2) sum += read_point(plan, motion.state_of_points(), 3).p_W[0];
  }
  EXPECT_TRUE(std::isfinite(sum));
  return motion.state();
}

TEST(Points, CommandsAtAnyTickActAsInCartesianPoints) {
  Scene scene = boxed_truss(0.3, 0.0);
  constexpr std::int64_t kTicks = 600;
  const Plan plan = plan_of(by_points(scene, 1000.0, 1e-8));
  const Plan modes = plan_of(by_modes(scene, 1000.0));
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const auto commands = random_commands(seed, kTicks);
    const State a = run_with(plan, commands, kTicks, 0), b = run_with(modes, commands, kTicks, 0);
    double difference = 0.0, size = 0.0;
    for (std::size_t l = 0; l < a.q.size(); ++l)
      difference += (a.q[l] - b.q[l]) * (a.q[l] - b.q[l]), size += b.q[l] * b.q[l];
    std::printf("%zu commands in %lld ticks: elastic difference to the step on modes %.1e\n", commands.size(),
                static_cast<long long>(kTicks), std::sqrt(difference / size));
    // the step on modes has order 4, and errors of 1e-6 at 1 kHz
    EXPECT_LT(std::sqrt(difference / size), 1e-5);
    EXPECT_LT(length(sub(a.p_WB, b.p_WB)), 1e-9);
  }
}

TEST(Points, ReadingAndCopyingChangeNoBit) {
  constexpr std::int64_t kTicks = 400;
  for (const double rate : {1000.0, 10'000.0}) {
    const Plan plan = plan_of(by_points(boxed_truss(0.3, 1.0), rate));
    const auto commands = random_commands(7, kTicks);
    const State once = run_with(plan, commands, kTicks, 0);
    for (const std::uint64_t reads : {1U, 2U}) {
      const State often = run_with(plan, commands, kTicks, reads);
      EXPECT_EQ(static_cast<const MotionState&>(once), often);
    }
    std::string error;
    const std::optional<Plan> read = plan_from_bytes(plan_to_bytes(plan), error);
    ASSERT_TRUE(read.has_value()) << error;
    EXPECT_EQ(static_cast<const MotionState&>(once), run_with(*read, commands, kTicks, 1));
    Motion motion(plan, kMotionAlone);
    for (int k = 0; k < 50; ++k) motion.advance();
    Motion copy(motion);
    for (int k = 0; k < 50; ++k) motion.advance(), copy.advance();
    EXPECT_EQ(static_cast<const MotionState&>(motion.state()), copy.state());
    motion.reset();
    Motion fresh(plan, kMotionAlone);
    for (int k = 0; k < 80; ++k) motion.advance(), fresh.advance();
    EXPECT_EQ(motion.state().q, fresh.state().q);
  }
}

TEST(Points, LoadsOfEveryKindActAsInTheStepOnModes) {
  Scene scene = boxed_truss(0.3, 0.0);
  scene.loads.clear();
  Group group;
  group.name = "end";
  group.points = {16, 17, 18, 19};
  scene.groups.push_back(group);
  const auto add = [&](const char* name, History history, Axes axes) -> Load& {
    Load load;
    load.name = name;
    load.history = std::move(history);
    load.axes = axes;
    return scene.loads.emplace_back(load);
  };
  add("steady", ConstantHistory{}, Axes::kBody).forces.push_back({3, {1.0, -2.0, 0.5}});
  add("sine", SineHistory{17.3, 0.2}, Axes::kWorld).forces.push_back({12, {0.0, 5.0, 1.0}});
  add("table", TableHistory{{0.0, 0.05, 0.21}, {0.0, 1.0, -1.0}}, Axes::kWorld)
      .forces.push_back({8, {3.0, 0.0, 0.0}});
  add("pulse", PulseHistory{0.1, 0.03}, Axes::kWorld).forces.push_back({18, {0.0, 0.0, 10.0}});
  add("torque", ConstantHistory{}, Axes::kWorld).wrenches.push_back({0, {0.0, 0.0, 1.0}, {0.0, 0.5, 2.0}});
  const Simulation points = run_for(by_points(scene, 1000.0, 1e-9), 0.4),
                   modes = run_for(by_modes(scene, 4000.0), 0.4);
  const double error = elastic_error(elastic_of(scene, points), elastic_of(scene, modes));
  std::printf("elastic difference to the step on modes at 4 kHz %.1e, position %.1e m\n", error,
              length(sub(points.state.p_WB, modes.state.p_WB)));
  EXPECT_LT(error, 1e-7);
  EXPECT_LT(length(sub(points.state.p_WB, modes.state.p_WB)), 1e-9);
}

TEST(Points, AStepThatFailsLeavesTheMotionAsItWas) {
  const Plan plan = plan_of(by_points(boxed_truss(0.3, 1.0), 1000.0));
  for (const int before : {0, 3, 150}) {
    Motion motion(plan, kMotionAlone), other(plan, kMotionAlone);
    for (int k = 0; k < before; ++k) motion.advance(), other.advance();
    const State then = motion.state();
    ForceCommand command = make_command(0, 1);
    add_force(command, 3, {1e300, 1e300, 0.0});
    EXPECT_EQ(motion.advance({&command, 1}).status, StepStatus::kNotFinite);
    EXPECT_EQ(motion.tick(), before);
    const State& now = motion.state();
    EXPECT_EQ(now.q_WB, then.q_WB);
    EXPECT_EQ(now.q, then.q);
    EXPECT_EQ(now.p_WB, then.p_WB);
    for (int k = 0; k < 200; ++k) {
      ASSERT_EQ(motion.advance().status, StepStatus::kOk);
      other.advance();
    }
    double difference = 0.0, size = 0.0;
    for (std::size_t l = 0; l < now.q.size(); ++l) {
      const double a = motion.state().q[l], b = other.state().q[l];
      difference += (a - b) * (a - b), size += b * b;
    }
    EXPECT_LT(std::sqrt(difference / size), 1e-6) << "the motion goes on from another state";
  }
}

// At strains of 4 % the modes of a vibration couple so strongly that the roots of the method that are no
// vibrations would grow; the step finds that and starts again, also within a tick of 33,000 steps.
TEST(Points, LargeStrainsDoNotGrow) {
  constexpr double kDisplacement = 0.05;  // [m] of points that are 1 m apart
  Scene scene = boxed_truss(0.0, 0.0);
  scene.loads.clear();
  std::mt19937_64 engine(1);
  for (int i = 0; i < 20; ++i) {
    Eigen::Vector3d u;
    for (double& value : u)
      value = kDisplacement * (2.0 * std::ldexp(static_cast<double>(engine() >> 11), -53) - 1.0);
    scene.initial.points.push_back({i, u, Eigen::Vector3d::Zero()});
  }
  for (const double rate : {1000.0, 1.0, 0.05}) {
    Simulation simulation(by_points(scene, rate, 1e-3));
    const double energy = energy_of(simulation);
    double worst = 0.0;
    const long many = std::max(1L, std::lround(0.5 * rate));
    for (long tick = 0; tick < std::lround(100.0 * rate); tick += many) {
      simulation.run(many);
      worst = std::max(worst, std::abs(energy_of(simulation) / energy - 1.0));
    }
    std::printf("%g Hz, %d steps in a tick: energy %.3g J, largest change within 100 s %.1e\n", rate,
                simulation.plan.points_method.steps, energy, worst);
    EXPECT_LT(worst, 2e-2);
  }
}

// The sign of the quaternion follows the rotation, also by 3 rad within a tick.
TEST(Points, QuaternionsHaveTheSignOfTheStepOnModes) {
  for (const double rate : {5.0, 1000.0}) {
    Scene scene = boxed_truss(0.0, 1.0);
    scene.initial.angular_velocity = {0.0, 0.0, 15.0};
    const Simulation points = run_for(by_points(scene, rate), 2.0),
                     modes = run_for(by_modes(scene, 1000.0), 2.0);
    double product = 0.0;
    for (std::size_t k = 0; k < 4; ++k) product += points.state.q_WB[k] * modes.state.q_WB[k];
    EXPECT_NEAR(product, 1.0, 1e-6) << rate;
  }
}

// A square without diagonals folds onto a line, where the frame is nearly undetermined.
TEST(Points, TheFrameOfAFoldedMechanismHasNoMeanRotation) {
  Scene scene;
  const Eigen::Vector3d corners[] = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {1.0, 1.0, 0.0}, {0.0, 1.0, 0.0}};
  const double masses[] = {1.0, 2.0, 1.5, 1.0};
  for (int i = 0; i < 4; ++i) add_point(scene, masses[i], corners[i]);
  for (int i = 0; i < 4; ++i) add_link(scene, i, (i + 1) % 4, Spring{1000.0});
  scene.initial.angular_velocity = {0.1, 0.0, 3.0};
  Load load;
  load.forces = {{2, {1.0, 2.0, 0.5}}};
  load.history = PulseHistory{0.0, 0.1};
  scene.loads = {load};
  Simulation simulation(by_points(scene, 100.0));
  double worst = 0.0;
  for (int tick = 0; tick < 1000; ++tick) {
    simulation.run(1);
    const Mat3 R = rotation_matrix(simulation.state.q_WB);
    Vec3 sum{};
    for (std::size_t i = 0; i < 4; ++i)
      sum = add_scaled(sum, masses[i],
                       cross(simulation.plan.points[i].r,
                             multiply_transposed(R, of_point(simulation.state.points.x.data(), i))));
    worst = std::max(worst, length(sum));
  }
  EXPECT_LT(worst, 1e-8);
}

TEST(Points, EnergyAndMomentaAreKeptOverAMillionTicks) {
  const Plan plan = plan_of(by_points(boxed_truss(0.5, 10.0), 1000.0, 1e-3));
  Motion motion(plan, kMotionAlone);
  const auto run = [&](int ticks) {
    for (int k = 0; k < ticks; ++k) ASSERT_EQ(motion.advance().status, StepStatus::kOk);
  };
  const auto energy = [&] {
    const Invariants now = read_invariants(plan, motion.state());
    return now.kinetic_rigid + now.kinetic_elastic + now.potential;
  };
  run(100);
  const Vec3 H = motion.state().H_W, v = motion.state().v_WB;
  const double start = energy();
  run(1'000'000);
  const double off = length(sub(motion.state().H_W, H)) / length(H),
               v_off = length(sub(motion.state().v_WB, v)) / length(v), energy_off = energy() / start - 1.0;
  std::printf("angular momentum off by %.1e, velocity by %.1e, energy by %.1e\n", off, v_off, energy_off);
  EXPECT_LT(off, 1e-9);
  EXPECT_LT(v_off, 1e-12);
  EXPECT_NEAR(energy_off, 0.0, 1e-8);
}

TEST(Points, ArePreferredWhereTheyAreCheaper) {
  const auto integrates = [](Scene scene, double rate) {
    scene.fidelity = Fidelity::kCorotational;
    scene.rate = rate;
    const Plan plan = plan_of(scene);
    EXPECT_EQ(plan.integration.why_modes.empty(), integrates_points(plan));
    return integrates_points(plan);
  };
  Scene scene = boxed_truss(0.0, 1.0);
  EXPECT_TRUE(integrates(scene, 1000.0));
  EXPECT_FALSE(integrates(scene, 1.0)) << "a tick of 1 s has 2000 steps";
  Scene stiff = scene;
  for (std::size_t k = 0; k < stiff.links.size(); k += 2) stiff.links[k].kind = Spring{1e9};
  EXPECT_FALSE(integrates(stiff, 1000.0));
  Scene damped = scene;
  damped.damping.modal_ratio = 0.01;
  EXPECT_FALSE(integrates(damped, 1000.0));
  Scene tiny = boxed_truss(0.0, 1e-6);
  EXPECT_FALSE(integrates(tiny, 1000.0))
      << "rounding errors of positions would be a tenth of the displacement";
  Scene dashpots = scene;
  for (std::size_t k = 0; k < scene.links.size(); k += 5)
    add_link(dashpots, scene.links[k].points[0], scene.links[k].points[1], Dashpot{1e4});
  EXPECT_TRUE(integrates(dashpots, 1000.0)) << "the stages on modes need a higher rate";
}

TEST(Points, AreJudgedOnTheRungFullWhereModesNeedAHigherRate) {
  Scene scene = boxed_truss(0.0, 1.0);
  for (std::size_t k = 0; k < scene.links.size(); k += 5)
    add_link(scene, scene.links[k].points[0], scene.links[k].points[1], Dashpot{1e3});
  scene.fidelity = Fidelity::kCorotational;
  scene.rate = 1000.0;
  Faults faults;
  const std::optional<Plan> plan = make_plan(scene, build(scene), faults);
  ASSERT_TRUE(plan && integrates_points(*plan));
  ASSERT_FALSE(plan->verdict.shadows.empty()) << plan->verdict.shared_text;
  EXPECT_EQ(plan->verdict.shadows.front().plan.fidelity, Fidelity::kFull) << "it divides the tick";
  Motion motion(*plan);
  for (int k = 0; k < 100; ++k) motion.advance();
  EXPECT_EQ(motion.verdict().tick, 100);
  EXPECT_EQ(motion.verdict().level, Verdict::Level::kGood);
}

TEST(Points, AreRefusedInScenesThatCannotHaveThem) {
  Scene damped = by_points(boxed_truss(0.0, 1.0), 1000.0);
  damped.damping.modal_ratio = 0.01;
  EXPECT_EQ(refusal_of(damped),
            "integration: points cannot be integrated, because the scene has damping of modes or of the "
            "mass, or its links "
            "have the same viscous damping, which damps modes; write by: modes, or leave integration out");
  Scene table = by_points(boxed_truss(0.0, 1.0), 1000.0);
  table.loads[0].history = TableHistory{{0.0, 0.0105}, {0.0, 1.0}};
  EXPECT_NE(refusal_of(table).find("the table of load 'push' bends between two ticks"), std::string::npos);
}

}  // namespace
}  // namespace freeflex::testing
