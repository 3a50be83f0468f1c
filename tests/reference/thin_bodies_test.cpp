// Bodies with inertia about two axes only. The rungs `corotational` and `full` refuse them; a small inertia
// about the third axis is the remedy. Its cost is measured against the Cartesian reference, from which the
// limit without this inertia is extrapolated.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/motion.hpp"
#include "core/plan/make_plan.hpp"
#include "core/step/readout.hpp"
#include "tests/reference/true_geometry.hpp"
#include "tests/setup/make_scene.hpp"
#include "tools/verification/reference/integrate.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kEnd = 0.4;  // [s]
constexpr int kNumPoints = 5;

// A thin body between three beams, which spins and is pushed. The body has `share` of its largest moment of
// inertia about the axis.
Scene held(double share, const Vector3d& axis) {
  Scene scene;
  const Vector3d at[kNumPoints] = {
      {0.0, 0.0, 0.0}, {1.0, 0.2, 0.1}, {2.0, -0.1, 0.3}, {3.0, 0.2, 0.0}, {1.8, 1.1, 0.2}};
  for (const Vector3d& each : at) add_point(scene, 1.5, each);
  const Vector3d u = axis.normalized();
  scene.points[2].mass = 3.0;
  scene.points[2].inertia = 0.3 * (Matrix3d::Identity() - (1.0 - share) * u * u.transpose());
  const Beam beam{2e5, 300.0, 200.0, 400.0, {0.1, 0.9, -0.2}};
  for (const auto& [i, j] : {std::pair{0, 1}, {1, 2}, {2, 3}, {2, 4}}) add_link(scene, i, j, beam);
  scene.fidelity = Fidelity::kCorotational;
  scene.initial.angular_velocity = {2.0, -1.0, 3.0};
  Load load;
  load.name = "push";
  load.forces = {{3, {10.0, 60.0, 40.0}}, {0, {0.0, -30.0, 50.0}}};
  load.history = PulseHistory{0.0, 0.1};
  scene.loads = {load};
  return scene;
}

Matrix3Xd positions_of_reference(const Scene& scene) {
  const double times[] = {kEnd};
  ReferenceOptions options;
  options.method = ReferenceMethod::kAdams;
  options.tolerance = 1e-10;
  const ReferenceRun run = integrate(true_geometry_of(scene), times, options);
  EXPECT_EQ(run.error, "");
  return run.states.at(0).p_W.leftCols(kNumPoints);
}

// Returns the largest distance of a point from `truth` at the end over the largest elastic displacement.
double error_of(Scene scene, double rate, const Matrix3Xd& truth) {
  scene.rate = rate;
  const Plan plan = compile(scene);
  Motion motion(plan, kMotionAlone);
  double displacement = 0.0, off = 0.0;
  for (long k = 0; k < std::lround(kEnd * rate); ++k) {
    EXPECT_EQ(motion.advance().status, StepStatus::kOk);
    for (int i = 0; i < kNumPoints; ++i)
      displacement = std::max(displacement, length(read_point(plan, motion.state(), i).V_B));
  }
  for (int i = 0; i < kNumPoints; ++i) {
    const Vec3 p = read_point(plan, motion.state(), i).p_W;
    off = std::max(off, (Eigen::Map<const Vector3d>(p.data()) - truth.col(i)).norm());
  }
  return off / displacement;
}

// The error is proportional to the share. Where the tick does not resolve the vibration about the thin axis,
// its effect on the slow motion is missing, and a smaller share does not help.
TEST(ThinBodies, ASubstituteInertiaCostsAShareOfTheDisplacement) {
  for (const Vector3d& axis : {Vector3d(0.3, 0.2, 1.0), Vector3d(2.0, 0.0, -0.1)}) {
    const Matrix3Xd first = positions_of_reference(held(1e-2, axis)),
                    second = positions_of_reference(held(1e-3, axis)),
                    limit = second + (second - first) / 9.0;
    const double own = error_of(held(1e-3, axis), 4000.0, second);
    std::printf("1e-3 at 4 kHz: off the reference with the same inertia by %.1e\n", own);
    EXPECT_LT(own, 1e-6);
    for (const auto& [share, rate, bound] : {std::array{1e-2, 4e3, 4e-3},
                                             {1e-3, 4e3, 4e-4},
                                             {1e-3, 1e3, 6e-4},
                                             {1e-4, 4e3, 6e-5},
                                             {1e-6, 1e3, 2e-3},
                                             {1e-6, 250.0, 4e-3}}) {
      const double error = error_of(held(share, axis), rate, limit);
      std::printf("share %.0e at %4.0f Hz: off the limit by %.1e\n", share, rate, error);
      EXPECT_LT(error, bound);
    }
  }
}

// At 4 kHz the stiffest mode is a rotation that advances by 2.6 rad in a tick, and no mode is filtered. The
// step ended there with a null pointer.
TEST(ThinBodies, AStiffRotationBetweenTwoAndPiRadiansATickIsAdvanced) {
  Scene scene = held(1e-4, {0.3, 0.2, 1.0});
  scene.rate = 4000.0;
  const double phase = build(scene).omega.maxCoeff() / scene.rate;
  ASSERT_GT(phase, 2.0);
  ASSERT_LT(phase, M_PI);
  const Plan plan = compile(scene);
  EXPECT_TRUE(plan.coupled.curve.stiff.empty());
  Motion motion(plan, kMotionAlone);
  for (int k = 0; k < 100; ++k) ASSERT_EQ(motion.advance().status, StepStatus::kOk);
}

TEST(ThinBodies, AreRefusedWithTheInertiaThatIsEnough) {
  for (const Fidelity fidelity : {Fidelity::kCorotational, Fidelity::kFull}) {
    Scene scene = held(0.0, {0.3, 0.2, 1.0});
    scene.fidelity = fidelity;
    scene.rate = 1000.0;
    Faults faults;
    EXPECT_FALSE(make_plan(scene, build(scene), faults).has_value());
    ASSERT_FALSE(faults.empty());
    EXPECT_NE(faults.back().message.find("1e-3 of the largest"), std::string::npos) << faults.back().message;
  }
  Scene scene = held(1e-8, {0.3, 0.2, 1.0});
  scene.rate = 1000.0;
  Faults faults;
  EXPECT_FALSE(make_plan(scene, build(scene), faults).has_value());
  ASSERT_FALSE(faults.empty());
  EXPECT_NE(faults.back().message.find("the stiffest mode"), std::string::npos) << faults.back().message;
}

// Nothing holds the joints of a straight chain about its line. The set-up warns if bending in both planes
// turns them, and not if a point has an inertia about the line.
TEST(ThinBodies, ASetUpWarnsOfAStraightChainThatBendsUnequally) {
  const auto warnings = [](double EI_z, double inertia) {
    Scene scene;
    for (int i = 0; i < 4; ++i) {
      add_point(scene, 1.0, {1.0 * i, 0.0, 0.0});
      if (i > 0) add_link(scene, i - 1, i, Beam{1e6, 800.0, 1e5, EI_z, {0.0, 1.0, 0.0}});
    }
    scene.points[0].inertia = inertia * Eigen::Matrix3d::Identity();
    scene.fidelity = Fidelity::kCorotational;
    Faults faults;
    EXPECT_TRUE(make_plan(scene, build(scene), faults).has_value());
    return std::count_if(faults.begin(), faults.end(), [](const Fault& fault) {
      return fault.message.find("the joints of this straight chain about its line") != std::string::npos;
    });
  };
  EXPECT_EQ(warnings(1.1e5, 0.0), 1);
  EXPECT_EQ(warnings(1e5, 0.0), 0);
  EXPECT_EQ(warnings(1.1e5, 1e-3), 0);
}

}  // namespace
}  // namespace freeflex::testing
