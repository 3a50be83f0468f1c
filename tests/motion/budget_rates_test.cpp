// The error budget at rates that do not resolve what vibrates: parts of a tick, and what the word says beyond
// them.
#include "core/plan/plan_bytes.hpp"
#include "core/plan/rates.hpp"
#include "tests/motion/watched.hpp"

namespace freeflex::testing {
namespace {

/// Estimate of a rung at a rate [Hz] over 0.96 s, and the truth by SUNDIALS on Cartesian points.
struct Honest {
  double estimate = 0.0, truth = 0.0;   // [-] elastic
  double slowest = 0.0, fastest = 0.0;  // [rad] of a mode in a tick
};
Scene scene_at(Scene scene, Fidelity rung, double rate) {
  scene.fidelity = rung;
  scene.rate = rate;
  scene.error_budget.horizon = 10.0;
  return scene;
}
Honest estimate_at(const Scene& scene, const Truth& truth, Fidelity rung, double rate) {
  Watched watched(scene_at(scene, rung, rate));
  const int ticks = static_cast<int>(std::lround(0.96 * rate));
  const BudgetReading reading = watched.run(ticks);
  const Plan& best = watched.plan.budget.shadows[0].plan;
  return {reading.total.elastic, errors_of(run_rung(scene, rung, 1.0 / rate, 0.96), truth).elastic,
          best.omega[0] / rate, best.omega[static_cast<std::size_t>(best.num_elastic) - 1] / rate};
}

/// kCover is 1.25, and parts of 1 rad have an error of their own.
void expect_honest(const Scene& scene, std::initializer_list<double> rates,
                   std::initializer_list<Fidelity> rungs) {
  const Truth truth = truth_of(scene, 0.96);
  for (const double rate : rates)
    for (const Fidelity rung : rungs) {
      const Honest honest = estimate_at(scene, truth, rung, rate);
      const double share = honest.estimate / honest.truth;
      std::printf("%4.0f Hz, %5.2f to %.0f rad a tick, %-12s elastic error %.2e, estimate %.2f of it\n", rate,
                  honest.slowest, honest.fastest, name_of(rung), honest.truth, share);
      EXPECT_GE(share, 1.0) << rate << name_of(rung);
      EXPECT_LE(share, 1.6) << rate << name_of(rung);
    }
}

/// Stiff enough that spin moves little, with what a step leaves vibrating.
Scene stiff_truss(double stiffness, double spin, double force) {
  Scene scene = boxed_truss(spin, force);
  for (Link& link : scene.links) link.kind = Spring{stiffness};
  scene.loads[0].history = PulseHistory{0.0, 0.12};
  return scene;
}

// Coriolis forces turn the vibration, and a step in which it is not resolved does not see that. Estimates of
// a best rung at the tick itself: a fifth of the truth and less at the lowest rates
TEST(Budget, EstimateIsHonestWhereTheTickDoesNotResolveTheSlowestMode) {
  expect_honest(stiff_truss(1e6, 3.0, 100.0), {25.0, 50.0, 100.0, 200.0, 400.0},
                {Fidelity::kSpinLoaded, Fidelity::kCoupled, Fidelity::kExactBars});
}

/// Two stiff trusses with a soft bay between, whose slowest mode is not what vibrates: an oval of one end
/// that turns about its axis, where Coriolis forces join modes of nearly one frequency.
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

TEST(Budget, EstimateIsHonestWhereOtherModesThanTheSlowestVibrate) {
  Scene plain = stiff_truss(1e6, 0.6, 0.0);
  plain.loads.clear();
  plain.initial.points = {{3, {0.0, 2e-5, 0.0}, {0.0, 0.0, 0.0}}, {17, {1e-5, 0.0, -2e-5}, {0.0, 0.0, 0.0}}};
  for (const Scene& scene : {plain, soft_in_the_middle()})
    expect_honest(scene, {25.0, 50.0, 100.0, 400.0},
                  {Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled, Fidelity::kExactBars});
}

// 114 modes: a part costs as much as three of those of 64
TEST(Budget, LargeStructuresHaveFewerParts) {
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
  const auto parts_of = [](const Scene& of) {
    return lean_plan_of(scene_at(of, Fidelity::kSeparated, 100.0)).budget.shadows[0].substeps;
  };
  EXPECT_EQ(parts_of(half), 128) << "16384 / 100 a tick";
  EXPECT_EQ(parts_of(scene), 32) << "times (64 / 114)^2";
}

// vibrations beyond what parts of a tick resolve
TEST(Budget, NoEstimateOfATurningBodyIsGoodWhereNoPartResolvesWhatVibrates) {
  for (const double spin : {0.0, 3.0}) {
    const Scene scene = stiff_truss(1e11, spin, 1.0);
    const auto [verdict, cause] = verdict_of(scene_at(scene, Fidelity::kSpinLoaded, 50.0), 48);
    EXPECT_EQ(verdict.word, spin > 0.0 ? Verdict::Word::kWatch : Verdict::Word::kGood) << cause;
    if (spin > 0.0) {
      EXPECT_EQ(cause.find("integration: the reference solution of the error budget does not resolve"), 0U)
          << cause;
    }
  }
  // the turn counts, not the spin that is left
  Scene stopped = stiff_truss(1e11, 1.0, 0.0);
  stopped.loads.clear();
  stopped.initial.points.push_back({3, {0.0, 0.0, 1e-9}, {0.0, 0.0, 0.0}});
  Watched watched(scene_at(stopped, Fidelity::kSpinLoaded, 50.0));
  const double turning = watched.run(40).unresolved;
  watched.state.H_W = watched.state.H_W_low = {};
  EXPECT_GE(watched.run(1).unresolved, 0.5 * turning);
  EXPECT_GT(turning, 0.1);
}

// a plan that has no place for the initial state, or for a part of it, is measured against all of it
TEST(Budget, InitialStateThatIsLeftOutIsSeen) {
  Scene scene = watched_truss(Fidelity::kRigid, 10.0, 0.0);
  scene.loads.clear();
  scene.initial.points.push_back({18, {0.0, 0.0, 1e-6}, {0.0, 0.0, 0.0}});
  EXPECT_NEAR(Watched(scene).run(50).total.elastic, kCover, 1e-12);
  scene.error_budget.horizon = 0.0;
  scene.automatic = AutomaticRung{};
  scene.automatic->elastic = 0.05;
  scene.automatic->horizon = 0.1;
  EXPECT_GT(lean_plan_of(scene).fidelity, Fidelity::kRigid);
  scene.automatic.reset();
  scene.fidelity = Fidelity::kSeparated;
  scene.error_budget.horizon = 10.0;
  scene.pushable.clear();
  scene.leave_out.tolerance = 0.3;
  scene.leave_out.horizon = 0.1;
  Watched lean(scene);
  ASSERT_LT(lean.plan.num_elastic, 54);
  const BudgetReading cut = lean.run(50);
  std::printf("%d of 54 modes: truncation %.2f, estimate %.2f\n", lean.plan.num_elastic,
              cut.truncation.elastic, cut.total.elastic);
  EXPECT_GT(cut.truncation.elastic, 0.01);
  EXPECT_GT(cut.total.elastic, cut.truncation.elastic);
}

TEST(Budget, AnotherRateHasTheShadowsOfThatRate) {
  Scene scene = scene_at(stiff_truss(1e6, 3.0, 100.0), Fidelity::kSpinLoaded, 1000.0);
  Plan plan = lean_plan_of(scene);
  const std::int32_t parts = plan.budget.shadows[0].substeps;
  set_rate(plan, 50.0);
  scene.rate = 50.0;
  const Plan given = lean_plan_of(scene);
  ASSERT_EQ(plan.budget.shadows.size(), given.budget.shadows.size());
  for (std::size_t k = 0; k < given.budget.shadows.size(); ++k) {
    EXPECT_EQ(plan.budget.shadows[k].substeps, given.budget.shadows[k].substeps);
    EXPECT_EQ(plan.budget.shadows[k].plan.period, given.budget.shadows[k].plan.period);
  }
  EXPECT_GT(plan.budget.shadows[0].substeps, 8 * parts);
  // and such plans are read back
  std::string error;
  EXPECT_TRUE(plan_from_bytes(plan_to_bytes(given), error).has_value()) << error;
}

}  // namespace
}  // namespace freeflex::testing
