// These tests check verdicts on motions with a single source of error each. A reference at true geometry
// gives the error, and the estimate is within 15 % of this error.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/motion/verdict_cases.hpp"

namespace freeflex::testing {
namespace {

TEST(VerdictPhysics, VerdictEstimatesTheErrorDueToASoftHingeDrivenByVibration) {
  Scene scene = hinged_tetrahedra(10.0);
  displace_modes(scene, {{2, 3e-4}, {3, 3e-4}});
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kCoupled})
    expect_estimated(judged_error(scene, rung, 3.0));
  displace_modes(scene, {{2, 3e-3}, {3, 3e-3}});
  const JudgedError large = judged_error(scene, Fidelity::kCoupled, 6.0);
  EXPECT_GT(large.error, 0.05);
  EXPECT_NE(large.level, Verdict::Level::kGood);
}

// A bent chain has a beam that is released about one axis. A vibration of 1e-5 of the length drives this
// mechanism.
TEST(VerdictPhysics, VerdictEstimatesTheErrorDueToAFreeHingeDrivenByVibration) {
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
  displace_modes(scene, {{2, 1e-5}});
  expect_estimated(judged_error(scene, Fidelity::kSeparated, 1.0));
  const JudgedError late = judged_error(scene, Fidelity::kCoupled, 20.0);
  EXPECT_GT(late.error, 0.05);
  EXPECT_NE(late.level, Verdict::Level::kGood);
}

/// Returns five points in a line with bending springs. Axial loads do work when the line bends.
Scene straight_chain() {
  Scene scene;
  for (int k = 0; k < 5; ++k) add_point(scene, 1.0, {1.0 * k, 0.0, 0.0});
  for (int k = 0; k < 4; ++k) add_link(scene, {k, k + 1}, Spring{3e5});
  for (int k = 0; k < 3; ++k) add_link(scene, {k, k + 1, k + 2}, BendingSpring{100.0});
  scene.rate = 2000.0;
  return scene;
}

// The load pulsates at the sum of two frequencies or at twice a frequency, and the modes grow (parametric
// resonance).
TEST(VerdictPhysics, VerdictEstimatesTheErrorDueToParametricResonanceUnderAxialLoads) {
  Scene scene = straight_chain();
  Faults faults;
  const auto structure = build_structure(scene, faults);
  // bending modes are pairs, so the first mode, the third and so on lie in one plane
  for (const auto& [first, second] : {std::pair{0, 0}, {0, 2}}) {
    displace_modes(scene, {{1, 1e-3}, {3, 5e-4}});
    Load load;
    load.axes = Axes::kBody;
    load.forces = {{0, {12.0, 0.0, 0.0}}, {4, {-12.0, 0.0, 0.0}}};
    load.history = SineHistory{(structure->omega[first] + structure->omega[second]) / (2.0 * M_PI), 0.0};
    scene.loads = {load};
    for (const double end : {1.6, 1.8, 2.0}) {
      const JudgedError judged = judged_error(scene, Fidelity::kSeparated, end);
      EXPECT_GT(judged.error, 0.01) << "the error is too small to test anything";
      expect_estimated(judged);
    }
  }
}

/// Returns points of 1 kg in a line, 1 m apart, kept straight by bending springs.
Scene long_chain(int num_points, double stretch) {
  Scene scene;
  for (int k = 0; k < num_points; ++k) add_point(scene, 1.0, {1.0 * k, 0.0, 0.0});
  for (int k = 0; k + 1 < num_points; ++k) add_link(scene, {k, k + 1}, Spring{stretch});
  for (int k = 0; k + 2 < num_points; ++k) add_link(scene, {k, k + 1, k + 2}, BendingSpring{100.0});
  scene.rate = 2000.0;
  scene.tolerance = 1e-3;
  return scene;
}

/// Expects that the estimate follows the growth of the motion. The amplitude on the rung stays as small as
/// its initial value `seed`, while the true motion grows far beyond it.
void expect_growth_estimated(const Scene& scene, double seed, const std::vector<double>& ends) {
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kCoupled}) {
    double largest = 0.0;
    for (const double end : ends) {
      const JudgedError judged = judged_error(scene, rung, end);
      EXPECT_TRUE(judged.level != Verdict::Level::kGood || judged.error < 0.02);
      largest = std::max(largest, judged.error);
      expect_estimated(judged);
    }
    // `coupled` has the stiffness by the load, and grows nearly as it should
    if (rung == Fidelity::kSeparated) {
      EXPECT_GT(largest * scene.tolerance, 100.0 * seed) << "the true motion must have grown";
    }
  }
}

// The true motion grows from a micrometre to beyond the tolerance, but the motion that the rung computes does
// not grow.
TEST(VerdictPhysics, VerdictEstimatesParametricGrowthThatTheRungDoesNotShow) {
  Scene scene = long_chain(5, 3e5);
  Faults faults;
  const auto structure = build_structure(scene, faults);
  displace_modes(scene, {{1, 1e-6}});
  Load load;
  load.axes = Axes::kBody;
  load.forces = {{0, {48.0, 0.0, 0.0}}, {4, {-48.0, 0.0, 0.0}}};
  load.history = SineHistory{structure->omega[0] / M_PI, 0.0};
  scene.loads = {load};
  expect_growth_estimated(scene, 1e-6, {3.9, 4.0, 4.1});
}

// The shadow resolves this mode if its steps are short. With the steps of 8 ms that follow from the lowest
// mode, the mode advances by more than a radian in a step, and the verdict is at best `watch`.
TEST(VerdictPhysics, VerdictEstimatesTheErrorDueToParametricGrowthOfTheSeventeenthMode) {
  Scene scene = long_chain(12, 3e5);
  Faults faults;
  const auto structure = build_structure(scene, faults);
  displace_modes(scene, {{17, 1e-6}});
  Load load;
  load.axes = Axes::kBody;
  load.forces = {{0, {70.0, 0.0, 0.0}}, {11, {-70.0, 0.0, 0.0}}};
  load.history = SineHistory{structure->omega[16] / M_PI, 0.0};
  scene.loads = {load};
  for (const double end : {3.9, 4.0, 4.1})
    EXPECT_NE(judged_error(scene, Fidelity::kSeparated, end).level, Verdict::Level::kGood);
  scene.verdict.step = 1e-3;
  expect_growth_estimated(scene, 1e-6, {3.9, 4.0, 4.1});
}

// A mode excites another mode of half its frequency.
TEST(VerdictPhysics, VerdictEstimatesTheErrorDueToBendingExcitedByAModeOfTwiceItsFrequency) {
  Scene scene = long_chain(5, 1e4);
  Faults faults;
  auto structure = build_structure(scene, faults);
  // the lowest axial mode of five masses in a line has the frequency 2 sin(pi / 10) sqrt(k / m)
  const double omega = 2.0 * structure->omega[0] / (2.0 * std::sin(M_PI / 10.0));
  for (Link& link : scene.links)
    if (auto* const spring = std::get_if<Spring>(&link.kind)) spring->stiffness = omega * omega;
  structure = build_structure(scene, faults);
  Eigen::Index axial = 0;
  (structure->omega.array() - 2.0 * structure->omega[0]).abs().minCoeff(&axial);
  displace_modes(scene, {{1, 1e-6}, {static_cast<int>(axial) + 1, 3e-2}});
  // the amplitude grows over more than one horizon
  expect_growth_estimated(scene, 1e-6, {10.0, 19.0, 20.0, 21.0});
}

// The frequency falls with the square of the amplitude, which shifts the phase a little in every period.
TEST(VerdictPhysics, VerdictEstimatesTheErrorAfterThreeHundredPeriods) {
  Scene scene = hinged_tetrahedra(100.0);
  Faults faults;
  const auto structure = build_structure(scene, faults);
  const double end = 300.0 * 2.0 * M_PI / structure->omega[0];
  displace_modes(scene, {{1, 2e-3}, {2, 1e-3}});
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kCoupled}) {
    const JudgedError judged = judged_error(scene, rung, end);
    EXPECT_GT(judged.error, 0.01) << "the error is too small to test anything";
    expect_estimated(judged);
  }
}

// The Coriolis forces of a spin turn the plane of a high mode.
TEST(VerdictPhysics, VerdictEstimatesTheErrorOfTheFiftiethMode) {
  Scene scene = long_chain(20, 3e5);
  scene.verdict.step = 1e-3;
  scene.initial.angular_velocity = {0.0, 0.0, 0.3};
  displace_modes(scene, {{50, 1e-3}});
  const JudgedError judged = judged_error(scene, Fidelity::kSeparated, 3.0);
  EXPECT_GT(judged.error, 5e-3) << "the error is too small to test anything";
  expect_estimated(judged);
}

// The body begins to spin from rest, so the error is zero in the first ticks and grows with the motion.
TEST(VerdictPhysics, OnTheSpinLoadedRungTheFirstTicksOfASpinAreRatedGood) {
  Scene scene = hinged_tetrahedra(100.0);
  scene.initial.angular_velocity = {0.05, 0.2, 0.1};
  scene.damping.modal_ratio = 0.02;
  EXPECT_EQ(judged_error(scene, Fidelity::kSpinLoaded, 0.02).level, Verdict::Level::kGood);
  EXPECT_NE(judged_error(scene, Fidelity::kSeparated, 1.0).level, Verdict::Level::kGood)
      << "the separated rung omits the centrifugal load";
}

// A mode with more than critical damping creeps to its static position. The spin changes the stiffness that
// acts in this creep.
TEST(VerdictPhysics, VerdictEstimatesTheErrorOfTheCreepOfAnOverdampedSpinningBody) {
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
    const JudgedError judged = judged_error(scene, Fidelity::kSeparated, end);
    expect_estimated(judged);
    EXPECT_NE(judged.level, Verdict::Level::kGood);
  }
}

/// Returns three points in a line, kept straight by a bending spring [N m/rad].
Scene bent_line(double stiffness) {
  Scene scene;
  for (int k = 0; k < 3; ++k) add_point(scene, 1.0 + 0.2 * k, {1.0 * k, 0.0, 0.0});
  for (int k = 0; k < 2; ++k) add_link(scene, {k, k + 1}, Spring{3e3});
  add_link(scene, {0, 1, 2}, BendingSpring{stiffness});
  scene.rate = 500.0;
  publish_everything(scene);
  return scene;
}

// Feedback cancels 97 % of the stiffness that keeps a line straight, so a thrust has a large effect on the
// remaining 3 %. The reference has the remaining stiffness and no feedback.
TEST(VerdictPhysics, VerdictEstimatesTheErrorDueToThrustIfFeedbackCancelsMostOfTheStiffness) {
  constexpr double kHeld = 100.0, kLeft = 3.0;
  constexpr std::array kAngle{1.0, -2.0, 1.0};
  Scene soft = bent_line(kLeft), scene = bent_line(kHeld);
  displace_modes(soft, {{1, 1e-3}});
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
        const JudgedError judged = compare_verdict(scene, rung, end, true_displacements(soft, end));
        EXPECT_GT(judged.estimate, 0.5 * judged.error);
        EXPECT_TRUE(judged.level != Verdict::Level::kGood || judged.error < 0.05);
      }
  }
}

// A dashpot is so strong that it locks two points. The vibration then does not decay, and its error does not
// decay either.
TEST(VerdictPhysics, VerdictEstimatesErrorsThatDoNotDecayBecauseADashpotLocks) {
  Scene scene = hinged_tetrahedra(100.0), locked = scene;
  add_link(locked, {2, 4}, Spring{1e7});
  add_link(scene, {2, 4}, Dashpot{3e4});
  displace_modes(locked, {{1, 1e-4}, {2, 1e-4}});
  scene.initial = locked.initial;
  scene.tolerance = 1e-4;
  scene.verdict.horizon = 10.0;  // the shadow is on the rung `full`, and not all of its horizons are judged
  Load load;
  load.axes = Axes::kBody;
  load.forces = {{3, {4.0, 0.0, 0.0}}, {5, {-4.0, 0.0, 0.0}}};
  scene.loads = {load};
  for (const double end : {1.0, 4.0}) {
    const JudgedError judged = judged_error(scene, Fidelity::kSeparated, end);
    expect_estimated(judged);
    EXPECT_TRUE(judged.level != Verdict::Level::kGood || judged.error < 0.05);
  }
}

// The rung `full` divides the tick, so that no substep is too long for a strong dashpot.
TEST(VerdictPhysics, OnTheFullRungAStrongDashpotIsRatedGood) {
  Scene scene;
  for (int k = 0; k < 4; ++k) add_point(scene, 1.0, {1.0 * k, 0.1 * (k % 2), 0.05 * k * k});
  for (int k = 0; k < 3; ++k)
    add_link(
        scene, {k, k + 1},
        Beam{.EA = 1e4, .GJ = 100.0, .EI_y = 100.0, .EI_z = 120.0, .y_axis = Eigen::Vector3d(0.0, 0.2, 1.0)});
  add_link(scene, {0, 3}, Dashpot{1000.0});
  scene.rate = 200.0;
  displace_modes(scene, {{1, 1e-5}});
  const JudgedError judged = judged_error(scene, Fidelity::kFull, 1.0);
  EXPECT_LT(judged.error, 1e-3);
  EXPECT_EQ(judged.level, Verdict::Level::kGood);
}

// Dashpots between the points of a line carry forces while the line creeps. The tension of these dashpots
// stiffens bending as the tension of springs does.
TEST(VerdictPhysics, VerdictEstimatesTheErrorDueToTheTensionOfDashpots) {
  Scene scene = bent_line(100.0);
  for (int k = 0; k < 2; ++k) add_link(scene, {k, k + 1}, Dashpot{3e3});
  displace_modes(scene, {{1, 1e-3}});
  Load load;
  load.axes = Axes::kBody;
  load.forces = {{0, {-6.0, 0.0, 0.0}}, {2, {6.0, 0.0, 0.0}}};
  scene.loads = {load};
  for (const double end : {0.336, 1.762}) {
    const JudgedError judged = judged_error(scene, Fidelity::kSeparated, end);
    EXPECT_GT(judged.error, 0.05) << "the error is too small to test anything";
    expect_estimated(judged);
    EXPECT_NE(judged.level, Verdict::Level::kGood);
  }
}

}  // namespace
}  // namespace freeflex::testing
