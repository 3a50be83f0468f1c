// `fidelity: auto` chooses the cheapest rung whose estimated errors meet the tolerances of the scene. The
// set-up warns about what the run that tries the rungs does not show.
#include "core/plan/rungs/automatic.hpp"

#include "core/plan/make_plan.hpp"
#include "core/structure/structure.hpp"
#include "tests/motion/watched.hpp"

namespace freeflex::testing {
namespace {

std::vector<Fault> faults_of(const Scene& scene) {
  Faults faults;
  const auto structure = build_structure(scene, faults);
  if (structure) make_plan(scene, *structure, faults);
  return {faults.begin(), faults.end()};
}

TEST(Automatic, AutoRefusesTooManyTicksAndScenesWithoutAShadow) {
  Scene scene = boxed_truss(0.0, 1.0);
  scene.rate = 1000.0;
  scene.automatic = AutomaticRung{1e-3, {}, {}, 1e9, {}};
  std::vector<Fault> faults = faults_of(scene);
  ASSERT_FALSE(faults.empty());
  EXPECT_NE(faults.back().message.find("ticks, but at most 200000 are simulated"), std::string::npos)
      << faults.back().message;
  scene.automatic->horizon = 0.1;
  const Eigen::Matrix3d zero = Eigen::Matrix3d::Zero();
  scene.feedbacks.push_back({"f", 3, 3, zero, zero, 1e-3 * Eigen::Matrix3d::Identity(), {}});
  faults = faults_of(scene);
  ASSERT_FALSE(faults.empty());
  EXPECT_EQ(faults.back().message.find("fidelity: auto: no better plan supports the scene: acceleration "
                                       "feedback cannot be combined with the coupled rungs"),
            0U)
      << faults.back().message;
}

// Each component of a tolerance is a separate limit. For example, a tolerance of half the error of the rung
// `separated` requires a rung above it.
TEST(Automatic, AutoMeetsEachToleranceSeparately) {
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

// A rung that cannot represent the initial state is not chosen.
TEST(Automatic, AutoCountsTheInitialStateThatARungOmits) {
  Scene scene = boxed_truss(0.0, 0.0);
  scene.loads.clear();
  scene.rate = 1000.0;
  scene.initial.points.push_back({18, {0.0, 0.0, 1e-6}, {0.0, 0.0, 0.0}});
  scene.automatic = AutomaticRung{{}, {}, 0.05, 0.1, {}};
  const Plan plan = reduced_plan_of(scene);
  EXPECT_EQ(plan.tried_rungs[0].rung, Fidelity::kRigid);
  EXPECT_NEAR(plan.tried_rungs[0].elastic, 1.0, 1e-12);
  EXPECT_GT(plan.fidelity, Fidelity::kRigid);
}

TEST(Automatic, LoadsThatBeginAfterTheHorizonAreReported) {
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

TEST(Automatic, ReportsThatAutoDidNotCheckTheToleranceAtThisRate) {
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

TEST(Automatic, WarnsThatAModeToleranceHasNoEffectIfEveryModeIsNeeded) {
  Scene scene = boxed_truss(0.0, 1.0);
  scene.leave_out.tolerance = 0.1;
  scene.fidelity = Fidelity::kCorotational;
  const std::vector<Fault> faults = faults_of(scene);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].message.find("leave_out: tolerance has no effect on fidelity corotational"), 0U)
      << faults[0].message;
}

TEST(Automatic, WarnsOnCoupledRungsTooIfFeedbackMakesAMotionGrow) {
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
