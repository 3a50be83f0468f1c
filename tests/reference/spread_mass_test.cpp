// Mass that is spread over links on the rung `corotational`: energy, published accelerations, the limit of
// many point masses, and the frequencies of a spinning beam.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/motion.hpp"
#include "core/scene/bodies.hpp"
#include "core/steady/relative_equilibrium.hpp"
#include "core/step/readout.hpp"
#include "tests/reference/energy_drift.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Vector3d;

// A hub with inertia, an offset and a wheel carries a boom with mass, at whose end a light body turns far.
Scene hub_and_boom(int num_elements, double mass_per_length) {
  Scene scene;
  add_point(scene, 6.0, {0.0, 0.0, 0.0});
  scene.points[0].inertia << 3.0, 0.2, 0.1, 0.2, 2.0, 0.0, 0.1, 0.0, 4.0;
  scene.points[0].offset = {0.05, -0.1, 0.02};
  const double step = 3.6 / num_elements;
  for (int i = 1; i <= num_elements; ++i) add_point(scene, 0.0, {step * i, 0.0, 0.0});
  for (int i = 0; i < num_elements; ++i) {
    Beam beam{2e5, 300.0, 60.0, 90.0, {0.0, 1.0, 0.2}};
    beam.mass_per_length = mass_per_length;
    add_link(scene, i, i + 1, beam);
  }
  PointMass& tip = scene.points[index(num_elements)];
  tip.mass = 0.5;
  tip.inertia = Vector3d(0.02, 0.03, 0.025).asDiagonal();
  Wheel wheel;
  wheel.name = "wheel";
  wheel.point = 0;
  wheel.axis = Vector3d(0.3, -0.5, 0.8).normalized();
  wheel.momentum = 1.5;
  scene.wheels = {wheel};
  scene.fidelity = Fidelity::kFull;
  scene.initial.angular_velocity = {0.7, -0.4, 1.1};
  scene.initial.points = {{num_elements, {0.0, 0.0, 0.0}, {0.0, 6.0, 12.0}}};
  return scene;
}

// The change of energy is of order 4 in the substep.
TEST(MassOfLinks, AHubWithAWheelAndABoomConservesEnergy) {
  double before = 0.0;
  for (const double rate : {4000.0, 8000.0}) {
    Scene scene = hub_and_boom(4, 0.8);
    scene.rate = rate;
    const Plan plan = compile(scene);
    ASSERT_EQ(plan.coupled.kinetics.form, PlanKinetics::Form::kSpread);
    const EnergyDrift drift = energy_drift(plan, 2 * static_cast<int>(rate));
    std::printf("%4.0f Hz: energy changes by %.1e of the largest strain energy %.3f J\n", rate,
                drift.most / drift.strain, drift.strain);
    EXPECT_LT(drift.most, 2e-5 * drift.strain);
    if (before > 0.0) {
      EXPECT_LT(drift.most, 0.1 * before);
    }
    before = drift.most;
  }
}

// Velocities and accelerations of points, on bodies and free, are those of their published positions, while a
// fast wheel turns and its motor drives it.
TEST(MassOfLinks, ReadsTheRatesOfThePublishedPositions) {
  Scene scene = hub_and_boom(4, 0.8);
  scene.rate = 8000.0;
  scene.wheels[0].momentum = 60.0;
  Load motor;
  motor.wheels = {{0, 20.0}};
  scene.loads = {motor};
  const Plan plan = compile(scene);
  Motion motion(plan, kMotionAlone);
  std::vector<PointState> states[3];
  for (long k = 0; k < 2402; ++k) {
    ASSERT_EQ(motion.advance().status, StepStatus::kOk);
    for (std::size_t i = 0; i < plan.points.size() && k >= 2399; ++i)
      states[k - 2399].push_back(read_point(plan, motion.state(), static_cast<int>(i)));
  }
  const auto at = [](const Vec3& x) { return Eigen::Map<const Vector3d>(x.data()); };
  double of_v = 0.0, of_a = 0.0, v = 0.0, a = 0.0;
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const Vector3d mean = 0.5 * scene.rate * (at(states[2][i].p_W) - at(states[0][i].p_W)),
                   gain = 0.5 * scene.rate * (at(states[2][i].v_W) - at(states[0][i].v_W));
    of_v = std::max(of_v, (mean - at(states[1][i].v_W)).norm());
    of_a = std::max(of_a, (gain - at(states[1][i].a_W)).norm());
    v = std::max(v, mean.norm());
    a = std::max(a, gain.norm());
  }
  std::printf("velocities off by %.1e, accelerations by %.1e\n", of_v / v, of_a / a);
  // differences over two ticks of 1/8000 s have an error of order h^2; twice what was measured
  EXPECT_LT(of_v, 1e-4 * v);
  EXPECT_LT(of_a, 7e-4 * a);
}

// A boom at rest beside an attractor: the angular momentum begins to grow by the torque of the gradient of
// the field on a rigid body, 3 mu rho x I rho / rho^5, and the links carry its tension.
TEST(MassOfLinks, AnAttractorTurnsABoomWithSpreadMass) {
  Scene scene = hub_and_boom(4, 0.8);
  scene.wheels.clear();
  scene.initial = {};
  scene.initial.position = {30.0, 40.0, 5.0};
  scene.attractor.mu = 4e5;
  scene.rate = 1000.0;
  const Plan plan = compile(scene);
  Motion motion(plan, kMotionAlone);
  constexpr int kTicks = 20;
  for (int k = 0; k < kTicks; ++k) ASSERT_EQ(motion.advance().status, StepStatus::kOk);
  const auto at = [](const Vec3& x) { return Eigen::Map<const Vector3d>(x.data()); };
  const Vector3d rho = at(plan.initial.p_WB);
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> I(plan.inertia.data());
  const Vector3d torque = 3.0 * scene.attractor.mu / std::pow(rho.norm(), 5) * rho.cross(I * rho);
  const Vector3d gained = scene.rate / kTicks * at(motion.state().H_W);
  const double strain = read_invariants(plan, motion.state()).potential;
  std::printf("torque %.4f N m, off by %.1e; strain energy %.1e J\n", torque.norm(),
              (gained - torque).norm() / torque.norm(), strain);
  EXPECT_LT((gained - torque).norm(), 5e-3 * torque.norm());
  EXPECT_GT(strain, 0.0);
}

// Large motion of a boom with spread mass against that with ever more point masses: the elements with spread
// mass are nearer to the limit.
TEST(MassOfLinks, ConvergesToTheLimitOfManyPointMasses) {
  const auto tip_at_end = [](int num_elements, bool is_lumped) {
    Scene scene = hub_and_boom(num_elements, 4.0);
    scene.initial.points.clear();
    // a quadratic start, the same for all meshes
    for (int i = 0; i <= num_elements; ++i) {
      const double s = static_cast<double>(i) / num_elements;
      scene.initial.points.push_back({i, Vector3d::Zero(), Vector3d(0.0, 1.0, 2.0) * s * s});
    }
    if (is_lumped)
      for (Link& link : scene.links) std::get<Beam>(link.kind).mass_distribution = MassDistribution::kLumped;
    place_lumped_masses(scene);
    scene.rate = 4000.0;
    const Plan plan = compile(scene);
    Motion motion(plan, kMotionAlone);
    for (int k = 0; k < 1200; ++k) EXPECT_EQ(motion.advance().status, StepStatus::kOk);
    const Vec3 p = read_point(plan, motion.state(), num_elements).p_W,
               hub = read_point(plan, motion.state(), 0).p_W;
    return Vector3d(p[0] - hub[0], p[1] - hub[1], p[2] - hub[2]);
  };
  // the lumped error is of order 2, so two meshes give the limit
  const Vector3d coarse = tip_at_end(16, true), fine = tip_at_end(32, true);
  const Vector3d limit = fine + (fine - coarse) / 3.0;
  const double lumped = (tip_at_end(8, true) - limit).norm();
  const double four = (tip_at_end(4, false) - limit).norm(), eight = (tip_at_end(8, false) - limit).norm();
  std::printf("tip off by %.1e m with 8 lumped elements, %.1e and %.1e m with 4 and 8 of spread mass\n",
              lumped, four, eight);
  EXPECT_LT(eight, 0.5 * lumped);
  EXPECT_LT(eight, 0.35 * four);
}

// A free beam that spins at its lowest frequency. The limits are those of 60 Hermite elements, to which the
// frequencies of lumped beams converge in `relative_equilibrium_test`, in units of sqrt(EI / (m L^4)).
TEST(MassOfLinks, ASpinningBeamOf40ElementsHasTheFrequenciesOfTheContinuum) {
  Scene scene;
  for (int i = 0; i <= 40; ++i) add_point(scene, 0.0, {i / 40.0, 0.0, 0.0});
  Beam beam{1e6, 1.0, 1.0, 1.0, {0.0, 1.0, 0.0}};
  beam.mass_per_length = 1.0;
  for (int i = 0; i < 40; ++i) add_link(scene, i, i + 1, beam);
  scene.fidelity = Fidelity::kCorotational;
  const Plan plan = compile(scene);
  RelativeEquilibria equilibria(plan, std::nullopt);
  const RelativeEquilibrium found = equilibria.find({0.0, 0.0, 22.37328545});
  ASSERT_TRUE(found.error.empty()) << found.error;
  std::vector<double> rates;
  for (const SmallMotion& small : found.motions) rates.push_back(small.rate.imag());
  for (const double exact : {39.0104, 44.9708, 80.5247, 83.5751, 140.5225, 142.2924}) {
    const auto nearest = *std::min_element(rates.begin(), rates.end(), [&](double a, double b) {
      return std::abs(a - exact) < std::abs(b - exact);
    });
    std::printf("%8.4f: off by %.1e\n", exact, nearest / exact - 1.0);
    EXPECT_NEAR(nearest, exact, 1e-3 * exact);
  }
}

// Without rotations of joints, the lowest frequency of a free beam differs from that of the rung `coupled` by
// the fourth power of the length of an element.
TEST(MassOfLinks, TheLowestFrequencyDiffersLittleFromThatOfLowerRungs) {
  double before = 0.0;
  for (const int num : {4, 8, 16}) {
    Scene scene;
    for (int i = 0; i <= num; ++i) add_point(scene, 0.0, {static_cast<double>(i) / num, 0.0, 0.0});
    Beam beam{1e6, 1.0, 1.0, 1.0, {0.0, 1.0, 0.0}};
    beam.mass_per_length = 1.0;
    for (int i = 0; i < num; ++i) add_link(scene, i, i + 1, beam);
    scene.fidelity = Fidelity::kCoupled;
    const double coupled = build(scene).omega[0];
    scene.fidelity = Fidelity::kCorotational;
    const double difference = build(scene).omega[0] / coupled - 1.0;
    std::printf("%2d elements: higher by %.1e\n", num, difference);
    if (before > 0.0) {
      EXPECT_GT(before / difference, 14.0);
    }
    before = difference;
  }
  EXPECT_LT(before, 1e-5);
}

}  // namespace
}  // namespace freeflex::testing
