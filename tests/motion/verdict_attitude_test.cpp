// These tests check verdicts on motions whose true attitude departs from the attitude on the rung, so that
// loads fixed in the world and the centrifugal load act in wrong directions.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "tests/motion/verdict_cases.hpp"

namespace freeflex::testing {
namespace {

// Near the intermediate axis small attitude errors grow, and the error of the centrifugal load grows with
// them.
TEST(VerdictAttitude, VerdictEstimatesTheErrorDueToAttitudeErrorsAboutTheIntermediateAxis) {
  Scene scene = hinged_tetrahedra(100.0);
  Faults faults;
  const auto structure = build_structure(scene, faults);
  const double lowest = structure->omega[static_cast<Eigen::Index>(structure->mechanisms.size())];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(structure->mass_properties.inertia);
  scene.initial.angular_velocity =
      0.08 * lowest * (axes.eigenvectors().col(1) + 0.2 * axes.eigenvectors().col(0));
  scene.damping.modal_ratio = 0.02;
  const double period = 2.0 * M_PI / scene.initial.angular_velocity.norm();
  for (const double revolutions : {0.5, 2.0, 8.0, 25.0}) {
    scene.verdict.horizon = 10.0;
    EXPECT_NE(judged_error(scene, Fidelity::kSpinLoaded, revolutions * period).level, Verdict::Level::kGood);
    scene.verdict.horizon = 300.0;
    expect_estimated(judged_error(scene, Fidelity::kSpinLoaded, revolutions * period));
  }
  // the elastic error of `coupled` is small, but its attitude departs
  const JudgedError coupled = judged_error(scene, Fidelity::kCoupled, 25.0 * period);
  expect_estimated(coupled);
  EXPECT_LT(coupled.error, kGoodElastic);
  EXPECT_NE(coupled.level, Verdict::Level::kOutside);
}

/// Holds a cross of seven points that rotates about its intermediate axis. The rate `spin` [rad/s] is a
/// hundredth of the lowest frequency.
struct Cross {
  Scene scene;
  double lowest = 0.0, spin = 0.0, force = 0.0;
  explicit Cross(double damping) {
    for (const double x : {-1.0, 0.0, 1.0}) add_point(scene, 1.0, {x, 0.0, 0.0});
    for (const double side : {1.0, -1.0}) add_point(scene, 0.6, {0.0, 0.8 * side, 0.05 * side});
    for (const double side : {1.0, -1.0}) add_point(scene, 0.02, {0.02, 0.02, 0.4 * side});
    for (int a = 0; a < 7; ++a)
      for (int b = a + 1; b < 7; ++b) add_link(scene, {a, b}, Spring{1000.0 + 37.0 * a + 91.0 * b});
    scene.damping.modal_ratio = damping;
    publish_everything(scene);
    Faults faults;
    const auto structure = build_structure(scene, faults);
    scene.rate = std::ceil(structure->omega.maxCoeff());
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(structure->mass_properties.inertia);
    lowest = structure->omega.minCoeff();
    spin = 0.01 * lowest;
    force = 2e-3 * lowest * lowest;
    scene.initial.angular_velocity = spin * axes.eigenvectors().col(1);
  }
  /// Returns forces in world axes that bend the cross. On the undeformed cross the forces have no resultant
  /// and no moment.
  Load load(double share) const {
    const double f = share * force;
    Load load;
    load.axes = Axes::kWorld;
    load.forces = {{0, {0.5 * f, f, 0.2 * f}}, {1, {-f, -2.0 * f, -0.4 * f}}, {2, {0.5 * f, f, 0.2 * f}}};
    return load;
  }
  double whole_ticks(double time) const { return std::round(time * scene.rate) / scene.rate; }
};
// Expects an estimate near the error, whether the run is longer than a horizon or not.
void expect_estimated_over_horizons(Scene scene, double end, std::span<const ForceCommand> first = {},
                                    const std::vector<Load>* of_truth = nullptr,
                                    Fidelity rung = Fidelity::kSpinLoaded) {
  publish_everything(scene);
  end = std::round(end * scene.rate) / scene.rate;
  Scene loaded = scene;
  if (of_truth != nullptr) loaded.loads = *of_truth;
  const auto truth = true_displacements(loaded, end);
  for (const double horizon : {10.0, 100.0}) {
    scene.verdict.horizon = horizon;
    const JudgedError judged = compare_verdict(scene, rung, end, truth, first);
    EXPECT_TRUE(judged.level != Verdict::Level::kGood || judged.error < kGoodElastic);
    expect_estimated(judged);
  }
}

// The loads act on displaced points, so they have a torque that rotates the body. The loads then act in other
// directions in body axes. A command has the same effect as a load of the scene.
TEST(VerdictAttitude, VerdictEstimatesTheErrorDueToWorldLoadsThatBothBendAndRotateTheBody) {
  const Cross cross(0.1);
  Scene scene = cross.scene;
  scene.loads = {cross.load(1.0)};
  for (int point = 0; point < 7; ++point) scene.pushable.push_back(point);
  ForceCommand command = make_command(0, 1, Axes::kWorld);
  for (const PointLoad& each : scene.loads[0].forces) add_force(command, each.point, each.force);
  Scene pushed = scene;
  pushed.loads.clear();
  for (const double angle : {0.3, 1.0, 2.0, 4.0}) {
    const double end = cross.whole_ticks(angle / cross.spin);
    expect_estimated_over_horizons(scene, end);
    expect_estimated_over_horizons(pushed, end, std::span(&command, 1), &scene.loads);
  }
}

// The first pulse rotates the body, so later pulses excite the body in another direction. The vibration that
// the last pulse excites continues after the loads have ended.
TEST(VerdictAttitude, VerdictEstimatesTheErrorOfTheVibrationAfterMisdirectedLoadsEnd) {
  const Cross cross(0.005);
  const double period = 2.0 * M_PI / cross.lowest;
  Scene scene = cross.scene;
  scene.loads = {cross.load(1.0), cross.load(1.0)};
  scene.loads[0].history = PulseHistory{0.0, cross.whole_ticks(1.5 / cross.spin)};
  const double start = cross.whole_ticks(4.5 / cross.spin);
  scene.loads[1].history = PulseHistory{start, cross.whole_ticks(0.5 * period)};
  for (const double periods : {0.7, 3.4}) expect_estimated_over_horizons(scene, start + periods * period);
  EXPECT_EQ(judged_error(scene, Fidelity::kCoupled, start + 3.4 * period).level, Verdict::Level::kGood);
}

// A prism whose middle moves in a circle has angular momentum. As this vibration decays, the body begins to
// rotate.
TEST(VerdictAttitude, VerdictEstimatesTheErrorDueToTheSpinThatADecayingCircularVibrationCauses) {
  Scene scene;
  for (int bay = 0; bay < 3; ++bay)
    for (int corner = 0; corner < 3; ++corner) {
      const double angle = 2.0 * M_PI * corner / 3.0;
      add_point(scene, bay == 1 ? 2.0 : 1.0, {bay - 1.0, 0.1 * std::cos(angle), 0.1 * std::sin(angle)});
    }
  for (int bay = 0; bay < 3; ++bay)
    for (int corner = 0; corner < 3; ++corner) {
      const int from = 3 * bay + corner;
      add_link(scene, {from, 3 * bay + (corner + 1) % 3}, Spring{2e4});
      for (int to = 0; to < 3 && bay < 2; ++to) add_link(scene, {from, 3 * bay + 3 + to}, Spring{2e4});
    }
  scene.damping.modal_ratio = 0.01;
  Faults faults;
  const auto structure = build_structure(scene, faults);
  scene.rate = 2.0 * structure->omega.maxCoeff();
  // modes 2 and 3 are a pair of bending modes of equal frequency in two planes
  const double omega = structure->omega[1], amplitude = 1.5e-3, force = 5e-4 * omega * omega;
  ASSERT_NEAR(structure->omega[2], omega, 1e-9 * omega);
  displace_modes(scene, {{2, amplitude}});
  for (Initial::PointElastic& point : scene.initial.points)
    point.velocity = omega * amplitude * structure->shapes.block<3, 1>(3 * point.point, 2);
  Load load;
  load.axes = Axes::kWorld;
  for (int point = 0; point < 9; ++point)
    load.forces.push_back({point, {0.0, point / 3 == 1 ? -2.0 * force : force, 0.0}});
  scene.loads = {load};
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kSpinLoaded})
    expect_estimated_over_horizons(scene, 25.0, {}, nullptr, rung);
}

}  // namespace
}  // namespace freeflex::testing
