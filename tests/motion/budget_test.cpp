// The live error budget does not change the motion, restarts after each horizon, each reset and each step
// without the budget, and shows each kind of error in its own component.

#include "core/error/budget.hpp"

#include "core/error/judgement.hpp"
#include "core/plan/make_plan.hpp"
#include "core/plan/rungs/automatic.hpp"
#include "core/structure/structure.hpp"
#include "tests/motion/watched.hpp"

namespace freeflex::testing {
namespace {

TEST(Budget, LeavesEveryBitOfTheMotionUnchanged) {
  for (const Fidelity rung :
       {Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled, Fidelity::kCorotational}) {
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

TEST(Budget, RestartsFromTheStateAfterEachHorizon) {
  Watched watched(watched_truss(Fidelity::kSeparated, 0.05));
  EXPECT_EQ(read_budget(watched.plan, watched.state, watched.budget).total.position, 0.0);
  const BudgetReading full = watched.run(50);
  EXPECT_NEAR(full.age, 0.05, 1e-15);
  EXPECT_GT(full.total.elastic, 0.0);
  const BudgetReading anew = watched.run(1);
  EXPECT_NEAR(anew.age, 0.001, 1e-15);
  EXPECT_LT(anew.total.position, 1e-2 * full.total.position);
  // a reset begins another motion, so the budget restarts
  reset_state(watched.plan, watched.state);
  EXPECT_NEAR(watched.run(3).age, 0.003, 1e-15);
}

// A caller may step without the budget. The shadows then restart, so the estimate covers less time but stays
// valid.
TEST(Budget, RestartsAfterAStepWithoutTheBudget) {
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled}) {
    Watched watched(watched_truss(rung, 10.0));
    const BudgetReading old = watched.run(30);
    ForceCommand command = make_command(0, 1, Axes::kWorld, 100);
    add_force(command, 18, {0.0, 0.0, 5.0});
    step(watched.plan, watched.state, {{&command, 1}}, watched.workspace, watched.report);
    const BudgetReading joined = read_budget(watched.plan, watched.state, watched.budget);
    EXPECT_EQ(joined.age, 0.0);
    EXPECT_LT(joined.total.position, 1e-6 * old.total.position)
        << "the difference is the rounding error of the modal coordinates";
    step(watched.plan, watched.state, {}, watched.workspace, watched.report);
    State state = watched.state;
    const BudgetReading anew = watched.run(5);
    EXPECT_NEAR(anew.age, 0.005, 1e-15);
    // the budget equals the budget of a run that starts at this tick with the same command in force
    Workspace workspace = make_workspace(watched.plan);
    Budget fresh = make_budget(watched.plan);
    for (int k = 0; k < 5; ++k) step(watched.plan, state, {}, workspace, fresh, watched.report);
    const BudgetReading expected = read_budget(watched.plan, state, fresh);
    EXPECT_EQ(anew.total.position, expected.total.position);
    EXPECT_EQ(anew.total.attitude, expected.total.attitude);
    EXPECT_EQ(anew.total.elastic, expected.total.elastic);
    EXPECT_EQ(anew.unresolved, expected.unresolved);
  }
}

// A loop that is paused after a reset publishes its status, which includes the budget, before the next tick.
TEST(Budget, IsZeroWhenReadAfterAReset) {
  Watched watched(watched_truss(Fidelity::kSeparated, 10.0));
  watched.run(30);
  reset_state(watched.plan, watched.state);
  const BudgetReading reading = read_budget(watched.plan, watched.state, watched.budget);
  EXPECT_EQ(reading.age, 0.0);
  EXPECT_EQ(reading.total.position, 0.0);
}

TEST(Budget, IsUnchangedIfAStepFails) {
  Watched watched(watched_truss(Fidelity::kSeparated, 10.0));
  const BudgetReading before = watched.run(30);
  ForceCommand command = make_command(0, 1, Axes::kWorld, 100);
  add_force(command, 18, Eigen::Vector3d::Constant(std::numeric_limits<double>::max()));
  step(watched.plan, watched.state, {{&command, 1}}, watched.workspace, watched.budget, watched.report);
  EXPECT_EQ(watched.report.status, StepStatus::kNotFinite);
  const BudgetReading after = read_budget(watched.plan, watched.state, watched.budget);
  EXPECT_EQ(after.age, before.age);
  EXPECT_EQ(after.total.position, before.total.position);
  EXPECT_EQ(after.total.elastic, before.total.elastic);
  EXPECT_NEAR(watched.run(1).age, 0.031, 1e-15);
}

TEST(Budget, TheReadingIsEmptyForAPlanWithoutABudget) {
  Watched watched(watched_truss(Fidelity::kSeparated, 0.0));
  const BudgetReading reading = watched.run(10);
  EXPECT_EQ(reading.age, 0.0);
  EXPECT_EQ(reading.total.position, 0.0);
  EXPECT_EQ(watched.state.tick, 10);
}

// The shadow makes the same motion as a simulation on the best rung.
TEST(Budget, PositionAndAttitudeAreProportionalToTheDistanceFromTheBestRung) {
  Watched watched(watched_truss(Fidelity::kSeparated, 10.0));
  const BudgetReading reading = watched.run(400);
  Scene scene = watched_truss(Fidelity::kCorotational, 0.0);
  const Simulation best = run_rung(scene, Fidelity::kCorotational, 1e-3, 0.4),
                   own = run_rung(scene, Fidelity::kSeparated, 1e-3, 0.4);
  const Eigen::Matrix3Xd off = own.positions_W() - best.positions_W();
  const double position = off.norm() / std::sqrt(static_cast<double>(off.cols()));
  EXPECT_NEAR(reading.total.position, kCover * position, 1e-9 * position);
  const auto attitude = [](const Simulation& of) {
    const Quat& q = of.state.q_WB;
    return Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
  };
  const double angle = attitude(own).angularDistance(attitude(best));
  EXPECT_NEAR(reading.total.attitude, kCover * angle, 1e-6 * angle)
      << "for small angles the attitude error is the angle";
}

TEST(Budget, SeparatesIntegrationErrorTruncationErrorAndModelError) {
  // a coarse step under a sine load, with small deformation and no spin, has only integration error
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
  // the order is 2, because the step interpolates the load linearly (THEORY 6.1)
  EXPECT_NEAR(order, 2.0, 0.2);
  EXPECT_GT(fine.integration.elastic, 3.0 * fine.model.elastic);
  EXPECT_EQ(fine.truncation.elastic, 0.0);

  // modes that contribute less than a tenth are omitted, and on small motions the rung agrees with the best
  // rung, so there is only truncation error
  scene.rate = 2000.0;
  scene.pushable.clear();
  scene.leave_out.tolerance = 0.1;
  scene.leave_out.horizon = 0.25;
  Watched reduced(scene);
  ASSERT_LT(reduced.plan.num_elastic, 54);
  const BudgetReading cut = reduced.run(500);
  std::printf("%d of 54 modes: truncation %.1e, integration %.1e, model %.1e\n", reduced.plan.num_elastic,
              cut.truncation.elastic, cut.integration.elastic, cut.model.elastic);
  EXPECT_GT(cut.truncation.elastic, 3.0 * std::max(cut.integration.elastic, cut.model.elastic));
  EXPECT_LT(cut.truncation.elastic, 0.5);

  const BudgetReading spun = Watched(watched_truss(Fidelity::kSeparated, 10.0, 1.0)).run(300);
  EXPECT_GT(spun.model.elastic, 100.0 * spun.integration.elastic);
}

// Commands are not in the plan, so the shadows must receive them with the step.
TEST(Budget, ShadowsReceiveCommands) {
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

TEST(Budget, IsLostWhenTheReferenceShadowDiverges) {
  Scene scene = watched_truss(Fidelity::kSeparated, 10.0, 0.0);
  // The forces have no moment, so the body keeps its attitude. The bars become so long that the square of
  // their length overflows in the full equations.
  scene.loads[0].forces = {{18, {1e120, 0.0, 0.0}}, {14, {-1e120, 0.0, 0.0}}};
  EXPECT_TRUE(Watched(scene).run(50).is_lost);
}

// No rung includes the second-order terms of beams, so all rungs agree on beams and may all be wrong. The
// rungs do include the second-order terms of dashpots.
TEST(Budget, VerdictUsesTheDisplacementOfMatricesWhichEveryRungLinearises) {
  using Level = Verdict::Level;
  Scene springs = watched_truss(Fidelity::kCorotational, 10.0);
  springs.loads[0].forces[0].force = {0.0, 0.0, 10000.0};
  Scene damped = springs, matrix = springs;
  Link dashpot;
  dashpot.name = "d";
  dashpot.points = {0, 19};
  dashpot.kind = Dashpot{5.0};
  damped.links.push_back(dashpot);
  Link brace;
  brace.name = "b";
  brace.points = {0, 19};
  const Eigen::Vector3d u = (springs.points[19].position - springs.points[0].position).normalized();
  Eigen::MatrixXd stiffness(6, 6);
  const Eigen::Matrix3d along = 100.0 * u * u.transpose();
  stiffness << along, -along, -along, along;
  brace.kind = MatrixLink{stiffness.sparseView(), false, false, 0};
  matrix.links.push_back(brace);
  EXPECT_EQ(verdict_of(springs, 150).first.level, Level::kGood);
  EXPECT_EQ(verdict_of(damped, 150).first.level, Level::kGood);
  const auto [verdict, cause] = verdict_of(matrix, 150);
  EXPECT_NE(verdict.level, Level::kGood) << cause;
  matrix.loads[0].forces[0].force = {0.0, 0.0, 1.0};
  EXPECT_EQ(verdict_of(matrix, 150).first.level, Level::kGood);
}

std::vector<Fault> faults_of(const Scene& scene) {
  Faults faults;
  const auto structure = build_structure(scene, faults);
  if (structure) make_plan(scene, *structure, faults);
  return {faults.begin(), faults.end()};
}

TEST(Budget, AutoRefusesTooManyTicksAndScenesWithoutAReferenceSolution) {
  Scene scene = boxed_truss(0.0, 1.0);
  scene.rate = 1000.0;
  scene.automatic = AutomaticRung{1e-3, {}, {}, 1e9, {}};
  std::vector<Fault> faults = faults_of(scene);
  ASSERT_FALSE(faults.empty());
  EXPECT_NE(faults.back().message.find("ticks, but at most 200000 are simulated"), std::string::npos)
      << faults.back().message;
  scene.automatic->horizon = 0.1;
  scene.links[3].kind = Spring{1e15};
  faults = faults_of(scene);
  ASSERT_FALSE(faults.empty());
  EXPECT_EQ(faults.back().message.find("fidelity: auto: the reference equations (fidelity corotational"), 0U)
      << faults.back().message;
}

// Each component of a tolerance is a separate limit. For example, a tolerance of half the error of the rung
// `separated` requires a rung above it.
TEST(Budget, AutoMeetsEachToleranceSeparately) {
  Scene scene = boxed_truss(0.5, 10.0);
  scene.rate = 1000.0;
  using Part = std::pair<std::optional<double> AutomaticRung::*, double PlanRung::*>;
  for (const auto& [asked, found] : {Part{&AutomaticRung::position, &PlanRung::position},
                                     Part{&AutomaticRung::attitude, &PlanRung::attitude},
                                     Part{&AutomaticRung::elastic, &PlanRung::elastic}}) {
    const auto choose = [&](double tolerance) {
      scene.automatic = AutomaticRung{{}, {}, {}, 0.5, {}};
      (*scene.automatic).*asked = tolerance;
      return reduced_plan_of(scene);
    };
    const Plan loose = choose(1e3);
    ASSERT_EQ(loose.tried_rungs.size(), 1U) << "rigid suffices";
    double separated = 0.0;
    const Plan strict = choose(1e-3 * (loose.tried_rungs[0].*found));
    for (const PlanRung& rung : strict.tried_rungs)
      if (rung.rung == Fidelity::kSeparated) separated = rung.*found;
    ASSERT_GT(separated, 0.0);
    const Plan plan = choose(0.5 * separated);
    EXPECT_GT(plan.fidelity, Fidelity::kSeparated);
    EXPECT_EQ(plan.tried_rungs.back().rung, plan.fidelity);
    EXPECT_LE((plan.tried_rungs.back().*found), 0.5 * separated);
    for (std::size_t k = 0; k + 1 < plan.tried_rungs.size(); ++k)
      EXPECT_GT((plan.tried_rungs[k].*found), 0.5 * separated) << "a cheaper rung would suffice";
  }
}

TEST(Budget, LoadsThatBeginAfterTheHorizonAreReported) {
  Scene scene = boxed_truss(0.0, 1.0);
  scene.pushable.clear();
  scene.loads[0].history = PulseHistory{1.0, 0.1};
  scene.leave_out.tolerance = 0.01;
  scene.leave_out.horizon = 1.0;
  std::vector<Fault> faults = faults_of(scene);
  ASSERT_FALSE(faults.empty());
  EXPECT_EQ(faults[0].message,
            "load 'push' begins at 1 s, after the horizon of 1 s, so leave_out: tolerance ignores this load; "
            "set a longer horizon");
  scene.leave_out = {};
  scene.loads[0].history = TableHistory{{0.0, 0.7, 0.8}, {0.0, 0.0, 1.0}};
  scene.automatic = AutomaticRung{1.0, {}, {}, 0.6, {}};
  faults = faults_of(scene);
  ASSERT_FALSE(faults.empty());
  EXPECT_EQ(faults[0].message.find("load 'push' begins at 0.7 s, after the horizon of 0.6 s"), 0U)
      << faults[0].message;
  scene.automatic->horizon = 0.75;
  for (const Fault& fault : faults_of(scene)) EXPECT_EQ(fault.message.find("begins at"), std::string::npos);
}

TEST(Budget, ReportsThatAutoDidNotCheckTheToleranceAtThisRate) {
  Scene scene = boxed_truss(0.0, 1.0);
  scene.automatic = AutomaticRung{1.0, {}, {}, 0.1, {}};
  const Plan plan = reduced_plan_of(scene);
  EXPECT_EQ(find_untried_rate(plan, 1000.0), "");
  EXPECT_EQ(find_untried_rate(plan, 50.0),
            "fidelity: auto chose rigid at 1000 Hz, but at 50 Hz the tolerance was not checked; set this "
            "rate in the scene");
  scene.automatic.reset();
  EXPECT_EQ(find_untried_rate(reduced_plan_of(scene), 50.0), "");
}

TEST(Budget, WarnsThatAModeToleranceHasNoEffectIfEveryModeIsNeeded) {
  Scene scene = boxed_truss(0.0, 1.0);
  scene.leave_out.tolerance = 0.1;
  scene.fidelity = Fidelity::kCorotational;
  const std::vector<Fault> faults = faults_of(scene);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].message.find("leave_out: tolerance has no effect on fidelity corotational"), 0U)
      << faults[0].message;
}

TEST(Budget, WarnsOnCoupledRungsTooIfFeedbackMakesAMotionGrow) {
  Scene scene = boxed_truss(0.0, 1.0);
  scene.rate = 2000.0;
  scene.feedbacks.push_back(
      {"f", 3, 3, Eigen::Matrix3d::Zero(), 20.0 * Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Zero(), {}});
  for (const Fidelity rung :
       {Fidelity::kSeparated, Fidelity::kCoupled, Fidelity::kCorotational, Fidelity::kFull}) {
    scene.fidelity = rung;
    const std::vector<Fault> faults = faults_of(scene);
    ASSERT_EQ(faults.size(), 1U) << name_of(rung);
    EXPECT_EQ(faults[0].severity, Fault::Severity::kWarning);
    EXPECT_NE(faults[0].message.find("drives a motion that grows"), std::string::npos) << faults[0].message;
  }
}

}  // namespace
}  // namespace freeflex::testing
