// Mass that is spread over links on the rung `corotational`: energy, published accelerations, the limit of
// many point masses, and the frequencies of a spinning beam.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/motion.hpp"
#include "core/scene/bodies.hpp"
#include "core/steady/relative_equilibrium.hpp"
#include "core/step/readout.hpp"
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

struct Drift {
  double energy = 0.0, strain = 0.0, tip_turn = 0.0;  // [J], [J], [m]
};
Drift drift_of(Scene scene, double rate) {
  scene.rate = rate;
  const Plan plan = compile(scene);
  EXPECT_EQ(plan.coupled.kinetics.form, PlanKinetics::Form::kSpread);
  Motion motion(plan, kMotionAlone);
  const auto energy = [&] {
    const Invariants all = read_invariants(plan, motion.state());
    return all.kinetic_rigid + all.kinetic_elastic + all.potential;
  };
  Drift drift;
  motion.advance();
  const double start = energy();
  for (int k = 0; k < 2 * static_cast<int>(rate); ++k) {
    EXPECT_EQ(motion.advance().status, StepStatus::kOk);
    drift.energy = std::max(drift.energy, std::abs(energy() - start));
    drift.strain = std::max(drift.strain, read_invariants(plan, motion.state()).potential);
    for (std::size_t i = 0; i < plan.points.size(); ++i)
      drift.tip_turn =
          std::max(drift.tip_turn, length(read_point(plan, motion.state(), static_cast<int>(i)).V_B));
  }
  return drift;
}

// The change of energy is of order 4 in the substep.
TEST(MassOfLinks, AHubWithAWheelAndABoomConservesEnergy) {
  double before = 0.0;
  for (const double rate : {4000.0, 8000.0}) {
    const Drift drift = drift_of(hub_and_boom(4, 0.8), rate);
    std::printf("%4.0f Hz: energy changes by %.1e of the largest strain energy %.3f J, displacement %.2f m\n",
                rate, drift.energy / drift.strain, drift.strain, drift.tip_turn);
    EXPECT_LT(drift.energy, 2e-5 * drift.strain);
    if (before > 0.0) {
      EXPECT_LT(drift.energy, 0.1 * before);
    }
    before = drift.energy;
  }
}

// Velocities and accelerations of points, on bodies and free, are those of their published positions.
TEST(MassOfLinks, ReadsTheRatesOfThePublishedPositions) {
  Scene scene = hub_and_boom(4, 0.8);
  scene.rate = 8000.0;
  const Plan plan = compile(scene);
  Motion motion(plan, kMotionAlone);
  std::vector<PointState> states[3];
  for (long k = 0; k < 2402; ++k) {
    ASSERT_EQ(motion.advance().status, StepStatus::kOk);
    for (std::size_t i = 0; i < plan.points.size() && k >= 2399; ++i)
      states[k - 2399].push_back(read_point(plan, motion.state(), static_cast<int>(i)));
  }
  const auto at = [](const Vec3& x) { return Eigen::Map<const Vector3d>(x.data()); };
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const Vector3d mean = 0.5 * scene.rate * (at(states[2][i].p_W) - at(states[0][i].p_W)),
                   gain = 0.5 * scene.rate * (at(states[2][i].v_W) - at(states[0][i].v_W));
    EXPECT_LT((mean - at(states[1][i].v_W)).norm(), 3e-4 * mean.norm()) << i;
    EXPECT_LT((gain - at(states[1][i].a_W)).norm(), 5e-3 * gain.norm()) << i;
  }
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

}  // namespace
}  // namespace freeflex::testing
