// The shadow of a motion: it does not change the motion, starts and restarts from the state, receives the
// loads of the motion, and does not depend on how the plan of the motion was reduced (THEORY section 15).
#include "core/error/shadow.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "core/plan/make_plan.hpp"
#include "core/plan/rungs/rates.hpp"
#include "tests/motion/verdict_truth.hpp"
#include "tests/motion/watched.hpp"

namespace freeflex::testing {
namespace {

using Level = Verdict::Level;
using Cause = Verdict::Cause;

ForceCommand push(double force, std::int64_t ticks, Axes axes = Axes::kWorld) {
  ForceCommand command = make_command(0, 1, axes, ticks);
  add_force(command, 18, {0.0, 0.0, force});
  return command;
}

void expect_same(const Verdict& a, const Verdict& b) {
  EXPECT_EQ(a.tick, b.tick);
  EXPECT_EQ(a.level, b.level);
  EXPECT_EQ(a.error.deformation, b.error.deformation);
  EXPECT_EQ(a.error.position, b.error.position);
  EXPECT_EQ(a.error.attitude, b.error.attitude);
  EXPECT_EQ(a.own_error, b.own_error);
  EXPECT_EQ(a.scale, b.scale);
}
void expect_near(const MotionError& a, const MotionError& b, double share) {
  constexpr double kRounding = 1e-15;  // [m], [rad]
  EXPECT_NEAR(a.deformation, b.deformation, share * b.deformation + kRounding);
  EXPECT_NEAR(a.position, b.position, share * b.position + kRounding);
  EXPECT_NEAR(a.attitude, b.attitude, share * b.attitude + kRounding);
}
void print(const char* what, const Verdict& verdict) {
  std::printf("%-34s %.4e of %.2e m, %.4e m, %.4e rad, %s\n", what, verdict.error.deformation, verdict.scale,
              verdict.error.position, verdict.error.attitude, name_of(verdict.level));
}

/// Returns eleven points of 1 kg on ten beams of 1 m. The lowest bending mode is at 8.785 rad/s. Each bending
/// mode has another of the same frequency.
Scene straight_beam() {
  Scene scene;
  for (int k = 0; k <= 10; ++k) add_point(scene, 1.0, {1.0 * k, 0.0, 0.0});
  for (int k = 0; k < 10; ++k)
    add_link(
        scene, {k, k + 1},
        Beam{.EA = 1e7, .GJ = 2000.0, .EI_y = 2200.0, .EI_z = 2200.0, .y_axis = Eigen::Vector3d::UnitY()});
  scene.rate = 500.0;
  publish_everything(scene);
  return scene;
}

TEST(Shadow, ChangesNoBitOfTheMotion) {
  for (const Fidelity rung :
       {Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled, Fidelity::kCorotational}) {
    Watched watched(watched_truss(rung, 0.05));
    Motion alone(watched.plan, kMotionAlone);
    for (int tick = 0; tick < 200; ++tick) {
      const ForceCommand command = push(5.0 * tick, 7);
      const std::span<const ForceCommand> commands(&command, tick % 5 == 0 ? 1U : 0U);
      watched.motion.advance(commands);
      alone.advance(commands);
    }
    EXPECT_GT(watched.motion.verdict().tick, 190);
    EXPECT_EQ(static_cast<const MotionState&>(watched.state()),
              static_cast<const MotionState&>(alone.state()))
        << name_of(rung);
  }
}

TEST(Shadow, TheDistanceIsZeroAtTheStart) {
  for (const Fidelity rung : {Fidelity::kRigid, Fidelity::kSeparated, Fidelity::kSpinLoaded,
                              Fidelity::kCoupled, Fidelity::kCorotational, Fidelity::kFull}) {
    Scene scene = watched_truss(rung, 10.0);
    if (rung != Fidelity::kRigid) scene.initial.points = {{18, {0.0, 1e-3, -1e-3}, {0.1, 0.0, 0.0}}};
    const Watched watched(scene);
    freeflex::Shadow shadow(watched.plan, watched.plan.verdict.shadows.front(), false);
    EXPECT_TRUE(shadow.take(watched.state()));
    EXPECT_EQ(shadow.error().deformation, 0.0) << name_of(rung);
    EXPECT_EQ(shadow.error().position, 0.0);
    EXPECT_EQ(shadow.error().attitude, 0.0);
  }
}

// A distance of zero at the start says nothing about the first ticks, so they are not called good.
TEST(Shadow, NothingIsJudgedBeforeItsFirstStep) {
  for (const Fidelity rung : {Fidelity::kRigid, Fidelity::kSeparated, Fidelity::kFull}) {
    Scene scene = watched_truss(rung, 10.0);
    scene.rate = 4000.0;
    Watched watched(scene);
    const std::int64_t first = watched.plan.verdict.shadows.front().ticks;
    for (std::int64_t tick = 0; tick < 2 * first; ++tick) {
      EXPECT_EQ(watched.motion.verdict().tick, tick < first ? -1 : first) << name_of(rung);
      if (tick == 0) {
        EXPECT_EQ(describe(watched.plan, watched.motion.verdict()), "not judged (no tick is judged yet)");
      }
      watched.motion.advance();
    }
    watched.motion.reset();
    EXPECT_EQ(watched.motion.verdict().tick, -1);
  }
}

// The state of a rigid rung does not show the initial displacements, but the shadow does.
TEST(Shadow, StartsFromTheInitialStateThatThePlanOmits) {
  Scene scene = watched_truss(Fidelity::kRigid, 10.0, 0.0);
  scene.loads.clear();
  scene.initial.points = {{18, {0.0, 0.0, 1e-6}, Eigen::Vector3d::Zero()}};
  const Verdict verdict = Watched(scene).motion.verdict();
  Scene elastic = scene;
  elastic.fidelity = Fidelity::kSeparated;
  const Watched separated(elastic);
  freeflex::Shadow shadow(separated.plan, separated.plan.verdict.shadows.front(), false);
  shadow.take(separated.state());
  EXPECT_EQ(verdict.error.deformation, shadow.displacement_of_state());
  EXPECT_EQ(verdict.cause, Cause::kRigid);
}

// The end of a horizon loses nothing of the error. The motion is not damped, so no error decays.
TEST(Shadow, TenHorizonsGiveTheEstimateOfOne) {
  Scene scene = watched_truss(Fidelity::kSeparated, 0.5, 0.2);
  scene.loads[0].axes = Axes::kBody;
  Watched ten(scene);
  scene.verdict.horizon = 10.0;
  Watched one(scene);
  scene.fidelity = Fidelity::kCorotational;
  Watched truth(scene);
  for (const double end : {0.48, 0.52, 1.6, 3.2, 4.8}) {
    const Verdict &of_ten = ten.run_to(end), &of_one = one.run_to(end);
    truth.run_to(end);
    const double error = distance_between(scene, one, truth);
    print("ten horizons", of_ten);
    print("one horizon", of_one);
    EXPECT_NEAR(of_one.error.deformation, error, 0.01 * error);
    EXPECT_NEAR(of_ten.error.deformation, of_one.error.deformation, 0.01 * of_one.error.deformation);
    expect_near(of_ten.error, of_one.error, 0.2);  // measured 15 % of the attitude after 4.8 s
  }
}

TEST(Shadow, AfterAResetTheEstimateIsThatOfANewMotion) {
  Watched watched(watched_truss(Fidelity::kSeparated, 0.05)),
      fresh(watched_truss(Fidelity::kSeparated, 0.05));
  const ForceCommand before = push(50.0, 1000), command = push(20.0, 33);
  watched.run(101, std::span(&before, 1));
  watched.motion.reset();
  expect_same(watched.motion.verdict(), fresh.motion.verdict());
  watched.run(120, std::span(&command, 1));
  Verdict expected = fresh.run(120, std::span(&command, 1));
  EXPECT_GT(expected.error.deformation, 0.0);
  expected.tick += 101;
  expect_same(watched.motion.verdict(), expected);
}

TEST(Shadow, ATickThatFailsDoesNotChangeTheEstimate) {
  Watched watched(watched_truss(Fidelity::kSeparated, 0.05)),
      whole(watched_truss(Fidelity::kSeparated, 0.05));
  watched.run(37), whole.run(37);
  ForceCommand huge = push(1.0, 100);
  huge.points[0].force = {1e308, 1e308, 1e308};
  EXPECT_EQ(watched.motion.advance({&huge, 1}).status, StepStatus::kNotFinite);
  expect_same(watched.motion.verdict(), whole.motion.verdict());
  watched.run(60), whole.run(60);
  expect_same(watched.motion.verdict(), whole.motion.verdict());
}

TEST(Shadow, ReceivesCommandsAsItReceivesLoads) {
  Scene scene = watched_truss(Fidelity::kSpinLoaded, 10.0, 0.1);
  scene.loads[0].forces[0].force = {0.0, 0.0, 5.0};
  Watched loaded(scene);
  scene.loads.clear();
  Watched pushed(scene);
  const ForceCommand command = push(5.0, 100);
  const Verdict &by_load = loaded.run(400), &by_command = pushed.run(400, std::span(&command, 1));
  print("command", by_command);
  EXPECT_GT(by_load.error.deformation, 0.0);
  expect_near(by_command.error, by_load.error, 1e-9);
}

// The moments of a load of size 1 between u and v are (v^(j+1) - u^(j+1)) / (j + 1). Those of the parabola
// follow from Simpson's rule and, for j = 2, from its coefficients.
TEST(ShadowLoads, AParabolaHasTheMomentsOfAPiece) {
  const std::array<double, 3> first_half = parabola_of_piece(0.0, 0.5);
  EXPECT_EQ(first_half, (std::array{1.25, 0.5, -0.25}));
  for (const auto& [u, v] : {std::pair{0.0, 1.0}, {0.0, 0.125}, {0.25, 0.75}, {0.3, 0.9}, {0.875, 1.0}}) {
    const std::array<double, 3> p = parabola_of_piece(u, v);
    // p(s) = a + b s + c s^2
    const double a = p[0], b = -3.0 * p[0] + 4.0 * p[1] - p[2], c = 2.0 * p[0] - 4.0 * p[1] + 2.0 * p[2];
    EXPECT_NEAR(a + b / 2.0 + c / 3.0, v - u, 2e-15);
    EXPECT_NEAR(a / 2.0 + b / 3.0 + c / 4.0, (v * v - u * u) / 2.0, 2e-15);
    EXPECT_NEAR(a / 3.0 + b / 4.0 + c / 5.0, (v * v * v - u * u * u) / 3.0, 2e-15);
  }
}

// The commands change at random ticks within the steps of the shadow. A load of the scene varies too.
TEST(ShadowLoads, LoadsThatChangeWithinAStepGiveTheEstimateOfStepsOfOneTick) {
  Scene scene = straight_beam();
  scene.rate = 4000.0;
  scene.verdict.horizon = 0.1;
  scene.initial.angular_velocity = {0.0, 0.0, 0.5};
  Load hum;
  hum.name = "hum";
  hum.axes = Axes::kBody;
  hum.forces = {{4, {0.0, 2.0, 0.0}}};
  hum.history = SineHistory{23.0, 0.0};
  scene.loads = {hum};
  for (int k = 0; k <= 10; ++k) scene.pushable.push_back(k);
  Watched several(scene);
  scene.verdict.step = 1.0 / scene.rate;
  Watched one(scene);
  const std::int32_t ticks = several.plan.verdict.shadows[0].ticks;
  ASSERT_EQ(ticks, 8);
  ASSERT_EQ(one.plan.verdict.shadows[0].ticks, 1);
  std::mt19937 engine(11);
  std::uniform_real_distribution<double> force(-20.0, 20.0);
  std::uniform_int_distribution<int> length(1, 13);
  double worst = 0.0, largest = 0.0;
  for (int tick = 0; tick < 1000; ++tick) {
    ForceCommand command = push(force(engine), length(engine), tick % 2 == 0 ? Axes::kWorld : Axes::kBody);
    command.points[0].point = tick % 11;
    const std::span<const ForceCommand> commands(&command, tick % 3 == 0 ? 1U : 0U);
    several.motion.advance(commands), one.motion.advance(commands);
    if (several.motion.verdict().tick != several.state().tick) continue;
    const double a = several.motion.verdict().error.deformation, b = one.motion.verdict().error.deformation;
    worst = std::max(worst, std::abs(a - b));
    largest = std::max(largest, b);
  }
  std::printf("steps of %d ticks: the estimate differs by %.1e of %.1e m from that of steps of a tick\n",
              ticks, worst, largest);
  EXPECT_GT(largest, 1e-6);
  EXPECT_LT(worst, 0.02 * largest) << "measured 0.7 %";
}

// In the horizons that are not judged the verdict is that of the last one, and the error is taken to grow as
// much in each of them. The spin changes the frequency, so the error grows steadily.
TEST(Shadow, OneHorizonInFourGivesNearlyTheEstimateOfAll) {
  Scene scene = straight_beam();
  scene.fidelity = Fidelity::kSpinLoaded;
  scene.verdict.horizon = 0.2;
  scene.initial.modes = {{1, 1e-3, 0.0}};
  scene.initial.angular_velocity = {0.0, 0.0, 0.3};
  scene.verdict.step = 1e-3;  // two steps in a tick
  Plan plan = reduced_plan_of(scene);
  Watched all(plan);
  plan.verdict.shadows[0].every = 4;
  Watched some(plan);
  const std::int64_t horizon = plan.verdict.shadows[0].horizon_ticks;
  double of_all = 0.0, of_some = 0.0;  // [m] largest estimates in the last horizon that is judged
  for (std::int64_t tick = 1; tick <= 20 * horizon; ++tick) {
    all.run(1), some.run(1);
    const std::int64_t number = (tick - 1) / horizon;
    const Verdict &a = all.motion.verdict(), &b = some.motion.verdict();
    if (number == 0) expect_same(b, a);
    EXPECT_EQ(b.tick, number % 4 == 0 ? a.tick : (number / 4 * 4 + 1) * horizon);
    if (number != 16) continue;
    of_all = std::max(of_all, a.error.deformation);
    of_some = std::max(of_some, b.error.deformation);
  }
  std::printf("one horizon in four: %.2e m, all: %.2e m\n", of_some, of_all);
  EXPECT_NEAR(of_some, of_all, 0.05 * of_all);
}

// Modes that contribute less than a tenth are omitted.
TEST(Shadow, EstimatesTheErrorOfAReducedPlan) {
  Scene scene = watched_truss(Fidelity::kSeparated, 10.0, 0.0);
  scene.loads[0].forces[0].force = {0.0, 0.0, 1e-4};
  scene.pushable.clear();
  scene.leave_out.tolerance = 0.1;
  scene.leave_out.horizon = 0.25;
  Watched reduced(scene);
  ASSERT_LT(reduced.plan.num_elastic, 54);
  scene.leave_out = {};
  scene.fidelity = Fidelity::kCorotational;
  Watched truth(scene);
  truth.run(240);
  const Verdict& verdict = reduced.run(240);
  const double error = distance_between(scene, truth, reduced);
  std::printf("%d of 54 modes: error %.2e of %.2e m, estimate %.3f of it\n", reduced.plan.num_elastic, error,
              verdict.scale, verdict.error.deformation / error);
  EXPECT_GT(error, 1e-2 * verdict.scale);
  EXPECT_NEAR(verdict.error.deformation, error, 0.02 * error);
}

// A load in an oblique direction excites one mode of each pair of equal frequency, after the pair is rotated.
// The plan has the excited mode alone.
TEST(Shadow, EstimatesTheErrorOfAPlanWithRotatedModes) {
  Scene scene = straight_beam();
  scene.initial.angular_velocity = {0.0, 0.0, 0.3};
  Load load;
  load.axes = Axes::kBody;
  load.forces = {{0, {0.0, 0.3, 0.4}}, {5, {0.0, -0.6, -0.8}}, {10, {0.0, 0.3, 0.4}}};
  load.history = PulseHistory{0.0, 0.3};
  scene.loads = {load};
  scene.pushable.clear();
  scene.leave_out.tolerance = 1e-3;
  scene.leave_out.horizon = 2.0;
  Watched rotated(scene);
  const PlanShadow& shadow = rotated.plan.verdict.shadows[0];
  ASSERT_LT(rotated.plan.num_elastic, shadow.plan.num_elastic);
  EXPECT_FALSE(shadow.modes[0].projection.empty()) << "the modes must be rotated";
  EXPECT_EQ(rotated.motion.verdict().error.deformation, 0.0);
  scene.leave_out = {};
  scene.fidelity = Fidelity::kCorotational;
  Watched truth(scene);
  for (const double end : {0.4, 2.0}) {
    truth.run_to(end);
    const Verdict& verdict = rotated.run_to(end);
    const double error = distance_between(scene, truth, rotated);
    std::printf("%d of %d modes: error %.2e of %.2e m, estimate %.3f of it\n", rotated.plan.num_elastic,
                shadow.plan.num_elastic, error, verdict.scale, verdict.error.deformation / error);
    EXPECT_NEAR(verdict.error.deformation, error, 0.02 * error);
  }
}

// The shadow of a small structure has all modes, and its true geometry.
TEST(Shadow, EstimatesTheErrorOfTheLowestModesAlone) {
  Scene scene = watched_truss(Fidelity::kSeparated, 10.0, 0.1);
  Scene all = scene;
  all.fidelity = Fidelity::kCorotational;
  scene.modes.count = 6;
  Watched few(scene), truth(all);
  ASSERT_EQ(few.plan.num_elastic, 6);
  EXPECT_EQ(few.plan.verdict.shadows[0].plan.num_elastic, 54);
  EXPECT_EQ(few.plan.verdict.shared, SharedError::kNone);
  truth.run(96);
  const Verdict& verdict = few.run(96);
  const double error = distance_between(all, truth, few);
  std::printf("6 of 54 modes: error %.2e of %.2e m, estimate %.3f of it\n", error, verdict.scale,
              verdict.error.deformation / error);
  EXPECT_GT(error, 0.02 * verdict.scale);
  EXPECT_NEAR(verdict.error.deformation, error, 0.02 * error);
}

// The shadow of a large structure has twice as many modes. What lies above them is not known.
TEST(Shadow, TheLowestModesOfALargeStructureAreAtBestWatch) {
  Scene scene;
  for (int k = 0; k < 302; ++k) add_point(scene, 1.0, {1.0 * k, 0.2 * (k % 2), 0.1 * (k % 3)});
  for (int to = 1; to < 302; ++to)
    for (int from = std::max(0, to - 4); from < to; ++from) add_link(scene, {from, to}, Spring{1e6});
  scene.modes.count = 4;
  scene.rate = 100.0;
  scene.publication.points = scene.pushable = {0};
  scene.initial.modes = {{1, 1e-4, 0.0}};
  Watched watched(scene);
  ASSERT_EQ(watched.plan.num_elastic, 4);
  EXPECT_EQ(watched.plan.verdict.shadows[0].plan.num_elastic, 8);
  const Verdict& verdict = watched.run(64);
  EXPECT_EQ(verdict.level, Level::kWatch);
  EXPECT_EQ(verdict.cause, Cause::kShared);
  EXPECT_NE(watched.text().find("only the lowest modes are kept"), std::string::npos) << watched.text();
}

TEST(Shadow, ACopyInTheMiddleOfAStepContinuesWithTheSameBits) {
  Scene scene = watched_truss(Fidelity::kSeparated, 0.05);
  scene.verdict.step = 8e-3;
  Watched whole(scene);
  ASSERT_EQ(whole.plan.verdict.shadows[0].ticks, 8);
  const ForceCommand command = push(40.0, 30);
  whole.run(50);
  whole.run(3, std::span(&command, 1));
  Motion copy(whole.motion);
  whole.run(100);
  for (int tick = 0; tick < 100; ++tick) copy.advance();
  expect_same(copy.verdict(), whole.motion.verdict());
  expect_same(copy.worst(), whole.motion.worst());
}

TEST(Shadow, IsThatOfAPlanCompiledAtTheRate) {
  Scene scene = watched_truss(Fidelity::kSpinLoaded, 2.0, 3.0);
  for (const double rate : {20.0, 250.0, 4000.0}) {
    scene.rate = 1000.0;
    Plan plan = reduced_plan_of(scene);
    set_rate(plan, rate);
    scene.rate = rate;
    Watched moved(plan), given(scene);
    const PlanShadow &a = moved.plan.verdict.shadows[0], &b = given.plan.verdict.shadows[0];
    std::printf(
        "%4.0f Hz: steps of %d ticks, %d substeps, a horizon of %lld ticks, one in %lld, delay %lld\n", rate,
        a.ticks, a.substeps, static_cast<long long>(a.horizon_ticks), static_cast<long long>(a.every),
        static_cast<long long>(a.delay_ticks));
    EXPECT_EQ(a.ticks, b.ticks);
    EXPECT_EQ(a.substeps, b.substeps);
    EXPECT_EQ(a.plan.period, b.plan.period);
    EXPECT_EQ(a.horizon_ticks, b.horizon_ticks);
    EXPECT_EQ(a.every, b.every);
    EXPECT_EQ(a.delay_ticks, b.delay_ticks);
    const auto ticks = static_cast<std::int64_t>(0.2 * rate);
    expect_same(moved.run(ticks), given.run(ticks));
  }
}

TEST(Shadow, ASceneWithoutAVerdictHasNoShadow) {
  Scene scene = watched_truss(Fidelity::kSeparated, 10.0);
  scene.verdict.is_off = true;
  Watched watched(scene);
  EXPECT_TRUE(watched.plan.verdict.shadows.empty());
  EXPECT_FALSE(watched.motion.has_verdict());
  EXPECT_EQ(watched.run(10).tick, -1);
  EXPECT_EQ(describe(watched.plan, watched.motion.verdict()), "not judged (the scene has verdict: off)");
}

TEST(Shadow, StopsIfItsMotionBecomesInfinite) {
  Scene scene = watched_truss(Fidelity::kSeparated, 10.0, 0.0);
  // The forces have no moment, so the body keeps its attitude. The bars become so long that the square of
  // their length overflows.
  scene.loads[0].forces = {{18, {1e120, 0.0, 0.0}}, {14, {-1e120, 0.0, 0.0}}};
  Watched watched(scene);
  const Verdict& verdict = watched.run(50);
  EXPECT_EQ(verdict.level, Level::kOutside);
  EXPECT_EQ(verdict.cause, Cause::kLost);
  EXPECT_EQ(verdict.stopped, StepStatus::kNotFinite);
  EXPECT_NE(watched.text().find("it became infinite"), std::string::npos) << watched.text();
}

// The rung `full` divides the tick where damping is too fast for the steps of `corotational`.
TEST(Shadow, IsOnTheRungFullIfDampingIsTooFastForCorotational) {
  Scene scene;
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(0.0, 0.0, 0.0), Eigen::Vector3d(1.0, 0.0, 0.0),
                                    Eigen::Vector3d(0.2, 0.9, 0.0), Eigen::Vector3d(0.3, 0.3, 0.8)})
    add_point(scene, 1.0, at);
  join_all(scene, 400.0);
  add_link(scene, 0, 1, Dashpot{2e4});
  publish_everything(scene);
  scene.initial.points = {{2, {0.0, 1e-5, 0.0}, Eigen::Vector3d::Zero()}};
  scene.rate = 1000.0;
  Watched watched(scene);
  ASSERT_EQ(watched.plan.verdict.shadows.size(), 1U) << watched.plan.verdict.shared_text;
  EXPECT_EQ(watched.plan.verdict.shadows[0].plan.fidelity, Fidelity::kFull);
  EXPECT_EQ(watched.plan.verdict.shared, SharedError::kNone);
  EXPECT_EQ(watched.run(64).level, Level::kGood) << watched.text();
}

// Points on a line do not tell how a matrix turns about the line, so no rung with true geometry supports a
// matrix that is not the same in all directions across the line.
TEST(Shadow, AMotionThatNoRungWithTrueGeometrySupportsIsAtBestWatch) {
  Scene scene = straight_beam();
  for (Link& link : scene.links) std::get<Beam>(link.kind).EI_z = 3000.0;
  scene.publication.links.clear();
  scene = as_matrix(scene);
  scene.initial.modes = {{1, 1e-5, 0.0}};
  Watched watched(scene);
  ASSERT_FALSE(watched.plan.verdict.shadows.empty());
  EXPECT_EQ(watched.plan.verdict.shadows[0].plan.fidelity, Fidelity::kCoupled);
  EXPECT_EQ(watched.plan.verdict.shared, SharedError::kRung);
  const Verdict& verdict = watched.run(500);
  EXPECT_EQ(verdict.level, Level::kWatch) << watched.text();
  EXPECT_EQ(verdict.cause, Cause::kShared);
  EXPECT_EQ(
      watched.text().find("no rung with true geometry supports the scene, so second-order terms of links "
                          "are not judged (link 'K': its points are on a line"),
      0U)
      << watched.text();
}

// Rounding errors of a body that has come to rest are not judged.
TEST(Scale, ABodyThatHasCalmedIsGood) {
  Scene scene = straight_beam();
  scene.damping.modal_ratio = 0.2;
  scene.initial.modes = {{1, 1e-3, 0.0}, {4, 1e-3, 0.0}};
  Watched watched(scene);
  for (const double end : {1.0, 5.0, 10.0, 14.0}) {
    const Verdict& verdict = watched.run_to(end);
    print("calming", verdict);
    EXPECT_EQ(verdict.level, Level::kGood) << watched.text();
  }
  EXPECT_LT(watched.motion.verdict().displacement_now, 1e-13);
  EXPECT_NEAR(watched.motion.verdict().scale, 1e-9 * 5.0, 1e-15);
}

// The peak decays as the slowest mode. After a large motion has decayed, errors are compared with the motion
// that remains.
TEST(Scale, DecaysAsTheSlowestMode) {
  Scene scene = straight_beam();
  scene.damping.modal_ratio = 0.02;
  scene.initial.modes = {{1, 1e-3, 0.0}};
  Watched watched(scene);
  freeflex::Shadow shadow(watched.plan, watched.plan.verdict.shadows.front(), false);
  shadow.take(watched.state());
  const double start = shadow.displacement_of_state(), decay = 0.02 * 8.785;
  for (const double end : {1.0, 4.0, 20.0}) {
    const double scale = watched.run_to(end).scale,
                 lag = static_cast<double>(watched.plan.verdict.shadows[0].ticks) * watched.plan.period;
    EXPECT_LT(scale, start * std::exp(-decay * (end - 2.0 * lag)));
    EXPECT_GT(scale, 0.99 * start * std::exp(-decay * end));
  }
}

// The rung `separated` omits the centrifugal displacement, some w^2 / omega_1^2 of the size. It is judged
// only if it is more than 2e-11 of the size.
TEST(Scale, ASpinningBodyAtRestIsJudgedAboveAFloor) {
  for (const double spin : {1e-6, 1e-3}) {
    Scene scene = boxed_truss(spin, 0.0);
    scene.loads.clear();
    Watched watched(scene);
    const Verdict& verdict = watched.run(400);
    print("spinning at rest", verdict);
    EXPECT_EQ(verdict.displacement_now, 0.0);
    EXPECT_EQ(verdict.level == Level::kGood, spin < 1e-5) << watched.text();
  }
}

// A pair of forces F along a beam that is given as a matrix may change the stiffness of its lowest mode by
// the share 2 F / (M r omega_1^2), and the phase by half of this share per radian. The spin may change it by
// w^2 / omega_1^2   (THEORY 15.12).
TEST(Inside, ForcesAndSpinAreCountedAgainstTheStiffnessOfAMatrix) {
  const auto level_of = [](double share_of_force, double share_of_spin, double end) {
    Scene scene = straight_beam();
    scene.fidelity = Fidelity::kCoupled;
    constexpr double kLowest = 8.785, kMass = 11.0, kSize = 5.0;
    const double force = 0.5 * share_of_force * kLowest * kLowest * kMass * kSize;
    Load load;
    load.axes = Axes::kBody;
    load.forces = {{0, {force, 0.0, 0.0}}, {10, {-force, 0.0, 0.0}}};
    scene.loads = {load};
    scene.publication.links.clear();
    scene = as_matrix(scene);
    scene.initial.modes = {{1, 1e-4, 0.0}};
    scene.initial.angular_velocity = {0.0, 0.0, std::sqrt(share_of_spin) * kLowest};
    scene.tolerance = 1e-3;
    Watched watched(scene);
    EXPECT_EQ(watched.plan.verdict.shared, SharedError::kInside);
    const Verdict& verdict = watched.run_to(end);
    std::printf("shares %g by forces and %g by spin, %.1f s: %s\n", share_of_force, share_of_spin, end,
                describe(watched.plan, verdict).c_str());
    EXPECT_EQ(verdict.cause, verdict.level == Level::kGood ? Cause::kNone : Cause::kShared);
    return verdict.level;
  };
  EXPECT_EQ(level_of(0.0, 0.0, 8.0), Level::kGood);
  // the sudden force also makes the beam vibrate along its line
  EXPECT_EQ(level_of(0.01, 0.0, 0.016), Level::kGood);
  EXPECT_EQ(level_of(0.025, 0.0, 0.016), Level::kWatch);
  EXPECT_EQ(level_of(0.0, 0.025, 0.016), Level::kWatch);
  // after 1 s the phase may be shifted by 0.01 * 8.785 / 2
  EXPECT_EQ(level_of(0.01, 0.0, 1.0), Level::kWatch);
}

// A beam that is given as a matrix may become stiffer by its own bow, and by the tension of a higher mode.
// With the size r of 5 m, a bow of 0.4 m counts as 5 (0.4 / r)^2 = 0.032, and mode 3, whose omega^2 is 7.6
// times that of mode 1, as 0.2 * 7.6 * 0.08 / r = 0.024   (THEORY 15.12).
TEST(Inside, BowAndVibrationAreCountedAgainstTheStiffnessOfAMatrix) {
  const auto level_of = [](int mode, double amplitude) {
    Scene scene = straight_beam();
    scene.fidelity = Fidelity::kCoupled;
    scene.publication.links.clear();
    scene = as_matrix(scene);
    scene.initial.modes = {{mode, amplitude, 0.0}};
    Watched watched(scene);
    const Verdict& verdict = watched.run_to(0.016);
    EXPECT_EQ(verdict.cause, verdict.level == Level::kGood ? Cause::kNone : Cause::kShared);
    return verdict.level;
  };
  EXPECT_EQ(level_of(1, 0.08), Level::kGood);
  EXPECT_EQ(level_of(1, 0.4), Level::kWatch);
  EXPECT_EQ(level_of(3, 0.02), Level::kGood);
  EXPECT_EQ(level_of(3, 0.08), Level::kWatch);
}

// A plate of two layers, with twice its 100 modes, was measured.
TEST(Shadow, TheTimeOfAStepContainsThePointsOfALargeStructure) {
  StepPlan plan;
  plan.num_elastic = 200;
  plan.coupled.num_substeps = 1;
  plan.points.resize(100'000);
  plan.coupled.kinetics.form = PlanKinetics::Form::kTables;
  constexpr double kMeasured = 1.9e-3;  // [s]
  EXPECT_GT(seconds_of_step(plan), 0.5 * kMeasured);
  EXPECT_LT(seconds_of_step(plan), 2.0 * kMeasured);
}

}  // namespace
}  // namespace freeflex::testing
