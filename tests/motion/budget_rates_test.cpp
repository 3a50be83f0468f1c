// These tests check the error budget at rates that do not resolve the vibration. The shadows divide the tick
// into substeps. If the substeps do not resolve the vibration either, the verdict is not `good`.
#include "core/plan/file/plan_bytes.hpp"
#include "core/plan/rungs/rates.hpp"
#include "tests/motion/watched.hpp"

namespace freeflex::testing {
namespace {

/// This struct holds the estimated error of a rung at a rate [Hz] over 0.96 s, and the true error of this
/// rung against SUNDIALS on Cartesian points.
struct EstimateAndTruth {
  double estimate = 0.0, truth = 0.0;   // [-] elastic
  double slowest = 0.0, fastest = 0.0;  // [rad] phase of the slowest and fastest mode in a tick
};
Scene scene_at(Scene scene, Fidelity rung, double rate) {
  scene.fidelity = rung;
  scene.rate = rate;
  scene.error_budget.horizon = 10.0;
  return scene;
}
EstimateAndTruth estimate_at(const Scene& scene, const Truth& truth, Fidelity rung, double rate) {
  Watched watched(scene_at(scene, rung, rate));
  const int ticks = static_cast<int>(std::lround(0.96 * rate));
  const BudgetReading reading = watched.run(ticks);
  const StepPlan& best = watched.plan.budget.shadows[0].plan;
  return {reading.total.elastic, errors_of(run_rung(scene, rung, 1.0 / rate, 0.96), truth).elastic,
          best.omega[0] / rate, best.omega[static_cast<std::size_t>(best.num_elastic) - 1] / rate};
}

/// Expects an estimate of 1 to 1.6 times the true error, because kCover is 1.25, and substeps of 1 rad have
/// an error too.
void expect_honest(const Scene& scene, std::initializer_list<double> rates,
                   std::initializer_list<Fidelity> rungs) {
  const Truth truth = truth_of(scene, 0.96);
  for (const double rate : rates)
    for (const Fidelity rung : rungs) {
      const EstimateAndTruth honest = estimate_at(scene, truth, rung, rate);
      const double share = honest.estimate / honest.truth;
      std::printf("%4.0f Hz, %5.2f to %.0f rad a tick, %-12s elastic error %.2e, estimate %.2f of it\n", rate,
                  honest.slowest, honest.fastest, name_of(rung), honest.truth, share);
      EXPECT_GE(share, 1.0) << rate << name_of(rung);
      EXPECT_LE(share, 1.6) << rate << name_of(rung);
    }
}

/// Returns a truss that is so stiff that spin deforms it little, with a load that begins suddenly and makes
/// it vibrate.
Scene stiff_truss(double stiffness, double spin, double force) {
  Scene scene = boxed_truss(spin, force);
  for (Link& link : scene.links) link.kind = Spring{stiffness};
  scene.loads[0].history = PulseHistory{0.0, 0.12};
  return scene;
}

// Coriolis forces rotate the plane of vibration, but a step that does not resolve the vibration misses this
// rotation. A best rung without substeps estimated a fifth of the true error or less at the lowest rates.
TEST(Budget, EstimateCoversTheErrorIfTheTickDoesNotResolveTheSlowestMode) {
  expect_honest(stiff_truss(1e6, 3.0, 100.0), {25.0, 50.0, 100.0, 200.0, 400.0},
                {Fidelity::kSpinLoaded, Fidelity::kCoupled, Fidelity::kCorotational});
}

/// Returns two stiff trusses with a soft bay between them. The slowest mode is not excited. One end deforms
/// to an oval and vibrates while the structure rotates about its long axis, and Coriolis forces couple modes
/// of nearly equal frequency.
Scene soft_in_the_middle() {
  Scene scene = stiff_truss(1e6, 0.0, 0.0);
  scene.loads.clear();
  scene.initial.angular_velocity = {1.0, 0.0, 0.0};
  const auto section = [](int point) { return point / 4; };
  for (Link& link : scene.links)
    if (section(link.points[0]) == 1 && section(link.points[1]) == 2) link.kind = Spring{2e3};
  for (const auto& [point, y] : {std::pair{0, 3e-6}, {1, 3e-6}, {2, -3e-6}, {3, -3e-6}})
    scene.initial.points.push_back({point, {0.0, y, -y}, {0.0, 0.0, 0.0}});
  return scene;
}

TEST(Budget, EstimateCoversTheErrorIfModesAboveTheLowestVibrate) {
  Scene plain = stiff_truss(1e6, 0.6, 0.0);
  plain.loads.clear();
  plain.initial.points = {{3, {0.0, 2e-5, 0.0}, {0.0, 0.0, 0.0}}, {17, {1e-5, 0.0, -2e-5}, {0.0, 0.0, 0.0}}};
  for (const Scene& scene : {plain, soft_in_the_middle()})
    expect_honest(scene, {25.0, 50.0, 100.0, 400.0},
                  {Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled, Fidelity::kCorotational});
}

// The scene has 114 modes, so a substep costs as much as three substeps with 64 modes.
TEST(Budget, ALargeStructureHasFewerSubstepsThanASmallOne) {
  Scene scene = stiff_truss(1e7, 0.0, 1.0);
  const Scene half = scene;
  for (PointMass point : half.points) {
    point.name += "'", point.position.x() += 5.0;
    scene.points.push_back(point);
  }
  for (Link link : half.links) {
    link.name += "'", link.points[0] += 20, link.points[1] += 20;
    scene.links.push_back(link);
  }
  for (int c = 0; c < 4; ++c)
    for (const int to : {c, (c + 1) % 4}) {
      Link link = half.links[0];
      link.name = "j" + std::to_string(10 * c + to), link.points = {16 + c, 20 + to};
      scene.links.push_back(link);
    }
  const auto substeps_of = [](const Scene& of) {
    return reduced_plan_of(scene_at(of, Fidelity::kSeparated, 100.0)).budget.shadows[0].substeps;
  };
  EXPECT_EQ(substeps_of(half), 128) << "16384 substeps a second at 100 Hz";
  EXPECT_EQ(substeps_of(scene), 32) << "the limit is multiplied by (64 / 114)^2";
}

// The largest allowed number of substeps does not resolve the vibration.
TEST(Budget, ARotatingBodyIsNotRatedGoodIfNoSubstepResolvesVibration) {
  for (const double spin : {0.0, 3.0}) {
    const Scene scene = stiff_truss(1e11, spin, 1.0);
    const auto [verdict, cause] = verdict_of(scene_at(scene, Fidelity::kSpinLoaded, 50.0), 48);
    EXPECT_EQ(verdict.level, spin > 0.0 ? Verdict::Level::kWatch : Verdict::Level::kGood) << cause;
    if (spin > 0.0) {
      EXPECT_EQ(cause.find("integration: the reference solution of the error budget does not resolve"), 0U)
          << cause;
    }
  }
  // the error depends on the angle rotated so far, not on the remaining spin
  Scene stopped = stiff_truss(1e11, 1.0, 0.0);
  stopped.loads.clear();
  stopped.initial.points.push_back({3, {0.0, 0.0, 1e-9}, {0.0, 0.0, 0.0}});
  Watched watched(scene_at(stopped, Fidelity::kSpinLoaded, 50.0));
  const double rotating = watched.run(40).unresolved;
  watched.state.H_W = watched.state.H_W_low = {};
  EXPECT_GE(watched.run(1).unresolved, 0.5 * rotating);
  EXPECT_GT(rotating, 0.1);
}

// If a plan cannot represent all of the initial state, the error budget compares its motion with the motion
// from the complete initial state.
TEST(Budget, EstimatesTheErrorDueToTheInitialStateOfOmittedModes) {
  Scene scene = watched_truss(Fidelity::kRigid, 10.0, 0.0);
  scene.loads.clear();
  scene.initial.points.push_back({18, {0.0, 0.0, 1e-6}, {0.0, 0.0, 0.0}});
  EXPECT_NEAR(Watched(scene).run(50).total.elastic, kCover, 1e-12);
  scene.error_budget.horizon = 0.0;
  scene.automatic = AutomaticRung{};
  scene.automatic->elastic = 0.05;
  scene.automatic->horizon = 0.1;
  EXPECT_GT(reduced_plan_of(scene).fidelity, Fidelity::kRigid);
  scene.automatic.reset();
  scene.fidelity = Fidelity::kSeparated;
  scene.error_budget.horizon = 10.0;
  scene.pushable.clear();
  scene.leave_out.tolerance = 0.3;
  scene.leave_out.horizon = 0.1;
  Watched reduced(scene);
  ASSERT_LT(reduced.plan.num_elastic, 54);
  const BudgetReading cut = reduced.run(50);
  std::printf("%d of 54 modes: truncation %.2f, estimate %.2f\n", reduced.plan.num_elastic,
              cut.truncation.elastic, cut.total.elastic);
  EXPECT_GT(cut.truncation.elastic, 0.01);
  EXPECT_GT(cut.total.elastic, cut.truncation.elastic);
}

TEST(Budget, ShadowsAreRebuiltForAnotherRate) {
  Scene scene = scene_at(stiff_truss(1e6, 3.0, 100.0), Fidelity::kSpinLoaded, 1000.0);
  Plan plan = reduced_plan_of(scene);
  const std::int32_t substeps = plan.budget.shadows[0].substeps;
  set_rate(plan, 50.0);
  scene.rate = 50.0;
  const Plan given = reduced_plan_of(scene);
  ASSERT_EQ(plan.budget.shadows.size(), given.budget.shadows.size());
  for (std::size_t k = 0; k < given.budget.shadows.size(); ++k) {
    EXPECT_EQ(plan.budget.shadows[k].substeps, given.budget.shadows[k].substeps);
    EXPECT_EQ(plan.budget.shadows[k].plan.period, given.budget.shadows[k].plan.period);
  }
  EXPECT_GT(plan.budget.shadows[0].substeps, 8 * substeps);
  // a plan that omits part of the initial state can be converted to bytes and back
  std::string error;
  EXPECT_TRUE(plan_from_bytes(plan_to_bytes(given), error).has_value()) << error;
}

}  // namespace
}  // namespace freeflex::testing
