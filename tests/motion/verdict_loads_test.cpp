// The verdict sees loads that the ticks do not resolve, loads in horizons that are not judged, and vibrations
// that the shadow does not resolve. Its scale is the displacement of recent time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/plan/explain.hpp"
#include "tests/motion/verdict_cases.hpp"
#include "tests/motion/watched.hpp"

namespace freeflex::testing {
namespace {

using Level = Verdict::Level;
using Cause = Verdict::Cause;

constexpr double kStiffness = 6.5;

// Returns two points of 1 kg, 1 m apart in a direction, on a spring.
Scene pair_along(const Eigen::Vector3d& direction) {
  Scene scene;
  add_point(scene, 1.0, Eigen::Vector3d::Zero());
  add_point(scene, 1.0, direction.normalized());
  add_link(scene, 0, 1, Spring{kStiffness});
  publish_everything(scene);
  scene.rate = 100.0;
  return scene;
}

void add_load(Scene& scene, double force, const History& history) {
  Load load;
  load.name = "load " + std::to_string(scene.loads.size());
  load.forces = {{1, {force, 0.0, 0.0}}};
  load.history = history;
  scene.loads.push_back(load);
}

// Returns the elongation by a pulse of 1 N on one point, on or after its end. The reduced mass is 1/2 kg.
double elongation(double start, double end, double time) {
  const double omega = std::sqrt(2.0 * kStiffness);
  return (std::cos(omega * (time - end)) - std::cos(omega * (time - start))) / (2.0 * kStiffness);
}

// Two opposite pulses whose ends are not at ticks. The motion moves them to the same ticks, where they
// cancel.
TEST(VerdictLoads, OppositePulsesBetweenTicksDoNotCancel) {
  Scene scene = pair_along(Eigen::Vector3d::UnitX());
  add_load(scene, 1.0, PulseHistory{0.105, 0.01});
  add_load(scene, -1.0, PulseHistory{0.1149, 0.01});
  Watched watched(scene);
  const Verdict& verdict = watched.run_to(2.0);
  EXPECT_EQ(watched.state().q[0], 0.0);
  const double truth = elongation(0.105, 0.115, 2.0) - elongation(0.1149, 0.1249, 2.0);
  // each of two equal masses moves by half of the elongation
  std::printf("error %.4e m, truth %.4e m\n", verdict.error.deformation, 0.5 * std::abs(truth));
  EXPECT_NEAR(verdict.error.deformation, 0.5 * std::abs(truth), 0.02 * std::abs(truth));
  EXPECT_EQ(verdict.level, Level::kOutside);
}

// A pulse at half a tick is moved by half a tick. Its cost is that of the tick length, and not of another
// effect that the motion lacks.
TEST(VerdictLoads, AnExplanationBlamesTheTickForAMovedPulse) {
  Scene scene = pair_along(Eigen::Vector3d::UnitX());
  scene.rate = 10.0;
  add_load(scene, 1.0, PulseHistory{1.05, 0.5});
  const auto effects = explain_motion(scene, build(scene), judged_plan_of(scene), 5.0);
  ASSERT_TRUE(effects);
  for (const EffectSize& each : *effects) {
    // the impulse of 0.5 N s on 2 kg acts 0.05 s early or late
    const double expected = each.effect == Effect::kIntegration ? 0.5 / 2.0 * 0.05 : 0.0;
    EXPECT_NEAR(each.most.position, expected, 1e-12) << name_of(each.effect);
  }
}

// The table rises and falls within a quarter of a tick, so not even the shadow sees it.
TEST(VerdictLoads, ATableThatRisesAndFallsBetweenSamplesIsNotRatedGood) {
  for (const double width : {3e-5, 1e-3}) {
    Scene scene = pair_along(Eigen::Vector3d::UnitX());
    scene.rate = 1000.0;
    add_load(scene, 1.0,
             TableHistory{{0.10026, 0.10027, 0.1003 + width, 0.10031 + width}, {0.0, 1e4, 1e4, 0.0}});
    Watched watched(scene);
    EXPECT_EQ(watched.plan.verdict.fast_loads.empty(), width > 2e-4);
    EXPECT_NE(watched.run_to(0.2).level, Level::kGood);
  }
}

// One horizon in several is judged. A load that begins in another one is foreseen; a command is seen later.
TEST(VerdictLoads, LoadsInHorizonsThatAreNotJudgedAreNamed) {
  Scene quiet = watched_truss(Fidelity::kSeparated, 0.05, 0.0);
  quiet.loads.clear();
  quiet.verdict.share = 1e-3;
  Scene pulsed = quiet;
  Load load;
  load.forces = {{0, {10.0, 0.0, 0.0}}};
  load.history = PulseHistory{0.07, 0.01};
  pulsed.loads = {load};
  const Plan plan = judged_plan_of(quiet);
  ASSERT_GT(plan.verdict.shadows.front().every, 1);
  const auto period = static_cast<double>(plan.verdict.shadows.front().every) * 0.05;
  EXPECT_EQ(Watched(quiet).run_to(period + 0.02).cause, Cause::kNone);
  Watched foreseen(pulsed);
  EXPECT_EQ(foreseen.run_to(0.04).cause, Cause::kNone);
  EXPECT_EQ(foreseen.run_to(0.05).cause, Cause::kMissedLoad) << "the next horizon is not judged";
  EXPECT_EQ(foreseen.run_to(period + 0.02).cause, Cause::kMissedLoad);
  Watched commanded(quiet);
  commanded.run_to(0.07);
  ForceCommand command = make_command(0, 1, Axes::kWorld);
  add_force(command, 0, {10.0, 0.0, 0.0});
  command.duration_ticks = 10;
  EXPECT_EQ(commanded.run_to(period - 0.01, {&command, 1}).cause, Cause::kNone);
  EXPECT_EQ(commanded.run_to(period + 0.02).cause, Cause::kMissedLoad);
}

// A chain of springs moves chaotically. Its error is small after the first horizon, and 0.2 rad at the end of
// the eight that are not judged.
TEST(VerdictLoads, AnErrorThatGrowsInHorizonsThatAreNotJudgedIsForeseen) {
  constexpr int kPoints = 16;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    Scene scene;
    std::mt19937_64 engine(seed);
    const auto uniform = [&] { return std::ldexp(static_cast<double>(engine() >> 11), -52) - 1.0; };
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    for (int i = 0; i < kPoints; ++i) {
      add_point(scene, 1.0, at);
      at += Eigen::Vector3d(1.0 + 0.5 * uniform(), uniform(), uniform());
      if (i > 0) add_link(scene, i - 1, i, Spring{2e5});
      scene.initial.points.push_back(
          {i, Eigen::Vector3d::Zero(), 3.0 * Eigen::Vector3d(uniform(), uniform(), uniform())});
    }
    scene.fidelity = Fidelity::kCorotational;
    scene.rate = 30e3;
    scene.integration = {IntegrateBy::kPoints, 1e-3, {}};
    Watched watched(scene);
    ASSERT_GT(watched.plan.verdict.shadows.front().every, 1);
    const Verdict verdict = watched.run_to(2.0);
    std::printf("seed %u: one horizon in %ld, attitude off by %.1e rad\n", seed,
                static_cast<long>(watched.plan.verdict.shadows.front().every), verdict.error.attitude);
    EXPECT_NE(verdict.level, Level::kGood);
  }
}

// A straight structure has no inertia about its line but for rounding errors, which must not set its size.
TEST(VerdictLoads, TheVerdictDoesNotDependOnTheDirectionOfAStraightStructure) {
  for (const Eigen::Vector3d& direction :
       {Eigen::Vector3d(1.0, 0.0, 0.0), Eigen::Vector3d(0.31, 0.52, 0.73), Eigen::Vector3d(-0.2, 0.9, 0.1)}) {
    Scene scene = pair_along(direction);
    scene.initial.angular_velocity = direction.unitOrthogonal();
    Watched watched(scene);
    const Verdict& verdict = watched.run_to(1.0);
    EXPECT_EQ(verdict.level, Level::kOutside) << "the pull of the spin is missing";
    EXPECT_LT(verdict.scale, 0.1);
  }
}

// Returns eleven points of 1 kg on ten beams of 1 m. The lowest bending mode is at 7.07 rad/s.
Scene soft_beam() {
  Scene scene;
  for (int k = 0; k <= 10; ++k) add_point(scene, 1.0, {1.0 * k, 0.0, 0.0});
  for (int k = 0; k < 10; ++k) add_link(scene, k, k + 1, Beam{1e6, 1e3, 1e3, 1e3, {0.0, 1.0, 0.0}});
  publish_everything(scene);
  return scene;
}

// A free beam under a sudden thrust along it. Its axial modes ring, which pumps energy into the bending.
// Ticks of 10 ms do not resolve this, and neither does a shadow with steps of 5 ms. Its own steps are
// shorter, and show an error of 77 %.
TEST(VerdictLoads, RingingThatTheShadowDoesNotResolveIsNotRatedGood) {
  for (const double force : {0.0, 1.0, 700.0}) {
    Scene scene = soft_beam();
    scene.verdict.step = 5e-3;
    scene.fidelity = Fidelity::kCorotational;
    scene.initial.modes = {{1, 1e-4, 0.0}};
    Load thrust;
    thrust.axes = Axes::kLocal;
    thrust.forces = {{0, {force, 0.0, 0.0}}};
    scene.loads = {thrust};
    scene.rate = 100.0;
    Watched watched(scene);
    EXPECT_EQ(watched.run_to(8.0).cause, force > 10.0 ? Cause::kRinging : Cause::kNone) << watched.text();
    scene.verdict.step = 0.0;
    Watched resolved(scene);
    EXPECT_EQ(resolved.run_to(8.0).level, force > 10.0 ? Level::kOutside : Level::kGood) << resolved.text();
  }
}

// A pull that rises and falls slowly leaves a vibration of 5 %, by the kinks of its table. Ten cycles of the
// mode are 17 s.
TEST(VerdictLoads, ALoadThatWasRemovedDoesNotSetTheScaleForEver) {
  Scene scene = pair_along(Eigen::Vector3d::UnitX());
  add_load(scene, 1e-3, TableHistory{{0.0, 20.0, 40.0}, {0.0, 1.0, 0.0}});
  Watched watched(scene);
  const double pulled = watched.run_to(20.0).scale, released = watched.run_to(150.0).scale;
  EXPECT_NEAR(pulled, 0.5 * 0.5e-3 / kStiffness, 0.1 * pulled);
  EXPECT_LT(released, 0.06 * pulled);
}

}  // namespace
}  // namespace freeflex::testing
