// These tests compare motion with dashpots with the exponential of the complete linear system.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/motion/coupled_scenes.hpp"
#include "tests/motion/linear_system.hpp"
#include "tests/support/simulation.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

void add_dashpot(Scene& scene, int first, int second, double damping) {
  Link link;
  link.name = "d" + std::to_string(scene.links.size());
  link.points = {first, second};
  link.kind = Dashpot{damping};
  scene.links.push_back(link);
}

/// Returns the largest difference of V at the end from the exponential of the linear system, relative to the
/// largest |V| at the start.
double error_of(const Scene& scene, double seconds) {
  Simulation simulation(scene);
  simulation.run(std::llround(seconds * scene.rate));
  const LinearSystem system(scene);
  const WideVector y =
      system.at(static_cast<long double>(std::llround(seconds * scene.rate)) * simulation.plan.period,
                start_of(scene), WideVector::Zero(system.mass.size()));
  const Eigen::Matrix3Xd V = simulation.displacements_B();
  double error = 0.0, largest = 0.0;
  for (Eigen::Index i = 0; i < V.cols(); ++i) {
    error = std::max(error, (V.col(i) - y.segment<3>(3 * i).cast<double>()).norm());
    largest = std::max(largest, start_of(scene).segment<3>(3 * i).cast<double>().norm());
  }
  return error / largest;
}

Scene damped_octahedron(double damping) {
  Scene scene = octahedron(1e4);
  publish_everything(scene);
  stretch(scene, 1e-6, 7);
  // three dashpots in different directions, in parallel with springs
  add_dashpot(scene, 0, 2, damping);
  add_dashpot(scene, 1, 5, 0.7 * damping);
  add_dashpot(scene, 3, 4, 1.9 * damping);
  return scene;
}

TEST(Dashpots, DashpotsThatCoupleModesAreAdvancedExactly) {
  for (const double damping :
       {0.01, 1.0, 30.0, 300.0, 3e4}) {  // the largest values are above critical damping
    Scene scene = damped_octahedron(damping);
    const Plan plan = plan_of(scene);
    EXPECT_EQ(plan.modal_coupling.path, PlanModalCoupling::Path::kExact);
    const double error = error_of(scene, 10.0);
    std::printf(
        "dashpots of %g N s/m and their multiples, %d of %d modes coupled, 10,000 ticks: error %.1e\n",
        damping, static_cast<int>(plan.modal_coupling.modes.size()), plan.num_elastic, error);
    // each of 10,000 ticks has one rounding error
    EXPECT_LT(error, 1e-12);
  }
}

TEST(Dashpots, DashpotsProportionalToStiffnessCoupleNoModes) {
  Scene scene = octahedron(1e4);
  publish_everything(scene);
  stretch(scene, 1e-6, 3);
  for (Link& link : scene.links) link.viscous = 2e-3;
  EXPECT_EQ(plan_of(scene).modal_coupling.path, PlanModalCoupling::Path::kNone);
  EXPECT_LT(error_of(scene, 2.0), 1e-13);
  // the damping equals the stiffness-proportional part of Rayleigh damping
  Scene rayleigh = octahedron(1e4);
  rayleigh.damping.beta = 2e-3;
  const Plan a = plan_of(scene), b = plan_of(rayleigh);
  for (int mode = 0; mode < a.num_elastic; ++mode)
    EXPECT_NEAR(a.decay[static_cast<std::size_t>(mode)], b.decay[static_cast<std::size_t>(mode)],
                1e-14 * b.decay[static_cast<std::size_t>(mode)]);
}

TEST(Dashpots, DashpotsDissipateTheEnergyThatTheStructureLoses) {
  Scene scene = damped_octahedron(3.0);
  scene.rate = 10000.0;
  Simulation simulation(scene);
  const auto energy = [&] {
    const Invariants now = read_invariants(simulation.plan, simulation.state);
    return now.kinetic_elastic + now.potential;
  };
  const auto power = [&] {
    const Eigen::Matrix3Xd v = simulation.velocities_W();
    double sum = 0.0;
    for (const Link& link : scene.links) {
      const auto* dashpot = std::get_if<Dashpot>(&link.kind);
      if (dashpot == nullptr) continue;
      const Eigen::Vector3d u = (scene.points[static_cast<std::size_t>(link.points[1])].position -
                                 scene.points[static_cast<std::size_t>(link.points[0])].position)
                                    .normalized();
      sum += dashpot->damping * std::pow(u.dot(v.col(link.points[1]) - v.col(link.points[0])), 2);
    }
    return sum;
  };
  const double before = energy();
  // The work is integrated by Simpson's rule over pairs of ticks. Since w h is below 0.03, the error is some
  // 1e-8 of the oscillating part of the power, whose integral over 500 cycles is a hundredth of the total.
  double work = power();
  const int ticks = 5000;
  for (int tick = 1; tick <= ticks; ++tick) {
    simulation.run(1);
    work += (tick == ticks ? 1.0 : tick % 2 == 1 ? 4.0 : 2.0) * power();
  }
  work *= simulation.plan.period / 3.0;
  const double lost = before - energy();
  std::printf("energy lost %.12e J of %.3e J, work of the dashpots differs by %.1e of it\n", lost, before,
              std::abs(work / lost - 1.0));
  EXPECT_GT(lost, 0.1 * before);
  EXPECT_NEAR(work, lost, 1e-10 * lost);
}

// There are too many coupled modes for the exact exponential, so they are advanced by splitting, which has
// second order and never adds energy.
TEST(Dashpots, SplittingOfDashpotsOnManyModesHasSecondOrder) {
  Scene scene = two_boxes();
  publish_everything(scene);
  stretch(scene, 1e-7, 9);
  add_dashpot(scene, 0, 7, 20.0);
  add_dashpot(scene, 3, 31, 50.0);
  const Plan plan = plan_of(scene);
  ASSERT_EQ(plan.modal_coupling.path, PlanModalCoupling::Path::kSplit);
  std::vector<double> errors;
  for (const double rate : {4000.0, 8000.0, 16000.0, 32000.0}) {
    scene.rate = rate;
    errors.push_back(error_of(scene, 0.1));
    std::printf("split, %d modes, h = %g s: error %.3e\n", plan.num_elastic, 1.0 / rate, errors.back());
  }
  for (std::size_t k = 1; k < errors.size(); ++k)
    EXPECT_NEAR(std::log2(errors[k - 1] / errors[k]), 2.0, 0.2) << k;

  scene.rate = 20.0;  // w h of hundreds
  Simulation coarse(scene);
  double last = 1e300;
  for (int tick = 0; tick < 2000; ++tick) {
    coarse.run(1);
    const Invariants now = read_invariants(coarse.plan, coarse.state);
    const double energy = now.kinetic_elastic + now.potential;
    ASSERT_LE(energy, last * (1.0 + 1e-12)) << tick;
    last = energy;
  }
}

// If every link has the loss factor eta, every mode has the damping ratio eta / 2.
TEST(LossFactors, ALossFactorGivesHalfItsValueAsDampingRatio) {
  Scene scene = octahedron(1e4);
  for (Link& link : scene.links) link.loss_factor = 0.04;
  const Plan plan = plan_of(scene);
  for (int mode = 0; mode < plan.num_elastic; ++mode)
    EXPECT_NEAR(plan.decay[static_cast<std::size_t>(mode)], 0.02 * plan.omega[static_cast<std::size_t>(mode)],
                1e-14 * plan.omega[static_cast<std::size_t>(mode)]);
}

}  // namespace
}  // namespace freeflex::testing
