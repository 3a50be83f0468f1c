// Checks the methods with which freeflex is compared on bodies with inertia and wheels: against the integrals
// of the free top, and against the copy of point masses on rigid links that SUNDIALS integrates.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/reference/true_geometry.hpp"
#include "tools/verification/reference/elastic_error.hpp"
#include "tools/verification/reference/rivals.hpp"

namespace freeflex::testing {
namespace {

/// A body with inertia and an offset at each end of two beams, which spins.
Scene craft(double momentum, double motor) {
  Scene scene;
  for (int i = 0; i < 3; ++i) add_point(scene, i == 1 ? 1.0 : 3.0, Eigen::Vector3d(i, 0.1 * i * i, 0.05 * i));
  for (const int i : {0, 2}) {
    scene.points[index(i)].inertia = Eigen::Vector3d(0.2, 0.3, 0.4).asDiagonal();
    scene.points[index(i)].inertia(0, 1) = scene.points[index(i)].inertia(1, 0) = 0.03;
    scene.points[index(i)].offset = Eigen::Vector3d(0.05, 0.1, -0.08);
  }
  const Beam beam{.EA = 1e5, .GJ = 300.0, .EI_y = 200.0, .EI_z = 400.0, .y_axis = {0.1, 0.9, -0.2}};
  add_link(scene, 0, 1, beam);
  add_link(scene, 1, 2, beam);
  scene.initial.angular_velocity = {1.0, 2.0, -1.5};
  Load load;
  load.name = "load";
  load.axes = Axes::kLocal;
  load.torques = {{2, {3.0, -2.0, 5.0}}};
  load.history = SineHistory{3.0, 0.4};
  scene.loads.push_back(load);
  if (momentum == 0.0) return scene;
  Wheel wheel;
  wheel.name = "wheel";
  wheel.point = 0;
  wheel.axis = Eigen::Vector3d(1.0, 2.0, 2.0) / 3.0;
  wheel.momentum = momentum;
  scene.wheels.push_back(wheel);
  Load drive;
  drive.name = "drive";
  drive.wheels = {{0, motor}};
  scene.loads.push_back(drive);
  return scene;
}

struct Moving {
  CartesianSystem system;
  ElasticScale scale;
  Eigen::Matrix3Xd p_W;
  static constexpr double kEnd = 0.1;  // [s]

  explicit Moving(const Scene& scene) : system(true_geometry_of(scene)) {
    const double times[] = {kEnd};
    ReferenceOptions options;
    options.tolerance = 1e-12;
    options.method = ReferenceMethod::kAdams;
    const ReferenceRun run = integrate(system, times, options);
    EXPECT_EQ(run.error, "");
    scale = run.scale;
    p_W = run.states.at(0).p_W;
  }
  /// Returns the largest distance of a point from the motion by SUNDIALS, over the displacement.
  double error(Rival rival, double step, double tolerance = 0.0) const {
    std::string refusal;
    const auto method = make_rival(rival, system, refusal);
    EXPECT_NE(method, nullptr) << refusal;
    if (!method) return NAN;
    const double times[] = {kEnd};
    Eigen::Matrix3Xd found;
    const RivalRun run = method->run(times, {step, tolerance, scale, {}},
                                     [&](std::size_t, const CartesianState& state) { found = state.p_W; });
    EXPECT_EQ(run.error, "");
    return (found - p_W).colwise().norm().maxCoeff() / scale.displacement;
  }
  /// The error must fall by at least 2^(0.85 order) as the step falls to half of `step` [s].
  void expect_order(Rival rival, double step, double order) const {
    const double before = error(rival, step);
    const double now = error(rival, 0.5 * step);
    std::printf("rival %d, %.2g ms: %.1e, order %.1f\n", static_cast<int>(rival), 500.0 * step, now,
                std::log2(before / now));
    EXPECT_GT(std::log2(before / now), 0.85 * order);
  }
};

TEST(BodyRivals, HaveTheirOrderAndReachTheMotionOfPointMasses) {
  for (const double momentum : {0.0, 4.0}) {
    const Moving moving(craft(momentum, 20.0));
    moving.expect_order(Rival::kVerlet, 4e-4, 2.0);
    moving.expect_order(Rival::kStoermer8, 4e-3, 8.0);
    moving.expect_order(Rival::kMidpoint8, 4e-3, 8.0);
    for (const Rival rival :
         {Rival::kStoermer12, Rival::kStoermer16, Rival::kMidpoint12, Rival::kMidpoint16}) {
      const double off = moving.error(rival, 1e-3);
      std::printf("rival %d: %.1e\n", static_cast<int>(rival), off);
      EXPECT_LT(off, 3e-9);
    }
    EXPECT_LT(moving.error(Rival::kErk8, 0.0, 1e-9), 1e-5);
    EXPECT_LT(moving.error(Rival::kBdf, 0.0, 1e-8), 1e-3);
  }
}

/// Returns the kinetic energy and the angular momentum in space of a free body at the end of a run.
TEST(BodyRivals, FreeTopAndGyrostatKeepEnergyAndMomentum) {
  for (const double momentum : {0.0, 0.7}) {
    Scene scene = craft(momentum, 0.0);
    scene.loads.clear();
    scene.links.clear();
    scene.points.resize(1);
    scene.points[0].offset.setZero();
    const CartesianSystem system = true_geometry_of(scene);
    const double times[] = {1e-9, 3.0};
    for (const Rival rival : {Rival::kStoermer12, Rival::kMidpoint12}) {
      std::string refusal;
      const auto method = make_rival(rival, system, refusal);
      ASSERT_NE(method, nullptr) << refusal;
      std::vector<CartesianInvariants> found;
      std::vector<Eigen::Vector3d> total;
      const RivalRun run =
          method->run(times, {0.05, 0.0, {1.0, 1.0}, {}}, [&](std::size_t, const CartesianState& state) {
            found.push_back(invariants(system, state));
            const Eigen::Vector3d mean = state.p_W * system.mass / system.mass.sum();
            const Eigen::Matrix3d R = fit_rotation(system.mass, system.r, state.p_W.colwise() - mean);
            total.push_back(found.back().angular_momentum);
            if (!scene.wheels.empty()) total.back() += R * (momentum * scene.wheels[0].axis);
          });
      ASSERT_EQ(run.error, "");
      ASSERT_EQ(found.size(), 2u);
      const double energy = std::abs(found[1].kinetic / found[0].kinetic - 1.0),
                   moment = (total[1] - total[0]).norm() / total[0].norm();
      std::printf("rival %d: energy %.1e, momentum %.1e\n", static_cast<int>(rival), energy, moment);
      EXPECT_LT(energy, 1e-11);
      EXPECT_LT(moment, 1e-11);
    }
  }
}

}  // namespace
}  // namespace freeflex::testing
