// These tests compare the rungs `coupled` and `corotational` with the full Cartesian system by errors, order
// and conserved quantities.
#include "tests/motion/rung_cases.hpp"

namespace freeflex::testing {
namespace {

// The expected figures come from an independent implementation of the same rungs (complete modal momenta,
// fourth-order exponential integrator, h = 1 ms) against an extrapolation code of order 16 in extended
// precision, at t = 2 s. Those of `coupled` were measured when it got the stiffness by spin and loads
// (THEORY 8.49); without it, they were 3.7 to 120 times larger.
TEST(Rungs, HaveTheExpectedErrorsOnASpinningTruss) {
  struct Row {
    double spin, force;
    std::array<double, 4> position;  // [m] rms on the rungs `separated`, `spin-loaded`, `coupled` and
                                     // `corotational`; 0 if not checked
    double coupled_elastic, exact_elastic;
  };
  constexpr double kWithin = 1.5;
  const Row rows[] = {{0.0, 1.0, {1.5e-7, 1.5e-7, 1.6e-9, 0.0}, 0.0, 0.0},
                      {0.1, 1.0, {6.1e-7, 1.8e-7, 2.6e-9, 0.0}, 0.0, 0.0},
                      {1.0, 1.0, {1.5e-4, 1.4e-4, 1.5e-6, 1.1e-11}, 2.4e-2, 2e-7},
                      {5.0, 1.0, {1.8e-2, 1.8e-2, 8.6e-4, 3.0e-9}, 0.89, 3e-6},
                      {0.0, 100.0, {1.5e-3, 1.5e-3, 1.9e-5, 2.8e-9}, 2.6e-2, 5e-6}};
  constexpr std::array kRungs{Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled,
                              Fidelity::kCorotational};
  for (const Row& row : rows) {
    const Scene scene = boxed_truss(row.spin, row.force);
    const Truth truth = truth_of(scene, 2.0);
    std::printf("spin %3.1f rad/s, %3.0f N: position [m] / elastic error", row.spin, row.force);
    for (std::size_t k = 0; k < kRungs.size(); ++k) {
      const Errors errors = errors_of(run_rung(scene, kRungs[k], 1e-3, 2.0), truth);
      std::printf("  %.1e / %.1e", errors.position, errors.elastic);
      if (row.position[k] > 0.0) {
        EXPECT_LT(errors.position, kWithin * row.position[k]);
        EXPECT_GT(errors.position, row.position[k] / kWithin);
      }
      if (kRungs[k] == Fidelity::kCoupled && row.coupled_elastic > 0.0) {
        EXPECT_LT(std::max(errors.elastic / row.coupled_elastic, row.coupled_elastic / errors.elastic),
                  kWithin);
      }
      if (kRungs[k] == Fidelity::kCorotational && row.exact_elastic > 0.0) {
        EXPECT_LT(errors.elastic, kWithin * row.exact_elastic);
      }
    }
    std::printf("\n");
  }
}

// The errors are elastic differences from a run at an eighth of the smallest step, and omega_max h is at most
// 0.5.
TEST(Rungs, CoupledRungsHaveOrderFourOverFourHalvingsOfTheStep) {
  constexpr double kEndTime = 0.512;
  Scene scene = boxed_truss(5.0, 10.0);
  scene.loads[0].history = PulseHistory{0.0, 0.128};
  for (const Fidelity rung : {Fidelity::kCoupled, Fidelity::kCorotational}) {
    constexpr double kLargest = 0.5e-3;
    const Eigen::Matrix3Xd best = elastic_of(scene, run_rung(scene, rung, kLargest / 128.0, kEndTime));
    std::vector<double> errors;
    for (int halvings = 0; halvings <= 4; ++halvings)
      errors.push_back(elastic_error(
          elastic_of(scene, run_rung(scene, rung, std::ldexp(kLargest, -halvings), kEndTime)), best));
    std::printf("%s: omega_max h %.2f;", rung == Fidelity::kCoupled ? "coupled" : "exact bars",
                kLargest * plan_of(scene).omega[static_cast<std::size_t>(plan_of(scene).num_elastic) - 1]);
    for (std::size_t k = 0; k < errors.size(); ++k) {
      std::printf(" %.2e", errors[k]);
      if (k == 0) continue;
      const double order = std::log2(errors[k - 1] / errors[k]);
      std::printf(" (order %.2f)", order);
      // below this error the rounding errors of some 10^4 steps affect the ratio
      if (errors[k] > 1e-11) {
        EXPECT_GT(order, 3.8);
        EXPECT_LT(order, 4.3);
      }
    }
    std::printf("\n");
    EXPECT_LT(errors.back(), 1e-9);
  }
}

// S4 has a mode at 673,000 rad/s. For many of the 200 step sizes from 0.9 to 1.1 ms, its phase per step is
// near a multiple of pi.
TEST(Rungs, TheCoupledRungIsAccurateAtAnyStepDespiteAStiffMode) {
  constexpr int kSizes = 200, kTicks = 250;
  Scene scene = truss_s4();
  scene.loads[0].history = ConstantHistory{};
  double worst = 0.0, omega = 0.0;
  for (int k = 0; k < kSizes; ++k) {
    const double h = 1e-3 * (0.9 + 0.2 * k / (kSizes - 1));
    const Simulation once = run_rung(scene, Fidelity::kCoupled, h, kTicks * h);
    const Simulation twice = run_rung(scene, Fidelity::kCoupled, 0.5 * h, kTicks * h);
    omega = once.plan.omega[static_cast<std::size_t>(once.plan.num_elastic) - 1];
    const double error = elastic_error(elastic_of(scene, once), elastic_of(scene, twice));
    ASSERT_TRUE(std::isfinite(error)) << h;
    worst = std::max(worst, error);
  }
  std::printf("omega_max h from %.0f to %.0f: worst elastic difference from half the step %.1e\n",
              0.9e-3 * omega, 1.1e-3 * omega, worst);
  EXPECT_LT(worst, 1e-5);
}

TEST(Rungs, TheCoupledRungKeepsTheEnergyOfAStiffTrussFor1e5Ticks) {
  expect_energy_kept(truss_s4(), 100'000, 1);
}

// Every second spring is up to 1e6 times as stiff as the others. The error is the difference from a run with
// steps of 1/16 ms.
TEST(Rungs, ExactBarsLoseOrderButStayAccurateDespiteStiffBars) {
  double worst = 0.0;
  for (const double ratio : {1.0, 1e2, 1e4, 1e6}) {
    Scene scene = boxed_truss(5.0, 10.0);
    for (std::size_t k = 1; k < scene.links.size(); k += 2) scene.links[k].kind = Spring{1e5 * ratio};
    const auto u = [&](double h) {
      return elastic_of(scene, run_rung(scene, Fidelity::kCorotational, h, 0.5));
    };
    const Eigen::Matrix3Xd best = u(0.0625e-3);
    const double coarse = elastic_error(u(1e-3), best), fine = elastic_error(u(0.5e-3), best);
    scene.rate = 1000.0;
    scene.fidelity = Fidelity::kCorotational;
    const Plan plan = plan_of(scene);
    const double phase = plan.omega[static_cast<std::size_t>(plan.num_elastic) - 1] * 1e-3;
    std::printf("omega_max h %6.1f: elastic error %.1e, at half the step %.1e (order %.1f)\n", phase, coarse,
                fine, std::log2(coarse / fine));
    worst = std::max(worst, coarse);
    EXPECT_LT(phase, 1000.0) << "the phase exceeds the largest that is accepted";
  }
  EXPECT_LT(worst, 1e-2);
}

// The energy falls by dE/dt = -sum_l 2 M decay_l q_l'^2, where q_l' is the rate of a coordinate and not its
// momentum (THEORY 12.11). On `corotational` only Rayleigh's alpha has this power; a ratio damps true strains
// (THEORY 12.114).
TEST(Rungs, TheEnergyFallsByTheWorkOfTheDampers) {
  constexpr double kStep = 1e-4;
  for (const Fidelity rung : {Fidelity::kCoupled, Fidelity::kCorotational}) {
    Scene scene = boxed_truss(3.0, 10.0);
    scene.loads[0].history = PulseHistory{0.0, 0.05};
    if (rung == Fidelity::kCoupled)
      scene.damping.modal_ratio = 0.02;
    else
      scene.damping.alpha = 10.0;
    scene.fidelity = rung;
    scene.rate = 1.0 / kStep;
    Simulation simulation(scene);
    const Plan& plan = simulation.plan;
    const auto energy = [&] {
      const Invariants now = read_invariants(plan, simulation.state);
      return now.kinetic_rigid + now.kinetic_elastic + now.potential;
    };
    const auto power = [&] {
      double sum = 0.0;
      for (std::size_t l = 0; l < static_cast<std::size_t>(plan.num_elastic); ++l)
        sum += 2.0 * plan.mass * plan.decay[l] * simulation.state.q_dot[l] * simulation.state.q_dot[l];
      return sum;
    };
    simulation.run(600);
    const double start = energy();
    // the work is integrated by Simpson's rule over 0.1 s
    double taken = power() * kStep / 3.0;
    constexpr int kTicks = 1000;
    for (int k = 1; k <= kTicks; ++k) {
      simulation.run(1);
      taken += power() * (k == kTicks ? 1.0 : k % 2 == 1 ? 4.0 : 2.0) * kStep / 3.0;
    }
    const double lost = start - energy();
    std::printf("lost %.6e J, taken %.6e J, relative difference %.1e\n", lost, taken, lost / taken - 1.0);
    // the measured difference is 5e-10, the error of Simpson's rule for 250 to 1700 rad/s
    EXPECT_NEAR(lost, taken, 1e-8 * taken);
  }
}

// Velocities and accelerations agree with differences of positions.
TEST(Rungs, VelocitiesAndAccelerationsAgreeWithDifferencesOfPositions) {
  for (const Fidelity rung : {Fidelity::kCoupled, Fidelity::kCorotational}) {
    Scene scene = boxed_truss(3.0, 50.0);
    scene.loads[0].history = SineHistory{3.0, 0.4};
    scene.gravity = {0.1, -0.2, 9.0};
    scene.fidelity = rung;
    scene.rate = 1e4;
    Simulation simulation(without_load_stiffness(plan_of(scene)));
    simulation.run(1234);
    const Eigen::Matrix3Xd before = simulation.positions_W();
    simulation.run(1);
    const Eigen::Matrix3Xd now = simulation.positions_W(), v = simulation.velocities_W();
    const Invariants invariants = read_invariants(simulation.plan, simulation.state);
    Eigen::Matrix3Xd a(3, now.cols());
    for (int i = 0; i < now.cols(); ++i) {
      const Vec3 each = read_point(simulation.plan, simulation.state, i).a_W;
      a.col(i) = Eigen::Vector3d(each[0], each[1], each[2]);
    }
    simulation.run(1);
    const Eigen::Matrix3Xd after = simulation.positions_W();
    const double h = 1e-4;
    // the differences have a relative error of some (765 h)^2 / 12, from the fourth derivative
    EXPECT_LT(((after - before) / (2.0 * h) - v).norm(), 1e-3 * v.norm());
    EXPECT_LT(((after - 2.0 * now + before) / (h * h) - a).norm(), 1e-3 * a.norm());
    const double kinetic = 0.5 * v.squaredNorm();
    EXPECT_NEAR(invariants.kinetic_rigid + invariants.kinetic_elastic, kinetic, 1e-13 * kinetic);
  }
}

// The angular momentum about the centre of mass is the sum over the points at their current positions.
TEST(Rungs, AngularMomentumIsTheSumOverThePoints) {
  Scene scene = boxed_truss(2.0, 20.0);
  scene.fidelity = Fidelity::kCorotational;
  Simulation simulation(scene);
  simulation.run(700);
  const Eigen::Matrix3Xd p = simulation.positions_W(), v = simulation.velocities_W();
  Eigen::Vector3d H = Eigen::Vector3d::Zero();
  for (int i = 0; i < p.cols(); ++i) H += (p.col(i) - p.rowwise().mean()).cross(v.col(i));
  EXPECT_LT((H - Eigen::Vector3d(simulation.state.H_W.data())).norm(), 1e-13 * H.norm());
}

// Published tensions of bars equal those of the full system, which are k times the true elongation.
TEST(Rungs, ExactBarsPublishTrueTensions) {
  Scene scene = boxed_truss(1.0, 100.0);
  for (int k = 0; k < 57; ++k) scene.publication.links.push_back(k);
  scene.fidelity = Fidelity::kCorotational;
  Simulation simulation(scene);
  simulation.run(150);
  const Eigen::VectorXd tensions = simulation.link_forces();
  const Eigen::Matrix3Xd p = simulation.positions_W();
  for (int k = 0; k < 57; ++k) {
    const auto& ends = scene.links[static_cast<std::size_t>(k)].points;
    const double rest = (scene.points[static_cast<std::size_t>(ends[1])].position -
                         scene.points[static_cast<std::size_t>(ends[0])].position)
                            .norm();
    // the bound is the rounding error of lengths of some metres times 1e5 N/m
    EXPECT_NEAR(tensions[k], 1e5 * ((p.col(ends[1]) - p.col(ends[0])).norm() - rest), 2e-10) << k;
  }
}

// Under wrenches, followers, feedback and dashpots, the rungs `coupled` and `corotational` give the same
// motion as the rung `separated` if deformations are small.
TEST(Rungs, CoupledRungsAgreeWithTheSeparatedRungForSmallDeformations) {
  Scene scene = boxed_truss(0.0, 1e-5);
  scene.loads[0].axes = Axes::kLocal;
  scene.groups.push_back({"tip", {16, 17, 18, 19}, {}});
  Load torque;
  torque.name = "torque";
  torque.wrenches.push_back({0, {1e-6, 0, 0}, {0, 2e-6, 1e-6}});
  torque.history = SineHistory{5.0, 0.0};
  scene.loads.push_back(torque);
  scene.feedbacks.push_back({"f",
                             3,
                             3,
                             -50.0 * Eigen::Matrix3d::Identity(),
                             -5.0 * Eigen::Matrix3d::Identity(),
                             Eigen::Matrix3d::Zero(),
                             {}});
  Link dashpot;
  dashpot.name = "d";
  dashpot.points = {0, 16};
  dashpot.kind = Dashpot{20.0};
  scene.links.push_back(dashpot);
  const Eigen::Matrix3Xd below = elastic_of(scene, run_rung(scene, Fidelity::kSeparated, 0.25e-3, 1.0));
  for (const Fidelity rung : {Fidelity::kCoupled, Fidelity::kCorotational}) {
    const double difference = elastic_error(elastic_of(scene, run_rung(scene, rung, 0.25e-3, 1.0)), below);
    std::printf("difference %.1e\n", difference);
    // the predictor of the separated step has order 2, which gives an error of (765 h)^2 / 12 of the effect
    // of feedback and dashpot
    EXPECT_LT(difference, 1e-3);
  }
}

TEST(Rungs, TheCoupledRungHandlesLinesPairsAndSinglePoints) {
  for (const int count : {1, 2, 4}) {
    Scene scene;
    scene.name = "line";
    for (int i = 0; i < count; ++i) {
      PointMass point;
      point.name = std::to_string(i);
      point.mass = 1.0 + 0.5 * i;
      point.position = Eigen::Vector3d(0.6, 0.8, 0.0) * i;
      scene.points.push_back(point);
      scene.publication.points.push_back(i);
      scene.pushable.push_back(i);
      if (i == 0) continue;
      Link link;
      link.name = std::to_string(i);
      link.points = {i - 1, i};
      link.kind = Spring{1e4};
      scene.links.push_back(link);
      if (i == 1) continue;
      link.name = "b" + std::to_string(i);
      link.points = {i - 2, i - 1, i};
      link.kind = BendingSpring{300.0};
      scene.links.push_back(link);
    }
    Load load;
    load.name = "push";
    load.forces.push_back({0, {0.3, -0.4, 1.0}});
    load.history = PulseHistory{0.0, 0.05};
    scene.loads.push_back(load);
    scene.initial.angular_velocity = {-0.8, 0.6, 0.5};
    scene.fidelity = Fidelity::kCoupled;
    Simulation simulation(scene);
    simulation.run(50);
    const double energy = energy_of(simulation);
    const Vec3 H = simulation.state.H_W;
    simulation.run(2000);
    EXPECT_NEAR(energy_of(simulation), energy, 1e-9 * energy) << count;
    EXPECT_EQ(simulation.state.H_W, H) << count;
    const Vec3 p = simulation.state.p_WB;
    const Eigen::Matrix3Xd all = simulation.positions_W();
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    double mass = 0.0;
    for (int i = 0; i < count; ++i) {
      centre += scene.points[static_cast<std::size_t>(i)].mass * all.col(i);
      mass += scene.points[static_cast<std::size_t>(i)].mass;
    }
    EXPECT_LT((centre / mass - Eigen::Vector3d(p.data())).norm(), 1e-14 * all.norm()) << count;
  }
}

TEST(Rungs, TheRigidRungMovesTheBodyWithoutElasticMotion) {
  Scene scene = boxed_truss(0.7, 10.0);
  scene.fidelity = Fidelity::kRigid;
  Simulation rigid(scene);
  scene.fidelity = Fidelity::kSeparated;
  Simulation separated(scene);
  rigid.run(1500);
  separated.run(1500);
  EXPECT_EQ(rigid.plan.num_elastic, 0);
  EXPECT_EQ(rigid.state.p_WB, separated.state.p_WB);
  EXPECT_EQ(rigid.state.q_WB, separated.state.q_WB);
  EXPECT_EQ(rigid.state.H_W, separated.state.H_W);
}

}  // namespace
}  // namespace freeflex::testing
