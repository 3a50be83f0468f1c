// Dashpots, feedback and forces that turn with the deformation, against the linear system solved as a whole.
#include <gtest/gtest.h>

#include <cstdio>
#include <random>

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

// elastic displacements at the start, none of them rigid: a self-equilibrated pull on each spring
void stretch(Scene& scene, double size, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal(0.0, size);
  Eigen::VectorXd V = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(scene.points.size()));
  for (const Link& link : scene.links) {
    const Eigen::Vector3d u = (scene.points[static_cast<std::size_t>(link.points[1])].position -
                               scene.points[static_cast<std::size_t>(link.points[0])].position)
                                  .normalized();
    const double pull = normal(engine);
    V.segment<3>(3 * link.points[0]) -=
        pull / scene.points[static_cast<std::size_t>(link.points[0])].mass * u;
    V.segment<3>(3 * link.points[1]) +=
        pull / scene.points[static_cast<std::size_t>(link.points[1])].mass * u;
  }
  for (std::size_t i = 0; i < scene.points.size(); ++i)
    scene.initial.points.push_back(
        {static_cast<int>(i), V.segment<3>(3 * static_cast<Eigen::Index>(i)), Eigen::Vector3d::Zero()});
}

WideVector start_of(const Scene& scene) {
  const auto n = 3 * static_cast<Eigen::Index>(scene.points.size());
  WideVector y = WideVector::Zero(2 * n);
  for (const auto& each : scene.initial.points)
    y.segment<3>(3 * each.point) = each.displacement.cast<long double>();
  return y;
}

/// Largest difference of V at the end, of the largest |V| at the start.
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
  // three dashpots that share no mode, on bodies with springs of their own
  add_dashpot(scene, 0, 2, damping);
  add_dashpot(scene, 1, 5, 0.7 * damping);
  add_dashpot(scene, 3, 4, 1.9 * damping);
  return scene;
}

TEST(Dashpots, ThatCoupleModesAreAdvancedExactly) {
  for (const double damping : {0.01, 1.0, 30.0, 300.0, 3e4}) {  // the last ones beyond critical
    Scene scene = damped_octahedron(damping);
    const Plan plan = plan_of(scene);
    EXPECT_EQ(plan.coupling.path, PlanCoupling::Path::kExact);
    const double error = error_of(scene, 10.0);
    std::printf(
        "dashpots of %g N s/m and their multiples, %d of %d modes coupled, 10,000 ticks: error %.1e\n",
        damping, static_cast<int>(plan.coupling.modes.size()), plan.num_elastic, error);
    // each of 10,000 ticks rounds once
    EXPECT_LT(error, 1e-12);
  }
}

TEST(Dashpots, ThatShareTheModesCostNothing) {
  Scene scene = octahedron(1e4);
  publish_everything(scene);
  stretch(scene, 1e-6, 3);
  for (Link& link : scene.links) link.viscous = 2e-3;
  EXPECT_EQ(plan_of(scene).coupling.path, PlanCoupling::Path::kNone);
  EXPECT_LT(error_of(scene, 2.0), 1e-13);
  // the same as Rayleigh's stiffness part
  Scene rayleigh = octahedron(1e4);
  rayleigh.damping.beta = 2e-3;
  const Plan a = plan_of(scene), b = plan_of(rayleigh);
  for (int mode = 0; mode < a.num_elastic; ++mode)
    EXPECT_NEAR(a.decay[static_cast<std::size_t>(mode)], b.decay[static_cast<std::size_t>(mode)],
                1e-14 * b.decay[static_cast<std::size_t>(mode)]);
}

TEST(Dashpots, TakeTheEnergyThatTheStructureLoses) {
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
  // Simpson's rule over pairs of ticks: w h below 0.03, so its error is some 1e-8 of the part that
  // oscillates, whose integral over 500 turns is a hundredth of the whole
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

// more coupled modes than their exponential is kept for: split, second order, and it never gains energy
TEST(Dashpots, OnManyModesAreSplitWithSecondOrder) {
  Scene scene = random_structure(5, 20);
  const Scene more = random_structure(6, 20);
  // two boxes side by side, joined by every pair of corresponding points
  for (const PointMass& point : more.points) {
    PointMass moved = point;
    moved.name += "_2";
    moved.position.x() += 6.0;
    scene.points.push_back(moved);
  }
  for (Link link : more.links) {
    for (int& point : link.points) point += 20;
    link.name += "_2";
    scene.links.push_back(link);
  }
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 3; ++j) {
      Link link;
      link.name = "j" + std::to_string(3 * i + j);
      link.points = {i, 20 + (i + j) % 20};
      link.kind = Spring{1e4};
      scene.links.push_back(link);
    }
  for (Link& link : scene.links)
    if (const auto* bar = std::get_if<Bar>(&link.kind)) link.kind = Spring{bar->EA};
  publish_everything(scene);
  stretch(scene, 1e-7, 9);
  add_dashpot(scene, 0, 7, 20.0);
  add_dashpot(scene, 3, 31, 50.0);
  const Plan plan = plan_of(scene);
  ASSERT_EQ(plan.coupling.path, PlanCoupling::Path::kSplit);
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

// loss factor eta on every link: each mode has the damping ratio eta / 2
TEST(LossFactors, GiveHalfOfThemselvesAsDampingRatio) {
  Scene scene = octahedron(1e4);
  for (Link& link : scene.links) link.loss_factor = 0.04;
  const Plan plan = plan_of(scene);
  for (int mode = 0; mode < plan.num_elastic; ++mode)
    EXPECT_NEAR(plan.decay[static_cast<std::size_t>(mode)], 0.02 * plan.omega[static_cast<std::size_t>(mode)],
                1e-14 * plan.omega[static_cast<std::size_t>(mode)]);
}

// The rig of feedback: two points on a line, a spring between, the force on the second answers its own
// displacement, velocity and acceleration: mu q'' terms in closed form. With reduced mass, x = V_2 - V_1, V_2
// = x m_1 / M.
struct FeedbackRig {
  double m1 = 3.0, m2 = 2.0, k = 500.0, g = -200.0, c = -0.8, a = -0.5;
  Scene scene() const {
    Scene scene = spring_pair(m1, m2, 1.0, k);
    publish_everything(scene);
    Feedback feedback;
    feedback.name = "actuator";
    feedback.point = feedback.sensor = 1;
    feedback.displacement_gain(0, 0) = g;
    feedback.velocity_gain(0, 0) = c;
    feedback.acceleration_gain(0, 0) = a;
    scene.feedbacks.push_back(feedback);
    const double x = 1e-4, M = m1 + m2;
    scene.initial.points = {{0, {-x * m2 / M, 0.0, 0.0}, Eigen::Vector3d::Zero()},
                            {1, {x * m1 / M, 0.0, 0.0}, Eigen::Vector3d::Zero()}};
    return scene;
  }
};

TEST(Feedback, MovesTheElasticCoordinateExactlyAndTheBodyWithSecondOrder) {
  const FeedbackRig rig;
  // mu x'' + k x = (m1 / M) f, f = (m1 / M) (g x + c x' + a x''); share of the force that strains: m1 / M
  const double M = rig.m1 + rig.m2, mu = rig.m1 * rig.m2 / M, s = rig.m1 / M;
  const double mass = mu - s * s * rig.a, damping = -s * s * rig.c, stiffness = rig.k - s * s * rig.g;
  const double decay = damping / (2.0 * mass), wd = std::sqrt(stiffness / mass - decay * decay);
  const auto x_at = [&](double t) {
    return 1e-4 * std::exp(-decay * t) * (std::cos(wd * t) + decay / wd * std::sin(wd * t));
  };
  std::vector<double> errors;
  for (const double rate : {1000.0, 2000.0, 4000.0}) {
    Scene scene = rig.scene();
    scene.rate = rate;
    Simulation simulation(scene);
    simulation.run(static_cast<std::int64_t>(rate));
    const Eigen::Matrix3Xd V = simulation.displacements_B();
    EXPECT_NEAR(V(0, 1) - V(0, 0), x_at(1.0), 1e-12 * 1e-4);
    // momentum of the body: M v = integral of f, by Simpson's rule, with f = (mu x'' + k x) / s
    double impulse = 0.0;
    const int n = 20000;
    const auto force = [&](double t) {
      const double x = x_at(t);
      const double x_dot = -1e-4 * std::exp(-decay * t) * (wd + decay * decay / wd) * std::sin(wd * t);
      return (mu * (-damping * x_dot - stiffness * x) / mass + rig.k * x) / s;
    };
    for (int i = 0; i <= n; ++i)
      impulse += (i == 0 || i == n ? 1.0 : i % 2 == 1 ? 4.0 : 2.0) * force(1.0 * i / n);
    impulse /= 3.0 * n;
    errors.push_back(std::abs(simulation.state.v_WB[0] - impulse / M));
    std::printf("feedback, h = %g s: velocity of the centre of mass off by %.2e of %.2e m/s\n", 1.0 / rate,
                errors.back(), std::abs(impulse / M));
  }
  for (std::size_t k = 1; k < errors.size(); ++k) EXPECT_NEAR(std::log2(errors[k - 1] / errors[k]), 2.0, 0.2);
}

TEST(Feedback, ThatDrivesIsSaid) {
  FeedbackRig rig;
  rig.c = 5.0;
  Faults faults;
  const Scene scene = rig.scene();
  const auto structure = build_structure(scene, faults);
  ASSERT_TRUE(structure);
  ASSERT_TRUE(compile_plan(scene, *structure, faults));
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_NE(faults[0].message.find("the feedback drives a motion that grows by a factor of"),
            std::string::npos);
}

}  // namespace
}  // namespace freeflex::testing
