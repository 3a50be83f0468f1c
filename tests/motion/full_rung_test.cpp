// The rung `full` has exact bars in ticks that are divided until the fastest motion is resolved (THEORY
// 12.29).
#include "core/plan/make_plan.hpp"
#include "core/plan/rungs/rungs.hpp"
#include "core/structure/structure.hpp"
#include "tests/motion/verdict_truth.hpp"
#include "tests/motion/watched.hpp"

namespace freeflex::testing {
namespace {

/// Returns the boxed truss in which every second spring is stiffer by the factor `ratio`.
Scene stiffened(double ratio) {
  Scene scene = boxed_truss(5.0, 10.0);
  for (std::size_t k = 1; k < scene.links.size(); k += 2) scene.links[k].kind = Spring{1e5 * ratio};
  return scene;
}

Link dashpot(double coefficient) {
  Link link;
  link.name = "d";
  link.points = {0, 1};
  link.kind = Dashpot{coefficient};
  return link;
}

std::string refusal(Scene scene, Fidelity rung, double rate) {
  scene.fidelity = rung;
  scene.integration.by = IntegrateBy::kModes;
  scene.rate = rate;
  return refusal_of(scene);
}

TEST(FullRung, ResolvesStiffBarsThatTheExactBarsRungDoesNotResolve) {
  constexpr double kEnd = 0.25;
  for (const double ratio : {1.0, 1e2, 1e4}) {
    const Scene scene = stiffened(ratio);
    const Truth truth = truth_of(scene, kEnd);
    const Simulation full = run_rung(scene, Fidelity::kFull, 1e-3, kEnd);
    const Errors errors = errors_of(full, truth);
    const Errors undivided = errors_of(run_rung(scene, Fidelity::kCorotational, 1e-3, kEnd), truth);
    const double omega = full.plan.omega[static_cast<std::size_t>(full.plan.num_elastic) - 1];
    std::printf("omega_max h %5.1f, %3d substeps: elastic error %.1e, undivided %.1e\n", omega * 1e-3,
                full.plan.coupled.num_substeps, errors.elastic, undivided.elastic);
    EXPECT_LE(omega * 1e-3 / full.plan.coupled.num_substeps, kFullPhase);
    EXPECT_GT(2.0 * omega * 1e-3 / full.plan.coupled.num_substeps, kFullPhase)
        << "more substeps than necessary";
    EXPECT_LT(errors.elastic, 1e-6);
  }
}

// A tick of m substeps equals m ticks of exact bars, because pulses, sines and tables are evaluated at the
// same times.
TEST(FullRung, TheFullRungEqualsExactBarsAtTheRateOfItsSubsteps) {
  Scene scene = stiffened(1e2);
  Load sine = scene.loads[0], table = scene.loads[0];
  scene.loads[0].history = PulseHistory{16.0 / 512.0, 32.0 / 512.0};
  sine.name = "sine";
  sine.history = SineHistory{7.3, 0.2};
  table.name = "table";
  table.history = TableHistory{{0.0, 0.0313, 0.2}, {0.0, 1.0, -2.0}};
  scene.loads.push_back(sine);
  scene.loads.push_back(table);
  const Simulation full = run_rung(scene, Fidelity::kFull, 1.0 / 512.0, 0.25);
  const std::int32_t substeps = full.plan.coupled.num_substeps;
  ASSERT_GT(substeps, 4);
  const Simulation fine = run_rung(scene, Fidelity::kCorotational, 1.0 / 512.0 / substeps, 0.25);
  EXPECT_EQ(elastic_of(scene, full), elastic_of(scene, fine));
  EXPECT_EQ(full.state.p_WB, fine.state.p_WB);
  EXPECT_EQ(full.state.q_WB, fine.state.q_WB);
  EXPECT_EQ(full.state.H_W, fine.state.H_W);
}

// A dashpot of 2e4 N s/m on 1 kg gives rates of 2e4 1/s and more. With a tick of 1 ms, the stages are
// accurate only up to a rate of 1e3 1/s.
TEST(FullRung, DividesTheTickForDashpotsThatOtherRungsRefuse) {
  Scene scene = boxed_truss(0.0, 1e-3);
  scene.links.push_back(dashpot(2e4));
  for (const Fidelity rung : {Fidelity::kCoupled, Fidelity::kCorotational}) {
    const std::string message = refusal(scene, rung, 1000.0);
    for (const char* fragment :
         {"at 1000 Hz is not possible, because dashpots and feedback change the motion at ", "at stage times",
          "Raise the rate to ", "set fidelity: full, spin-loaded or a rung below spin-loaded"})
      EXPECT_NE(message.find(fragment), std::string::npos) << message;
  }
  const Simulation full = run_rung(scene, Fidelity::kFull, 1e-3, 0.5);
  EXPECT_GE(full.plan.coupled.num_substeps, 64);
  const Eigen::Matrix3Xd below = elastic_of(scene, run_rung(scene, Fidelity::kSeparated, 1e-3, 0.5));
  const double difference = elastic_error(elastic_of(scene, full), below);
  std::printf("%d substeps; off from the exponential of the damped modes: %.1e\n",
              full.plan.coupled.num_substeps, difference);
  // the bound allows for second-order terms, because displacements are 1e-7 m over lengths of 1 m
  EXPECT_LT(difference, 1e-5);
}

TEST(FullRung, ATickThatNeedsTooManySubstepsIsRefused) {
  Scene scene = boxed_truss(0.0, 1.0);
  scene.links.push_back(dashpot(1e10));
  const std::string message = refusal(scene, Fidelity::kFull, 10.0);
  for (const char* fragment :
       {"fidelity full at 10 Hz", "more than 65536 substeps per tick", "set fidelity: coupled"})
    EXPECT_NE(message.find(fragment), std::string::npos) << message;
}

// The shadow is on the same rung, with substeps of half the length.
TEST(FullRung, TheVerdictEstimatesTheIntegrationErrorOfTheFullRung) {
  Scene scene = stiffened(1e2);
  scene.fidelity = Fidelity::kFull;
  scene.integration.by = IntegrateBy::kModes;
  scene.rate = 500.0;
  Watched watched(scene);
  const Plan& plan = watched.plan;
  ASSERT_EQ(plan.verdict.shadows.size(), 1U);
  const PlanShadow& shadow = plan.verdict.shadows[0];
  EXPECT_EQ(shadow.substeps * shadow.plan.coupled.num_substeps, 2 * plan.coupled.num_substeps);
  const Verdict& verdict = watched.run(125);
  const Simulation best =
      run_rung(scene, Fidelity::kCorotational, 1.0 / 500.0 / plan.coupled.num_substeps / 8.0, 0.25);
  const Simulation own = run_rung(scene, Fidelity::kFull, 1.0 / 500.0, 0.25);
  const double error = rms_over_mass(scene, elastic_of(scene, own) - elastic_of(scene, best));
  std::printf("estimate %.2e m, error %.2e m\n", verdict.error.deformation, error);
  // the shadow has a sixteenth of the error itself
  EXPECT_GT(verdict.error.deformation, 0.9 * error);
  EXPECT_LT(verdict.error.deformation, error);
}

}  // namespace
}  // namespace freeflex::testing
