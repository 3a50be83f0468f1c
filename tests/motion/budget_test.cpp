// The live error budget: what it may not touch, when it starts again, and which part sees which error.
#include "core/model/compile.hpp"
#include "core/step/budget.hpp"
#include "tests/motion/rung_cases.hpp"
#include "tests/support/omissions.hpp"

namespace freeflex::testing {
namespace {

/// A plan in motion with its shadows.
struct Watched {
  Plan plan;
  State state;
  Workspace workspace;
  Budget budget;
  StepReport report;

  explicit Watched(const Scene& scene)
      : plan(lean_plan_of(scene)), state(make_state(plan)), workspace(make_workspace(plan)), budget(make_budget(plan)) {}

  BudgetReading run(int ticks, const Inputs& first = {}) {
    for (int k = 0; k < ticks; ++k) {
      const bool is_first = k == 0 && !first.commands.empty();
      prepare_budget(plan, state, budget);
      step(plan, state, is_first ? first : Inputs{}, workspace, report);
      EXPECT_EQ(report.status, StepStatus::kOk);
      follow_step(plan, state, is_first || report.num_expiries > 0, budget);
    }
    return read_budget(plan, state, budget);
  }
};

Scene watched_truss(Fidelity rung, double horizon, double spin = 0.5) {
  Scene scene = boxed_truss(spin, 10.0);
  scene.fidelity = rung;
  scene.rate = 1000.0;
  scene.error_budget.horizon = horizon;
  return scene;
}

TEST(Budget, LeavesTheMotionAsItIsToTheBit) {
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled, Fidelity::kExactBars}) {
    const Scene scene = watched_truss(rung, 0.05);
    Watched watched(scene);
    watched.run(200);
    Scene bare = scene;
    bare.error_budget.horizon = 0.0;
    const Simulation alone = run_rung(bare, rung, 1e-3, 0.2);
    EXPECT_EQ(watched.state.q, alone.state.q);
    EXPECT_EQ(watched.state.q_dot, alone.state.q_dot);
    EXPECT_EQ(watched.state.p_WB, alone.state.p_WB);
    EXPECT_EQ(watched.state.q_WB, alone.state.q_WB);
  }
}

TEST(Budget, StartsFromTheStateAndAgainWhenTheHorizonIsOver) {
  Watched watched(watched_truss(Fidelity::kSeparated, 0.05));
  prepare_budget(watched.plan, watched.state, watched.budget);
  EXPECT_EQ(read_budget(watched.plan, watched.state, watched.budget).total.position, 0.0);
  const BudgetReading full = watched.run(50);
  EXPECT_NEAR(full.age, 0.05, 1e-15);
  EXPECT_GT(full.total.elastic, 0.0);
  const BudgetReading anew = watched.run(1);
  EXPECT_NEAR(anew.age, 0.001, 1e-15);
  EXPECT_LT(anew.total.position, 1e-2 * full.total.position);
  // a reset is another motion
  reset_state(watched.plan, watched.state);
  EXPECT_NEAR(watched.run(3).age, 0.003, 1e-15);
}

// one reading is exact: a shadow is the rung itself
TEST(Budget, IsTheDistanceFromTheBestRung) {
  Watched watched(watched_truss(Fidelity::kSeparated, 10.0));
  const BudgetReading reading = watched.run(400);
  Scene scene = watched_truss(Fidelity::kExactBars, 0.0);
  const Simulation best = run_rung(scene, Fidelity::kExactBars, 1e-3, 0.4),
                   own = run_rung(scene, Fidelity::kSeparated, 1e-3, 0.4);
  const Eigen::Matrix3Xd off = own.positions_W() - best.positions_W();
  const double position = off.norm() / std::sqrt(static_cast<double>(off.cols()));
  EXPECT_NEAR(reading.total.position, kCover * position, 1e-9 * position);
}

TEST(Budget, PartsSeeThePeriodTheModesLeftOutAndTheRung) {
  // a coarse step under a sine, softly and without spin: integration
  Scene scene = watched_truss(Fidelity::kSeparated, 10.0, 0.0);
  scene.loads[0].forces[0].force = {0.0, 0.0, 1e-4};
  scene.loads[0].history = SineHistory{9.0, 0.0};
  scene.rate = 100.0;
  const BudgetReading coarse = Watched(scene).run(100);
  scene.rate = 200.0;
  const BudgetReading fine = Watched(scene).run(200);
  const double order = std::log2(coarse.integration.elastic / fine.integration.elastic);
  std::printf("integration %.1e, at half the period %.1e: order %.2f\n", coarse.integration.elastic,
              fine.integration.elastic, order);
  // the load is taken as linear within a step (X10)
  EXPECT_NEAR(order, 2.0, 0.2);
  EXPECT_GT(fine.integration.elastic, 3.0 * fine.model.elastic);
  EXPECT_EQ(fine.truncation.elastic, 0.0);

  const BudgetReading spun = Watched(watched_truss(Fidelity::kSeparated, 10.0, 1.0)).run(300);
  EXPECT_GT(spun.model.elastic, 100.0 * spun.integration.elastic);
}

// commands of which the plan knows nothing before they come
TEST(Budget, ShadowsTakeTheCommands) {
  Scene scene = watched_truss(Fidelity::kSpinLoaded, 10.0, 0.1);
  scene.loads.clear();
  Watched watched(scene);
  ForceCommand command = make_command(0, 1, Axes::kWorld, 100);
  add_force(command, 18, {0.0, 0.0, 5.0});
  const BudgetReading pushed = watched.run(300, {{&command, 1}});
  scene = watched_truss(Fidelity::kSpinLoaded, 10.0, 0.1);
  scene.loads[0].forces[0].force = {0.0, 0.0, 5.0};
  const BudgetReading loaded = Watched(scene).run(300);
  EXPECT_NEAR(pushed.total.elastic, loaded.total.elastic, 1e-6 * loaded.total.elastic);
  EXPECT_NEAR(pushed.total.position, loaded.total.position, 1e-6 * loaded.total.position);
}

TEST(Budget, OfABestShadowThatLeavesTheNumbersIsLost) {
  Scene scene = watched_truss(Fidelity::kSeparated, 10.0, 0.0);
  // no moment: the body stays, its bars stretch beyond what the full equations can square
  scene.loads[0].forces = {{18, {1e120, 0.0, 0.0}}, {14, {-1e120, 0.0, 0.0}}};
  EXPECT_TRUE(Watched(scene).run(50).is_lost);
}

}  // namespace
}  // namespace freeflex::testing
