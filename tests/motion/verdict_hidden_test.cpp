// Motions with errors that no mode of the rung shows must not get the verdict `good`. The causes of such
// errors are a squeeze carried by rigid links or a matrix, loads that vary between ticks, and ticks that are
// long for the rotation or the fall of the body.
#include <gtest/gtest.h>

#include <cmath>

#include "core/plan/rungs/rates.hpp"
#include "tests/motion/verdict_cases.hpp"
#include "tests/motion/watched.hpp"

namespace freeflex::testing {
namespace {

// Returns a straight chain of points of 1 kg, 1 m apart, kept straight by bending springs.
Scene chain(const LinkKind& between) {
  Scene scene;
  for (int k = 0; k < 5; ++k) add_point(scene, 1.0, {1.0 * k, 0.0, 0.0});
  for (int k = 0; k < 4; ++k) add_link(scene, {k, k + 1}, between);
  for (int k = 0; k < 3; ++k) add_link(scene, {k, k + 1, k + 2}, BendingSpring{100.0});
  scene.rate = 2000.0;
  return scene;
}

void squeeze(double force, Scene& scene) {
  Load load;
  load.axes = Axes::kBody;
  load.forces = {{0, {force, 0.0, 0.0}}, {4, {-force, 0.0, 0.0}}};
  scene.loads = {load};
}

// The forces cancel and excite no mode. The links that carry these forces have second-order terms, through
// which the forces reduce the bending stiffness. The set-up does not know these terms. The reference has
// springs in place of those links.
TEST(VerdictHidden, CompressionOfRigidLinksOrAMatrixLinkIsNotRatedGood) {
  Scene springs = chain(Spring{3e5});
  displace_modes(springs, {{1, 1e-3}});
  // the matrix is the stiffness of the springs without loads
  Scene matrix = as_matrix(springs), rigid = springs;
  for (Link& link : rigid.links)
    if (std::holds_alternative<Spring>(link.kind)) link.kind = Rigid{};
  for (Scene* scene : {&springs, &matrix, &rigid}) {
    squeeze(4.0, *scene);
    publish_everything(*scene);
  }
  const double end = 2.0;
  const auto truth = true_displacements(springs, end);
  ASSERT_TRUE(truth);
  for (const Scene* scene : {&matrix, &rigid}) {
    const JudgedError judged = compare_verdict(*scene, Fidelity::kSeparated, end, truth);
    EXPECT_GT(judged.error, 0.05) << "the error is too small to test anything";
    EXPECT_NE(judged.level, Verdict::Level::kGood);
  }
  // a command can squeeze too
  ForceCommand command = make_command(0, 1, Axes::kBody);
  add_force(command, 0, {4.0, 0.0, 0.0});
  add_force(command, 4, {-4.0, 0.0, 0.0});
  rigid.loads.clear();
  const JudgedError pushed = compare_verdict(rigid, Fidelity::kSeparated, end, truth, {&command, 1});
  EXPECT_NE(pushed.level, Verdict::Level::kGood);
  // without the squeeze the verdict is `good`
  EXPECT_EQ(compare_verdict(rigid, Fidelity::kSeparated, 0.1, std::nullopt).level, Verdict::Level::kGood);
}

// Beyond the buckling load a displacement of a micrometre grows, although the modal amplitudes of the rung
// stay small. In the reference the force shortens springs, by 2 micrometres each.
TEST(VerdictHidden, BucklingBetweenRigidLinksIsNotRatedGood) {
  Scene springs = chain(Spring{3e7});
  displace_modes(springs, {{1, 1e-6}});
  Scene rigid = springs;
  for (Link& link : rigid.links)
    if (std::holds_alternative<Spring>(link.kind)) link.kind = Rigid{};
  for (Scene* scene : {&springs, &rigid}) {
    scene->tolerance = 1e-3;
    publish_everything(*scene);
    squeeze(60.0, *scene);
  }
  const double end = 5.0;
  const auto truth = true_displacements(springs, end);
  ASSERT_TRUE(truth);
  const JudgedError judged = compare_verdict(rigid, Fidelity::kSeparated, end, truth);
  EXPECT_GT(judged.error, 0.05) << "the error is too small to test anything";
  EXPECT_NEAR(judged.estimate, judged.error, 0.1 * judged.error);
  EXPECT_NE(judged.level, Verdict::Level::kGood);
}

// Returns a pair of points of 1 kg with one mode at `frequency` [Hz].
Scene pair_of(double frequency, double rate) {
  const double omega = 2.0 * M_PI * frequency;
  Scene scene = spring_pair(1.0, 1.0, 1.0, 0.5 * omega * omega);
  scene.rate = rate;
  Load load;
  load.axes = Axes::kBody;
  load.forces = {{0, {-50.0, 0.0, 0.0}}, {1, {50.0, 0.0, 0.0}}};
  scene.loads = {load};
  return scene;
}

// The step interpolates a load linearly between ticks. At 100 Hz a sine of 5 Hz therefore has a component at
// 95 Hz, which may be near the frequency of a mode.
TEST(VerdictHidden, ASineWithAnAliasAtTheFrequencyOfAModeIsNotRatedGood) {
  Scene scene = pair_of(95.0, 100.0);
  scene.loads[0].history = SineHistory{5.0, 0.0};
  const JudgedError judged = judged_error(scene, Fidelity::kSeparated, 5.0);
  EXPECT_GT(judged.error, 0.05) << "the error is too small to test anything";
  EXPECT_NE(judged.level, Verdict::Level::kGood);
  scene = pair_of(75.0, 100.0);
  scene.loads[0].history = SineHistory{5.0, 0.0};
  const JudgedError apart = judged_error(scene, Fidelity::kSeparated, 5.05);
  EXPECT_LT(apart.error, 0.05);
  EXPECT_EQ(apart.level, Verdict::Level::kGood);
}

// The alias depends on the rate of the running plan, which may differ from the rate of the scene.
TEST(VerdictHidden, TheAliasOfASineDependsOnTheRateOfThePlan) {
  Scene scene = pair_of(95.0, 1000.0);
  scene.loads[0].history = SineHistory{5.0, 0.0};
  for (const double rate : {1000.0, 100.0}) {
    Plan plan = reduced_plan_of(scene);
    set_rate(plan, rate);
    Watched watched(std::move(plan));
    watched.run_to(5.0);
    EXPECT_EQ(watched.motion.worst().level == Verdict::Level::kGood, rate == 1000.0) << rate;
  }
}

// The step takes a table as linear between ticks, so it misses a change of slope there.
TEST(VerdictHidden, ATableThatChangesSlopeBetweenTicksIsNotRatedGood) {
  Scene scene = pair_of(5.0, 100.0);
  scene.loads[0].forces = {{0, {-0.5, 0.0, 0.0}}, {1, {0.5, 0.0, 0.0}}};
  scene.loads[0].history = TableHistory{{0.1, 0.105, 0.115, 0.12}, {0.0, 1.0, 1.0, 0.0}};
  const JudgedError judged = judged_error(scene, Fidelity::kSeparated, 0.2);
  EXPECT_GT(judged.error, 0.05) << "the error is too small to test anything";
  EXPECT_NE(judged.level, Verdict::Level::kGood);
  scene.loads[0].history = TableHistory{{0.1, 0.15, 0.2}, {0.0, 1.0, 0.0}};
  const JudgedError on_ticks = judged_error(scene, Fidelity::kSeparated, 0.3);
  EXPECT_LT(on_ticks.error, 0.05);
  EXPECT_EQ(on_ticks.level, Verdict::Level::kGood);
}

struct Ends {
  State state;
  Verdict::Level level;
};
Ends run_to(Scene scene, double rate, double end) {
  scene.rate = rate;
  Watched watched(judged_plan_of(scene));
  watched.run_to(end);
  return {watched.state(), watched.motion.worst().level};
}

// Returns the angle [rad] between two attitudes.
double angle_between(const Quat& a, const Quat& b) {
  double cosine = 0.0;
  for (std::size_t k = 0; k < 4; ++k) cosine += a[k] * b[k];
  return 2.0 * std::acos(std::min(1.0, std::abs(cosine)));
}

// Returns a body that tumbles. The rung `separated` computes its rotation exactly, but the rung `coupled`
// integrates it in steps.
Scene tumbling(double spin) {
  Scene scene = octahedron(1e8);
  for (PointMass& point : scene.points) point.mass *= 1.0 + 0.2 * point.position.norm();
  scene.initial.angular_velocity = spin / 30.0 * Eigen::Vector3d(3.0, 30.0, 2.0);
  scene.tolerance = 1.0;
  scene.fidelity = Fidelity::kCoupled;
  return scene;
}

// The number of substeps follows from the spin at the start. For example, 0.3 rad per tick gives eight
// substeps.
TEST(VerdictHidden, TicksThatDoNotResolveTumblingAreDivided) {
  const Scene scene = tumbling(30.0);
  const Ends true_end = run_to(scene, 4000.0, 10.0), coarse = run_to(scene, 100.0, 10.0);
  EXPECT_EQ(true_end.level, Verdict::Level::kGood);
  EXPECT_LT(angle_between(true_end.state.q_WB, coarse.state.q_WB), 1e-3);
}

// A spin that loads cause later is not known at the start.
TEST(VerdictHidden, TicksThatNoLongerResolveTumblingAreNotRatedGood) {
  Scene scene = tumbling(0.03);
  Load load;
  load.name = "spin-up";
  load.forces = {{0, {0.0, 40.0, 0.0}}, {1, {0.0, -40.0, 0.0}}};
  load.axes = Axes::kBody;
  scene.loads.push_back(load);
  const Ends true_end = run_to(scene, 4000.0, 10.0), coarse = run_to(scene, 50.0, 10.0);
  EXPECT_GT(angle_between(true_end.state.q_WB, coarse.state.q_WB), 1e-2);
  EXPECT_NE(coarse.level, Verdict::Level::kGood);
}

// The fall around the attractor is integrated exactly, even over ten orbits of 5,400 s in ticks of 200 s.
TEST(VerdictHidden, TicksOfAnOrbitMayBeLong) {
  Scene scene = spring_pair(10.0, 10.0, 2.0, 1e6);
  constexpr double kDistance = 6.7e6;
  scene.attractor.mu = 3.986e14;
  scene.attractor.position = {0.0, -kDistance, 0.0};
  scene.initial.velocity = {std::sqrt(scene.attractor.mu / kDistance), 0.0, 0.0};
  // the shadow would resolve the vibration of the spring at 71 Hz
  scene.verdict.step = 100.0;
  const double end = 54000.0;
  const Ends fine = run_to(scene, 1.0, end), coarse = run_to(scene, 1.0 / 200.0, end);
  double apart = 0.0;
  for (std::size_t k = 0; k < 3; ++k) apart += std::pow(fine.state.p_WB[k] - coarse.state.p_WB[k], 2);
  EXPECT_LT(std::sqrt(apart), 1e-10 * kDistance);
  EXPECT_LT(angle_between(fine.state.q_WB, coarse.state.q_WB), 1e-6);
}

}  // namespace
}  // namespace freeflex::testing
