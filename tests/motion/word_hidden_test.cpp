// What no mode of the rung shows must not be good: a squeeze that rigid links or a matrix take, what happens
// between ticks, ticks that are long for how the body turns or falls.
#include <gtest/gtest.h>

#include <cmath>

#include "core/plan/rates.hpp"
#include "tests/motion/word_cases.hpp"

namespace freeflex::testing {
namespace {

// Chain of points 1 kg and 1 m apart, straight, held so by the springs of angles.
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

// The forces cancel and move no mode: what they take of the bending is in the second order of the links that
// carry them, of which the set-up knows nothing. The truth is of springs in their place.
TEST(WordHidden, ASqueezeThatRigidLinksOrAMatrixTake) {
  Scene springs = chain(Spring{3e5});
  ring(springs, {{1, 1e-3}});
  // the matrix is of the springs as they are, without loads
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
    const WordShares shares = compare_word(*scene, Fidelity::kSeparated, end, truth);
    EXPECT_GT(shares.error, 0.05) << "else nothing is tried";
    EXPECT_NE(shares.word, Verdict::Word::kGood);
  }
  // a command squeezes as well
  ForceCommand command = make_command(0, 1, Axes::kBody);
  add_force(command, 0, {4.0, 0.0, 0.0});
  add_force(command, 4, {-4.0, 0.0, 0.0});
  rigid.loads.clear();
  const WordShares pushed = compare_word(rigid, Fidelity::kSeparated, end, truth, {&command, 1});
  EXPECT_NE(pushed.word, Verdict::Word::kGood);
  // and without any of it the word is good
  EXPECT_EQ(compare_word(rigid, Fidelity::kSeparated, 0.1, std::nullopt).word, Verdict::Word::kGood);
}

// Beyond the load that buckles it a micrometre grows, though the rung rings with no more.
TEST(WordHidden, WhatBucklesBetweenRigidLinksGrows) {
  Scene springs = chain(Spring{3e5});
  ring(springs, {{1, 1e-6}});
  Scene rigid = springs;
  for (Link& link : rigid.links)
    if (std::holds_alternative<Spring>(link.kind)) link.kind = Rigid{};
  for (Scene* scene : {&springs, &rigid}) {
    scene->tolerance = 1e-3;
    publish_everything(*scene);
    squeeze(60.0, *scene);
  }
  const double end = 2.0;
  const auto truth = true_displacements(springs, end);
  ASSERT_TRUE(truth);
  const WordShares shares = compare_word(rigid, Fidelity::kSeparated, end, truth);
  EXPECT_GT(shares.error, 0.05) << "else nothing is tried";
  EXPECT_NE(shares.word, Verdict::Word::kGood);
}

// one mode, 1 kg at either end, at `frequency` [Hz]
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

// A load is straight between ticks: a sine of 5 Hz at 100 Hz has a part at 95 Hz, at which a mode may be.
TEST(WordHidden, TheImageOfASineAtAMode) {
  Scene scene = pair_of(95.0, 100.0);
  scene.loads[0].history = SineHistory{5.0, 0.0};
  const WordShares shares = shares_of(scene, Fidelity::kSeparated, 5.0);
  EXPECT_GT(shares.error, 0.05) << "else nothing is tried";
  EXPECT_NE(shares.word, Verdict::Word::kGood);
  scene = pair_of(75.0, 100.0);
  scene.loads[0].history = SineHistory{5.0, 0.0};
  const WordShares apart = shares_of(scene, Fidelity::kSeparated, 5.05);
  EXPECT_LT(apart.error, 0.05);
  EXPECT_EQ(apart.word, Verdict::Word::kGood);
}

// by the ticks that it runs with, which need not be the scene's
TEST(WordHidden, TheImageOfASineAtAnotherRateThanTheScenes) {
  Scene scene = pair_of(95.0, 1000.0);
  scene.loads[0].history = SineHistory{5.0, 0.0};
  Plan plan = plan_of(scene);
  EXPECT_TRUE(plan.neglect.fast_loads.empty());
  set_rate(plan, 100.0);
  EXPECT_EQ(plan.neglect.fast_loads, std::vector<std::int32_t>{0});
  set_rate(plan, 1000.0);
  EXPECT_TRUE(plan.neglect.fast_loads.empty());
}

// as is a table, which may bend between them
TEST(WordHidden, ATableThatBendsBetweenTicks) {
  Scene scene = pair_of(5.0, 100.0);
  scene.loads[0].forces = {{0, {-0.5, 0.0, 0.0}}, {1, {0.5, 0.0, 0.0}}};
  scene.loads[0].history = TableHistory{{0.1, 0.105, 0.115, 0.12}, {0.0, 1.0, 1.0, 0.0}};
  const WordShares shares = shares_of(scene, Fidelity::kSeparated, 0.2);
  EXPECT_GT(shares.error, 0.05) << "else nothing is tried";
  EXPECT_NE(shares.word, Verdict::Word::kGood);
  scene.loads[0].history = TableHistory{{0.1, 0.15, 0.2}, {0.0, 1.0, 0.0}};
  const WordShares on_ticks = shares_of(scene, Fidelity::kSeparated, 0.3);
  EXPECT_LT(on_ticks.error, 0.05);
  EXPECT_EQ(on_ticks.word, Verdict::Word::kGood);
}

struct Ends {
  Simulation simulation;
  Verdict::Word word;
};
Ends run_to(Scene scene, double rate, double end) {
  scene.rate = rate;
  Ends ends{Simulation(scene), Verdict::Word::kGood};
  Judgement judgement(ends.simulation.plan);
  Budget none;
  judgement.take(ends.simulation.state, none);
  for (auto k = std::llround(end * rate); k > 0; --k) {
    ends.simulation.run(1);
    judgement.take(ends.simulation.state, none);
  }
  ends.word = judgement.worst().word;
  return ends;
}

// [rad] between two attitudes
double angle_between(const Quat& a, const Quat& b) {
  double cosine = 0.0;
  for (std::size_t k = 0; k < 4; ++k) cosine += a[k] * b[k];
  return 2.0 * std::acos(std::min(1.0, std::abs(cosine)));
}

// the separated rung turns a body exactly; the coupled one steps it
Scene tumbling(double spin) {
  Scene scene = octahedron(1e8);
  for (PointMass& point : scene.points) point.mass *= 1.0 + 0.2 * point.position.norm();
  scene.initial.angular_velocity = spin / 30.0 * Eigen::Vector3d(3.0, 30.0, 2.0);
  scene.tolerance = 1.0;
  scene.fidelity = Fidelity::kCoupled;
  return scene;
}

// a tick is divided by how fast the body turns at the start: 0.3 rad in eight parts
TEST(WordHidden, TicksThatAreLongForATumbleAreDivided) {
  const Scene scene = tumbling(30.0);
  const Ends true_end = run_to(scene, 4000.0, 10.0), coarse = run_to(scene, 100.0, 10.0);
  EXPECT_EQ(true_end.word, Verdict::Word::kGood);
  EXPECT_LT(angle_between(true_end.simulation.state.q_WB, coarse.simulation.state.q_WB), 1e-3);
}

// one that loads set turning is not known at the start
TEST(WordHidden, TicksThatBecomeTooLongForATumble) {
  Scene scene = tumbling(0.03);
  Load load;
  load.name = "spin-up";
  load.forces = {{0, {0.0, 40.0, 0.0}}, {1, {0.0, -40.0, 0.0}}};
  load.axes = Axes::kBody;
  scene.loads.push_back(load);
  const Ends true_end = run_to(scene, 4000.0, 10.0), coarse = run_to(scene, 50.0, 10.0);
  EXPECT_GT(angle_between(true_end.simulation.state.q_WB, coarse.simulation.state.q_WB), 1e-2);
  EXPECT_NE(coarse.word, Verdict::Word::kGood);
}

// ten orbits of 5,400 s, at 200 s a tick: one falls exactly
TEST(WordHidden, TicksOfAnOrbitMayBeLong) {
  Scene scene = spring_pair(10.0, 10.0, 2.0, 1e6);
  constexpr double kDistance = 6.7e6;
  scene.attractor.mu = 3.986e14;
  scene.attractor.position = {0.0, -kDistance, 0.0};
  scene.initial.velocity = {std::sqrt(scene.attractor.mu / kDistance), 0.0, 0.0};
  const double end = 54000.0;
  const Ends fine = run_to(scene, 1.0, end), coarse = run_to(scene, 1.0 / 200.0, end);
  double apart = 0.0;
  for (std::size_t k = 0; k < 3; ++k)
    apart += std::pow(fine.simulation.state.p_WB[k] - coarse.simulation.state.p_WB[k], 2);
  EXPECT_LT(std::sqrt(apart), 1e-10 * kDistance);
  EXPECT_LT(angle_between(fine.simulation.state.q_WB, coarse.simulation.state.q_WB), 1e-6);
}

}  // namespace
}  // namespace freeflex::testing
