// Checks the methods with which freeflex is compared on systems at true geometry: beams, plates, turning
// rigid bodies and damping. Each method must converge at its order to the motion that SUNDIALS computes.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/reference/structures.hpp"
#include "tests/reference/true_geometry.hpp"
#include "tools/verification/reference/elastic_error.hpp"
#include "tools/verification/reference/rivals.hpp"

namespace freeflex::testing {
namespace {

/// A scene that spins and vibrates, with the motion that the reference computes by SUNDIALS.
struct Moving {
  CartesianSystem system;
  double end;  // [s]
  ElasticScale scale;
  Eigen::Matrix3Xd u;  // [m] displacements at the end

  Moving(Scene scene, double spin, double amplitude, double end_time) : end(end_time) {
    scene.initial.angular_velocity = spin * Eigen::Vector3d(0.3, -0.2, 1.0);
    for (int i = 0; i < static_cast<int>(scene.points.size()); ++i)
      scene.initial.points.push_back(
          {i, amplitude * Eigen::Vector3d(std::sin(2.0 * i), std::cos(3.0 * i), std::sin(5.0 * i)),
           Eigen::Vector3d::Zero()});
    system = true_geometry_of(scene);
    const double times[] = {end};
    ReferenceOptions options;
    options.tolerance = 1e-12;
    const ReferenceRun run = integrate(system, times, options);
    EXPECT_EQ(run.error, "");
    scale = run.scale;
    u = elastic_displacements(system.mass, system.r, run.states.at(0).p_W);
  }

  double error(Rival rival, double step, double tolerance = 0.0) const {
    std::string refusal;
    const auto method = make_rival(rival, system, refusal);
    EXPECT_NE(method, nullptr) << refusal;
    if (!method) return NAN;
    const double times[] = {end};
    Eigen::Matrix3Xd p_W;
    const RivalRun run = method->run(times, {step, tolerance, scale, {}},
                                     [&](std::size_t, const CartesianState& state) { p_W = state.p_W; });
    EXPECT_EQ(run.error, "");
    return elastic_error(elastic_displacements(system.mass, system.r, p_W), u);
  }

  /// Halves the step from `coarsest` [s] twice. The error must fall by 2^order each time.
  void expect_order(Rival rival, double coarsest, double order) const {
    double before = error(rival, coarsest);
    for (const double step : {0.5 * coarsest, 0.25 * coarsest}) {
      const double now = error(rival, step);
      EXPECT_NEAR(std::log2(before / now), order, 0.13 * order)
          << static_cast<int>(rival) << " at " << step << ": " << before << " to " << now;
      before = now;
    }
  }
};

TEST(TrueRivals, HaveTheirOrderOnAFrameOfBeams) {
  Random random(3);
  const Moving frame(chain(random), 0.5, 1e-3, 0.05);
  frame.expect_order(Rival::kVerlet, 4e-4, 2.0);
  frame.expect_order(Rival::kRungeKutta4, 8e-4, 4.0);
  frame.expect_order(Rival::kStoermer8, 2e-3, 8.0);
  frame.expect_order(Rival::kKahanLi8, 1e-3, 8.0);
}

TEST(TrueRivals, HaveTheirOrderOnPlates) {
  Random random(3);
  const Moving plates(sheet(random), 0.5, 1e-3, 0.02);
  plates.expect_order(Rival::kVerlet, 2e-4, 2.0);
  plates.expect_order(Rival::kStoermer8, 1.4e-3, 8.0);
}

TEST(TrueRivals, HaveTheirOrderOnTurningBodies) {
  Random random(3);
  const Moving turning(bodies(random), 2.0, 1e-3, 0.05);
  turning.expect_order(Rival::kMidpoint8, 1e-3, 8.0);
  turning.expect_order(Rival::kMidpoint12, 5e-3, 12.0);
}

TEST(TrueRivals, MidpointHasItsOrderOnDampedBeams) {
  Random random(3);
  Scene scene = chain(random);
  scene.damping.modal_ratio = 0.05;
  add_link(scene, 0, 3, Dashpot{20.0});
  Moving(scene, 0.5, 1e-3, 0.05).expect_order(Rival::kMidpoint8, 4e-3, 8.0);
}

TEST(TrueRivals, HighOrdersReachTheMotionOfSundials) {
  Random random(5);
  const Moving frame(chain(random), 0.5, 1e-3, 0.05);
  EXPECT_LT(frame.error(Rival::kStoermer12, 1e-3), 1e-9);
  EXPECT_LT(frame.error(Rival::kStoermer16, 2e-3), 1e-9);
  const Moving turning(bodies(random), 2.0, 1e-3, 0.05);
  EXPECT_LT(turning.error(Rival::kMidpoint16, 2e-3), 1e-9);
}

// DIRK and BDF use a Jacobian by differences
TEST(TrueRivals, ErrorOfPackagedMethodsFallsWithTheirTolerance) {
  Random random(3);
  Scene damped = chain(random);
  damped.damping.modal_ratio = 0.05;
  for (const Scene& scene : {chain(random), damped, bodies(random)}) {
    const Moving moving(scene, 0.5, 1e-3, 0.02);
    for (const Rival rival : {Rival::kErk4, Rival::kErk8, Rival::kDirk5, Rival::kAdams, Rival::kBdf}) {
      const double loose = moving.error(rival, 0.0, 1e-5), tight = moving.error(rival, 0.0, 1e-8);
      EXPECT_LT(tight, 1e-4) << static_cast<int>(rival);
      EXPECT_LT(tight, 0.05 * loose) << static_cast<int>(rival);
    }
  }
}

TEST(TrueRivals, ExplainWhichMethodTheForcesNeed) {
  Random random(3);
  const CartesianSystem beams = true_geometry_of(chain(random)), turning = true_geometry_of(bodies(random));
  std::string error;
  EXPECT_EQ(make_rival(Rival::kMidpoint8, beams, error), nullptr);
  EXPECT_EQ(error, "the forces depend on positions alone, for which Stoermer's method is faster");
  EXPECT_EQ(make_rival(Rival::kRungeKutta4, turning, error), nullptr);
  EXPECT_EQ(error, "the forces depend on velocities, for which the method is not made");
  EXPECT_EQ(make_rival(Rival::kKrylov, beams, error), nullptr);
  EXPECT_EQ(error, "the method multiplies spring by spring, and is made for springs and bars only");
}

}  // namespace
}  // namespace freeflex::testing
