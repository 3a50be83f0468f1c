// The word beside the truth where one thing makes it wrong: each by the
// reference at true geometry, and the estimate within a factor of two of the
// true error.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/motion/word_cases.hpp"

namespace freeflex::testing {
namespace {

TEST(WordPhysics, RingingDrivesASoftHinge) {
  Scene scene = hinged_tetrahedra(10.0);
  ring(scene, {{2, 3e-4}, {3, 3e-4}});
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kCoupled})
    expect_told(shares_of(scene, rung, 3.0));
  ring(scene, {{2, 3e-3}, {3, 3e-3}});
  const WordShares large = shares_of(scene, Fidelity::kCoupled, 6.0);
  EXPECT_GT(large.error, 0.05);
  EXPECT_NE(large.word, Verdict::Word::kGood);
}

// a beam that is released about one axis at a bend: a mechanism that ringing of
// 1e-5 of the length drives
TEST(WordPhysics, RingingDrivesAFreeHinge) {
  Scene scene;
  for (int k = 0; k <= 2; ++k) add_point(scene, 1.0, {1.0 * k, 0.0, 0.0});
  add_point(scene, 1.0, {2.6, 0.5, 0.3});
  add_point(scene, 1.0, {3.1, 1.3, 0.2});
  for (int k = 0; k < 4; ++k) {
    Beam beam{.EA = 1e5, .GJ = 300.0, .EI_y = 400.0, .EI_z = 500.0, .y_axis = Eigen::Vector3d(0.0, 0.2, 1.0)};
    if (k == 2) beam.released[0][1] = true;
    add_link(scene, {k, k + 1}, beam);
  }
  scene.rate = 4000.0;
  ring(scene, {{2, 1e-5}});
  expect_told(shares_of(scene, Fidelity::kSeparated, 1.0));
  const WordShares late = shares_of(scene, Fidelity::kCoupled, 20.0);
  EXPECT_GT(late.error, 0.05);
  EXPECT_NE(late.word, Verdict::Word::kGood);
}

/// Five points in a line, of which the springs of the angles bend: axial loads
/// do work on the bending.
Scene straight_chain() {
  Scene scene;
  for (int k = 0; k < 5; ++k) add_point(scene, 1.0, {1.0 * k, 0.0, 0.0});
  for (int k = 0; k < 4; ++k) add_link(scene, {k, k + 1}, Spring{3e5});
  for (int k = 0; k < 3; ++k) add_link(scene, {k, k + 1, k + 2}, BendingSpring{100.0});
  scene.rate = 2000.0;
  return scene;
}

// the load pulsates at the sum of two frequencies, or at twice one: they grow
// by each other
TEST(WordPhysics, AxialLoadsPulsateInResonance) {
  Scene scene = straight_chain();
  Faults faults;
  const auto structure = build_structure(scene, faults);
  // bending comes in pairs: the first, the third and so on of one plane
  for (const auto& [first, second] : {std::pair{0, 0}, {0, 2}}) {
    ring(scene, {{1, 1e-3}, {3, 5e-4}});
    Load load;
    load.axes = Axes::kBody;
    load.forces = {{0, {12.0, 0.0, 0.0}}, {4, {-12.0, 0.0, 0.0}}};
    load.history = SineHistory{(structure->omega[first] + structure->omega[second]) / (2.0 * M_PI), 0.0};
    scene.loads = {load};
    // the estimate is an amplitude: beside the largest error of some moments
    WordShares shares;
    for (const double end : {1.6, 1.8, 2.0}) {
      const WordShares now = shares_of(scene, Fidelity::kCoupled, end);
      shares.error = std::max(shares.error, now.error);
      shares.estimate = std::max(shares.estimate, now.estimate);
    }
    EXPECT_GT(shares.error, 0.01) << "else nothing is tried";
    expect_told(shares);
  }
}

/// Points in a line, 1 kg and 1 m apart, held straight by the springs of angles.
Scene long_chain(int num_points, double stretch) {
  Scene scene;
  for (int k = 0; k < num_points; ++k) add_point(scene, 1.0, {1.0 * k, 0.0, 0.0});
  for (int k = 0; k + 1 < num_points; ++k) add_link(scene, {k, k + 1}, Spring{stretch});
  for (int k = 0; k + 2 < num_points; ++k) add_link(scene, {k, k + 1, k + 2}, BendingSpring{100.0});
  scene.rate = 2000.0;
  scene.tolerance = 1e-3;
  return scene;
}

/// What the rung rings with stays as small as its seed; the truth grows far beyond it. The largest of some
/// moments counts, for the estimate is an amplitude.
void expect_growth_told(const Scene& scene, double seed, const std::vector<double>& ends) {
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kCoupled}) {
    WordShares shares;
    for (const double end : ends) {
      const WordShares now = shares_of(scene, rung, end);
      EXPECT_TRUE(now.word != Verdict::Word::kGood || now.error < 0.02);
      shares.error = std::max(shares.error, now.error);
      shares.estimate = std::max(shares.estimate, now.estimate);
    }
    EXPECT_GT(shares.error * scene.tolerance, 100.0 * seed) << "else nothing has grown";
    EXPECT_LT(shares.error, 2.0) << "else the estimate is not of first order any more";
    // a rate of growth that is off by a quarter makes a factor of four in e^5
    EXPECT_GT(shares.estimate, 0.5 * shares.error);
    EXPECT_LT(shares.estimate, 6.0 * shares.error);
  }
}

// from a micrometre to beyond the tolerance, though nothing that the rung has is of that size
TEST(WordPhysics, WhatALoadPumpsGrowsBeyondWhatTheRungRingsWith) {
  Scene scene = long_chain(5, 3e5);
  Faults faults;
  const auto structure = build_structure(scene, faults);
  ring(scene, {{1, 1e-6}});
  Load load;
  load.axes = Axes::kBody;
  load.forces = {{0, {48.0, 0.0, 0.0}}, {4, {-48.0, 0.0, 0.0}}};
  load.history = SineHistory{structure->omega[0] / M_PI, 0.0};
  scene.loads = {load};
  expect_growth_told(scene, 1e-6, {3.9, 4.0, 4.1});
}

// the same of a mode whose error is not integrated with the lowest
TEST(WordPhysics, WhatALoadPumpsGrowsInTheSeventeenthMode) {
  Scene scene = long_chain(12, 3e5);
  Faults faults;
  const auto structure = build_structure(scene, faults);
  ring(scene, {{17, 1e-6}});
  Load load;
  load.axes = Axes::kBody;
  load.forces = {{0, {70.0, 0.0, 0.0}}, {11, {-70.0, 0.0, 0.0}}};
  load.history = SineHistory{structure->omega[16] / M_PI, 0.0};
  scene.loads = {load};
  expect_growth_told(scene, 1e-6, {3.9, 4.0, 4.1});
}

// a mode that rings at twice the frequency of another feeds it
TEST(WordPhysics, RingingAtTwiceAFrequencyFeedsWhatBends) {
  Scene scene = long_chain(5, 1e4);
  Faults faults;
  auto structure = build_structure(scene, faults);
  // the lowest axial mode of five masses in line: 2 sin(pi / 10) sqrt(k / m)
  const double omega = 2.0 * structure->omega[0] / (2.0 * std::sin(M_PI / 10.0));
  for (Link& link : scene.links)
    if (auto* const spring = std::get_if<Spring>(&link.kind)) spring->stiffness = omega * omega;
  structure = build_structure(scene, faults);
  Eigen::Index axial = 0;
  (structure->omega.array() - 2.0 * structure->omega[0]).abs().minCoeff(&axial);
  ring(scene, {{1, 1e-6}, {static_cast<int>(axial) + 1, 3e-2}});
  expect_growth_told(scene, 1e-6, {10.0, 19.0, 20.0, 21.0});
}

// spin from rest: the error grows with the motion, and is nothing in the first
// ticks
TEST(WordPhysics, ASpinThatTheRungBendsByIsNotOutsideAtItsStart) {
  Scene scene = hinged_tetrahedra(100.0);
  scene.initial.angular_velocity = {0.05, 0.2, 0.1};
  scene.damping.modal_ratio = 0.02;
  EXPECT_EQ(shares_of(scene, Fidelity::kSpinLoaded, 0.02).word, Verdict::Word::kGood);
  EXPECT_NE(shares_of(scene, Fidelity::kSeparated, 1.0).word, Verdict::Word::kGood) << "it lacks the load";
}

// what is damped beyond its critical ratio creeps to its static place under its whole stiffness
TEST(WordPhysics, AnOverdampedBodyCreepsToWhatTheSpinBends) {
  Scene scene;
  add_point(scene, 1.0, {0.0, 0.0, 0.0});
  add_point(scene, 1.0, {1.0, 0.0, 0.0});
  add_point(scene, 1.0, {0.2, 0.9, 0.0});
  add_point(scene, 1.0, {0.3, 0.3, 0.8});
  for (int a = 0; a < 4; ++a)
    for (int b = a + 1; b < 4; ++b) add_link(scene, {a, b}, Spring{400.0});
  scene.rate = 1000.0;
  scene.damping.modal_ratio = 10.0;
  scene.initial.angular_velocity = {0.1, 0.2, 0.1};
  Load load;
  load.axes = Axes::kBody;
  load.forces = {{1, {0.05, 0.0, 0.0}}};
  scene.loads = {load};
  for (const double end : {0.5, 5.0}) {
    const WordShares shares = shares_of(scene, Fidelity::kSeparated, end);
    expect_told(shares);
    EXPECT_NE(shares.word, Verdict::Word::kGood);
  }
}

/// Three points in a line, held straight by the spring of an angle [N m/rad].
Scene bent_line(double stiffness) {
  Scene scene;
  for (int k = 0; k < 3; ++k) add_point(scene, 1.0 + 0.2 * k, {1.0 * k, 0.0, 0.0});
  for (int k = 0; k < 2; ++k) add_link(scene, {k, k + 1}, Spring{3e3});
  add_link(scene, {0, 1, 2}, BendingSpring{stiffness});
  scene.rate = 500.0;
  publish_everything(scene);
  return scene;
}

// feedback takes all but 3 % of what holds a line straight: a thrust acts on what is left, which the truth
// has without feedback
TEST(WordPhysics, FeedbackTakesStiffnessAndThrustActsOnTheRest) {
  constexpr double kHeld = 100.0, kLeft = 3.0;
  constexpr std::array kAngle{1.0, -2.0, 1.0};
  Scene soft = bent_line(kLeft), scene = bent_line(kHeld);
  ring(soft, {{1, 1e-3}});
  scene.initial = soft.initial;
  for (int to = 0; to < 3; ++to)
    for (int from = 0; from < 3; ++from) {
      Feedback feedback;
      feedback.name = std::to_string(3 * to + from);
      feedback.point = to;
      feedback.sensor = from;
      const double gain =
          (kHeld - kLeft) * kAngle[static_cast<std::size_t>(to)] * kAngle[static_cast<std::size_t>(from)];
      feedback.displacement_gain = gain * Eigen::Vector3d(0.0, 1.0, 1.0).asDiagonal().toDenseMatrix();
      scene.feedbacks.push_back(feedback);
    }
  for (const double share : {0.02, 0.2}) {
    Load load;
    load.axes = Axes::kBody;
    load.forces = {{0, {share * kLeft, 0.0, 0.0}}, {2, {-share * kLeft, 0.0, 0.0}}};
    soft.loads = scene.loads = {load};
    for (const double end : {1.0, 6.0})
      for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kCoupled}) {
        const WordShares shares = compare_word(scene, rung, end, true_displacements(soft, end));
        EXPECT_GT(shares.estimate, 0.5 * shares.error);
        EXPECT_TRUE(shares.word != Verdict::Word::kGood || shares.error < 0.05);
      }
  }
}

// a dashpot so strong that it locks two points: what rings then decays no more, and neither does its error
TEST(WordPhysics, ADashpotThatLocksLetsErrorsRing) {
  Scene scene = hinged_tetrahedra(100.0), locked = scene;
  add_link(locked, {2, 4}, Spring{1e7});
  add_link(scene, {2, 4}, Dashpot{3e4});
  ring(locked, {{1, 1e-4}, {2, 1e-4}});
  scene.initial = locked.initial;
  scene.tolerance = 1e-4;
  Load load;
  load.axes = Axes::kBody;
  load.forces = {{3, {4.0, 0.0, 0.0}}, {5, {-4.0, 0.0, 0.0}}};
  scene.loads = {load};
  for (const double end : {1.0, 4.0}) {
    const WordShares shares = shares_of(scene, Fidelity::kSeparated, end);
    expect_told(shares);
    EXPECT_TRUE(shares.word != Verdict::Word::kGood || shares.error < 0.05);
  }
}

// `full` divides the tick, and no part of it is too long for a strong dashpot
TEST(WordPhysics, AStrongDashpotOnTheFullRungIsNotOutside) {
  Scene scene;
  for (int k = 0; k < 4; ++k) add_point(scene, 1.0, {1.0 * k, 0.1 * (k % 2), 0.05 * k * k});
  for (int k = 0; k < 3; ++k)
    add_link(
        scene, {k, k + 1},
        Beam{.EA = 1e4, .GJ = 100.0, .EI_y = 100.0, .EI_z = 120.0, .y_axis = Eigen::Vector3d(0.0, 0.2, 1.0)});
  add_link(scene, {0, 3}, Dashpot{1000.0});
  scene.rate = 200.0;
  ring(scene, {{1, 1e-5}});
  const WordShares shares = shares_of(scene, Fidelity::kFull, 1.0);
  EXPECT_LT(shares.error, 1e-3);
  EXPECT_EQ(shares.word, Verdict::Word::kGood);
}

// what creeps between the points of a line hangs on dashpots, whose tension bends it as that of springs does
TEST(WordPhysics, TheTensionOfDashpotsHoldsALineStraight) {
  Scene scene = bent_line(100.0);
  for (int k = 0; k < 2; ++k) add_link(scene, {k, k + 1}, Dashpot{3e3});
  ring(scene, {{1, 1e-3}});
  Load load;
  load.axes = Axes::kBody;
  load.forces = {{0, {-6.0, 0.0, 0.0}}, {2, {6.0, 0.0, 0.0}}};
  scene.loads = {load};
  for (const double end : {0.336, 1.762}) {
    const WordShares shares = shares_of(scene, Fidelity::kSeparated, end);
    EXPECT_GT(shares.error, 0.05) << "else nothing is tried";
    expect_told(shares);
    EXPECT_NE(shares.word, Verdict::Word::kGood);
  }
}

}  // namespace
}  // namespace freeflex::testing
