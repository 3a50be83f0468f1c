// Dashpots and viscous springs act along their true direction (THEORY 12.19). On the rungs `corotational` and
// `full`, the motion agrees with the full system.
#include "core/plan/make_plan.hpp"
#include "core/step/readout.hpp"
#include "core/structure/structure.hpp"
#include "tests/motion/verdict_truth.hpp"
#include "tests/motion/watched.hpp"

namespace freeflex::testing {
namespace {

constexpr double kEndTime = 0.512;

Link dashpot_between(int first, int second, double damping) {
  Link link;
  link.name = "dashpot " + std::to_string(first);
  link.points = {first, second};
  link.kind = Dashpot{damping};
  return link;
}

/// Returns the truss bent by centimetres while it spins, damped in one of three ways.
Scene damped_truss(const std::string& how) {
  Scene scene = boxed_truss(3.0, 2000.0);
  scene.name = how;
  scene.loads[0].history = PulseHistory{0.0, 0.064};
  // the dashpots act along face diagonals that have no spring, and along the whole truss
  if (how == "dashpots")
    for (const auto& [first, second] : {std::pair{1, 4}, {6, 9}, {11, 14}, {0, 18}})
      scene.links.push_back(dashpot_between(first, second, 20.0));
  if (how == "viscous")
    for (std::size_t k = 0; k < scene.links.size(); k += 3) scene.links[k].viscous = 3e-4;
  if (how == "beta") scene.damping.beta = 2e-4;
  return scene;
}

// The reference is a method of order 8 on Cartesian points. Its dashpots and damped springs act along the
// line between their ends.
TEST(DamperRung, ExactBarsWithDampingConvergeToTheFullSystemWithOrderFour) {
  for (const char* how : {"dashpots", "viscous", "beta"}) {
    const Scene scene = damped_truss(how);
    const Truth truth = truth_of(scene, kEndTime);
    std::vector<double> errors;
    for (const double h : {2e-3, 1e-3, 0.5e-3, 0.25e-3})
      errors.push_back(errors_of(run_rung(scene, Fidelity::kCorotational, h, kEndTime), truth).elastic);
    const Simulation full = run_rung(scene, Fidelity::kFull, 4e-3, kEndTime);
    const double undivided = errors_of(run_rung(scene, Fidelity::kCoupled, 0.25e-3, kEndTime), truth).elastic,
                 divided = errors_of(full, truth).elastic;
    std::printf(
        "%-9s exact bars at 2 to 1/4 ms %.1e %.1e %.1e %.1e, full at 4 ms in %d substeps %.1e, coupled %.1e; "
        "bent by %.2f m\n",
        how, errors[0], errors[1], errors[2], errors[3], full.plan.coupled.num_substeps, divided, undivided,
        full.displacements_B().colwise().norm().maxCoeff());
    EXPECT_NEAR(std::log2(errors[1] / errors[3]), 8.0, 1.0) << how << ": order 4 over two halvings";
    EXPECT_LT(errors[3], 1e-6) << how;
    EXPECT_LT(divided, 1e-5) << how << ": substeps of half a radian";
    EXPECT_GT(undivided, 1e3 * errors[3])
        << how << ": the difference would be too small to detect linear damping and bars";
  }
}

// If true bars are combined with dashpots that are linear about the frame, the motion differs from the full
// system. The test above relies on this difference.
TEST(DamperRung, LinearDashpotsNextToExactBarsCauseADetectableError) {
  const Scene scene = damped_truss("dashpots");
  const Truth truth = truth_of(scene, kEndTime);
  Scene at_rate = scene;
  at_rate.fidelity = Fidelity::kCorotational;
  at_rate.integration.by = IntegrateBy::kModes;
  at_rate.rate = 4000.0;
  Plan plan = plan_of(at_rate);
  for (PlanBar& bar : plan.coupled.bars) bar.damping = 0.0;
  Simulation linear(plan);
  linear.run(std::llround(kEndTime * at_rate.rate));
  const double error = errors_of(linear, truth).elastic;
  std::printf("linear dashpots beside true bars: elastic error %.1e\n", error);
  EXPECT_GT(error, 1e-3);
}

// The published force is k (l - L) + c dl/dt between the current positions of the points.
TEST(DamperRung, ThePublishedForceActsAlongTheCurrentLine) {
  Scene scene = damped_truss("viscous");
  scene.links.push_back(dashpot_between(0, 18, 20.0));
  scene.publication.links = {0, 3, static_cast<int>(scene.links.size()) - 1};
  const Simulation simulation = run_rung(scene, Fidelity::kCorotational, 1e-3, 0.1);
  const Eigen::Matrix3Xd p = simulation.positions_W(), v = simulation.velocities_W();
  const Eigen::VectorXd forces = simulation.link_forces();
  ASSERT_EQ(forces.size(), 3);
  for (int k = 0; k < 3; ++k) {
    const Link& link =
        scene.links[static_cast<std::size_t>(scene.publication.links[static_cast<std::size_t>(k)])];
    const Eigen::Index i = link.points[0], j = link.points[1];
    const Eigen::Vector3d x = p.col(j) - p.col(i), rest = scene.points[static_cast<std::size_t>(j)].position -
                                                          scene.points[static_cast<std::size_t>(i)].position;
    const double rate = x.dot(v.col(j) - v.col(i)) / x.norm();
    const auto* spring = std::get_if<Spring>(&link.kind);
    const double k_spring = spring != nullptr ? spring->stiffness : 0.0,
                 c = spring != nullptr ? k_spring * link.viscous : std::get<Dashpot>(link.kind).damping;
    const double expected = k_spring * (x.norm() - rest.norm()) + c * rate;
    // the bound allows for rounding errors, because lengths are differences of positions of some metres
    EXPECT_NEAR(forces[k], expected, 1e-9 * (k_spring + c)) << link.name;
    EXPECT_GT(std::abs(c * rate), 1e-3 * std::abs(expected))
        << link.name << ": the damping force is too small to test anything";
  }
}

// The force of a dashpot acts along the line of its ends, so it has no resultant and no moment.
TEST(DamperRung, KeepsMomentaAndOnlyDissipatesEnergy) {
  Scene scene = damped_truss("dashpots");
  scene.fidelity = Fidelity::kCorotational;
  scene.rate = 2000.0;
  Simulation simulation(scene);
  simulation.run(200);
  const Invariants start = read_invariants(simulation.plan, simulation.state);
  double last = energy_of(simulation);
  const double first = last;
  for (int k = 0; k < 50; ++k) {
    simulation.run(40);
    EXPECT_LE(energy_of(simulation), last) << k;
    last = energy_of(simulation);
  }
  const Invariants end = read_invariants(simulation.plan, simulation.state);
  double off = 0.0, size = 0.0;
  for (std::size_t a = 0; a < 3; ++a) {
    off = std::max(off, std::abs(end.angular_momentum_W[a] - start.angular_momentum_W[a]));
    size = std::max(size, std::abs(start.angular_momentum_W[a]));
  }
  // H_W is a state variable, but H_W is read in the rotated frame, and the attitude of this frame has an
  // error of order 4
  std::printf("energy %.4f to %.4f J, angular momentum kept to %.1e\n", first, last, off / size);
  EXPECT_LT(last, 0.999 * first);
  EXPECT_LT(off, 1e-12 * size);
}

TEST(DamperRung, DampingTooFastForTheStagesIsRefusedOnExactBars) {
  Scene scene = damped_truss("beta");
  scene.damping.beta = 10.0;  // critical damping at 0.2 rad/s
  scene.rate = 1000.0;
  for (const Fidelity rung : {Fidelity::kCoupled, Fidelity::kCorotational, Fidelity::kFull}) {
    scene.fidelity = rung;
    Faults faults;
    const auto structure = build_structure(scene, faults);
    const auto plan = make_full_plan(scene, *structure, scene.fidelity, faults);
    EXPECT_EQ(plan.has_value(), rung != Fidelity::kCorotational) << static_cast<int>(rung);
    if (rung == Fidelity::kFull && plan) {
      EXPECT_GT(plan->coupled.num_substeps, 1);
    }
    if (rung == Fidelity::kCorotational) {
      EXPECT_NE(faults.back().message.find("the fastest decay of a mode, "), std::string::npos)
          << faults.back().message;
    }
  }
}

// The load bends the truss by a third of its height, while all fast motion decays within a tick.
TEST(DamperRung, TheMotionStaysBoundedUpToTheStabilityLimitOfTheStages) {
  for (const double share : {0.1, 0.99}) {
    Scene scene = damped_truss("beta");
    scene.rate = 1000.0;
    const double omega = plan_of(scene).omega[53];
    scene.damping.beta = share * 1000.0 * scene.rate / (omega * omega);
    // forces on three points in a row without resultant and moment
    const double force = 1e5 * share;
    scene.loads[0].forces = {{2, {0.0, 0.0, force}}, {10, {0.0, 0.0, -2.0 * force}}, {18, {0.0, 0.0, force}}};
    scene.fidelity = Fidelity::kCorotational;
    Simulation simulation(scene);
    double largest = 0.0, before = 0.0;
    for (int k = 0; k < 100; ++k) {
      simulation.run(10);
      before = largest;
      largest = std::max(largest, simulation.displacements_B().cwiseAbs().maxCoeff());
    }
    std::printf("fastest decay %.0f a tick: largest displacement %.2f m\n", share * 1000.0, largest);
    EXPECT_GT(largest, 0.1);
    EXPECT_LT(largest, 1.0);
    EXPECT_EQ(largest, before) << "a motion grows after the load has ended";
  }
}

// The estimate is the distance from another rung, so it must include the difference between linear and true
// forces of dashpots and damped springs.
TEST(DamperRung, TheVerdictEstimatesTheErrorWithDashpotsAndDampedSprings) {
  for (const char* how : {"dashpots", "viscous", "beta"}) {
    Scene scene = damped_truss(how);
    const Truth truth = truth_of(scene, kEndTime);
    scene.rate = 1000.0;
    for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled}) {
      scene.fidelity = rung;
      const Verdict verdict = Watched(scene).run(512);
      const double error = rms_over_mass(scene, elastic_of(scene, run_rung(scene, rung, 1e-3, kEndTime)) -
                                                    elastic_of(truth.scene, truth.p_W));
      std::printf("%-9s %-12s error %.2e of the scale, estimate %.3f of it\n", how, name_of(rung),
                  error / verdict.scale, verdict.error.deformation / error);
      EXPECT_NEAR(verdict.error.deformation / error, 1.0, 0.05) << how << name_of(rung);
    }
  }
}

}  // namespace
}  // namespace freeflex::testing
