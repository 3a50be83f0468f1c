// The bytes of plans of the coupled rungs with the shadows of their verdicts.
#include "core/motion.hpp"
#include "core/plan/file/plan_bytes.hpp"
#include "core/plan/rungs/rates.hpp"
#include "core/step/readout.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/setup/plan_damage.hpp"
#include "tests/support/omissions.hpp"
#include "tests/support/simulation.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

/// Returns a plan of four points on the rung `full` with two substeps per tick, feedback, a sine and a
/// shadow.
Plan full_plan() {
  Scene scene;
  scene.name = "full";
  for (int i = 0; i < 4; ++i) add_point(scene, 1.0 + i, Eigen::Vector3d::Unit(i % 3) * (i < 3 ? 1.0 : 0.0));
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < i; ++j) add_link(scene, j, i, Spring{4e5});
  add_corner_pulse(scene);
  scene.feedbacks.push_back({"f",
                             1,
                             1,
                             -5.0 * Eigen::Matrix3d::Identity(),
                             -Eigen::Matrix3d::Identity(),
                             Eigen::Matrix3d::Zero(),
                             {}});
  publish_everything(scene);
  scene.fidelity = Fidelity::kFull;
  scene.rate = 1000.0;
  scene.verdict.horizon = 0.004;
  return reduced_plan_of(scene);
}

/// Runs a plan with its shadow through a command, a reset and the end of a horizon. Sanitizers report any
/// access out of bounds.
void exercise_with_shadow(const Plan& plan) {
  Motion motion(plan);
  ForceCommand command = make_command(0, 1, Axes::kBody, 5);
  add_force(command, 0, {0.1, 0.2, 0.3});
  for (int tick = 0; tick < 8; ++tick) {
    const bool pushes = tick == 2 && plan.points[0].row >= 0 && plan.points[0].pushable;
    motion.advance({&command, pushes ? 1U : 0U});
    read_invariants(plan, motion.state());
    if (tick == 5) motion.reset();
  }
}

TEST(RungPlan, RoundTripThroughBytesIsExact) {
  const Plan plan = full_plan();
  ASSERT_GT(plan.coupled.num_substeps, 1);
  ASSERT_EQ(plan.verdict.shadows.size(), 1U);
  const std::vector<std::byte> bytes = plan_to_bytes(plan);
  std::string error;
  const auto back = plan_from_bytes(bytes, error);
  ASSERT_TRUE(back.has_value()) << error;
  EXPECT_EQ(plan_to_bytes(*back), bytes);
  EXPECT_EQ(back->coupled.functions, plan.coupled.functions);
  EXPECT_EQ(back->coupled.num_substeps, plan.coupled.num_substeps);
  EXPECT_EQ(back->coupled.bars.size(), 6U);
  const PlanShadow &shadow = plan.verdict.shadows[0], &shadow_back = back->verdict.shadows[0];
  EXPECT_EQ(shadow_back.plan.coupled.num_substeps, shadow.plan.coupled.num_substeps);
  EXPECT_EQ(shadow_back.modes[0].numbers, shadow.modes[0].numbers);
  exercise_with_shadow(*back);
}

TEST(RungPlan, ContentThatDoesNotFitTheRungIsRefused) {
  const auto error_of = [](const auto& spoil) { return error_of_spoilt(full_plan(), spoil); };
  expect_named(error_of([](Plan& p) { p.coupled.num_substeps = 3; }), "not a power of two");
  expect_named(error_of([](Plan& p) { p.coupled.num_substeps = 1 << 20; }), "too large");
  expect_named(error_of([](Plan& p) { p.coupled.substep_phase = -1.0; }), "the phase of a substep");
  expect_named(error_of([](Plan& p) { p.coupled.functions.pop_back(); }), "functions of the modes");
  expect_named(error_of([](Plan& p) { p.coupled.bars[2].first = 4; }), "a bar is out of range");
  expect_named(error_of([](Plan& p) { p.coupled.bars[2].damping = -1.0; }), "a bar is out of range");
  expect_named(error_of([](Plan& p) { std::swap(p.coupled.bars[0], p.coupled.bars[1]); }), "out of order");
  expect_named(error_of([](Plan& p) { p.fidelity = Fidelity::kCoupled; }), "the phase of a substep");
  expect_named(error_of([](Plan& p) { p.fidelity = static_cast<Fidelity>(6); }), "an unknown kind");
  expect_named(error_of([](Plan& p) {
                 p.tried_rungs = {{static_cast<Fidelity>(6), 0.0, 0.0, 0.0, true, true}};
               }),
               "a rung that was tried");
  const auto error_of_shadow = [&](const auto& spoil) {
    return error_of([&](Plan& p) { spoil(p.verdict.shadows[0]); });
  };
  expect_named(error_of([](Plan& p) { p.verdict.horizon = -1.0; }), "out of range");
  expect_named(error_of([](Plan& p) { p.verdict.shadows.push_back(p.verdict.shadows[0]); }),
               "more than one shadow");
  expect_named(error_of_shadow([](PlanShadow& s) { s.ticks = 2; }), "the steps of the shadow");
  expect_named(error_of_shadow([](PlanShadow& s) { s.every = 0; }), "the steps of the shadow");
  expect_named(error_of_shadow([](PlanShadow& s) { s.delay_ticks = 0; }), "the steps of the shadow");
  expect_named(error_of_shadow([](PlanShadow& s) { s.plan.points.pop_back(); }), "shadow");
  expect_named(error_of_shadow([](PlanShadow& s) { s.plan.histories.pop_back(); }), "another structure");
  expect_named(error_of_shadow([](PlanShadow& s) { s.plan.fallback = {StepPlan(s.plan)}; }),
               "contains a further plan");
  expect_named(error_of_shadow([](PlanShadow& s) { s.modes[0].numbers.pop_back(); }),
               "not those of the plan");
  expect_named(error_of_shadow([](PlanShadow& s) { s.modes[0].numbers[0] = 99; }),
               "not a mode of the shadow");
}

TEST(RungPlan, DamagedContentWithAValidChecksumIsRefusedOrHarmless) {
  const DamageCount count = damage(full_plan(), 11, 2000, exercise_with_shadow);
  EXPECT_GT(count.num_refused, 500);
  EXPECT_GT(count.num_taken, 100);
}

TEST(RungPlan, AnotherRateHasItsOwnSubsteps) {
  Plan plan = full_plan();
  const std::int32_t num_substeps = plan.coupled.num_substeps;
  set_rate(plan, 500.0);
  EXPECT_EQ(plan.coupled.num_substeps, 2 * num_substeps);
  const PlanShadow& shadow = plan.verdict.shadows[0];
  EXPECT_EQ(shadow.plan.period * shadow.substeps, shadow.ticks * plan.period);
  EXPECT_EQ(find_inconsistency(plan), "");
  exercise_with_shadow(plan);
}

/// Returns the plan of two bodies on a beam, one of them in a group, on the rung `coupled`.
Plan body_plan() {
  Scene scene;
  scene.name = "bodies";
  for (const double x : {0.0, 1.0}) {
    add_point(scene, 2.0, {x, 0.0, 0.0});
    scene.points.back().inertia = Eigen::Vector3d(0.1, 0.2, 0.25).asDiagonal();
  }
  add_link(scene, 0, 1, Beam{1e4, 100.0, 200.0, 300.0, {0.0, 1.0, 0.0}});
  Group group;
  group.name = "first";
  group.points = {0};
  scene.groups.push_back(group);
  publish_everything(scene);
  scene.fidelity = Fidelity::kCoupled;
  scene.initial.angular_velocity = {0.1, 0.2, 0.3};
  return reduced_plan_of(scene);
}

TEST(RungPlan, TheRoundTripOfAPlanWithBodiesIsExact) {
  const Plan plan = body_plan();
  ASSERT_EQ(plan.coupled.kinetics.form, PlanKinetics::Form::kTables);
  const std::vector<std::byte> bytes = plan_to_bytes(plan);
  std::string error;
  const auto back = plan_from_bytes(bytes, error);
  ASSERT_TRUE(back.has_value()) << error;
  EXPECT_EQ(plan_to_bytes(*back), bytes);
  EXPECT_EQ(back->coupled.kinetics.tables, plan.coupled.kinetics.tables);
  exercise_with_shadow(*back);
}

TEST(RungPlan, ContentThatDoesNotFitAPlanWithBodiesIsRefused) {
  using Form = PlanKinetics::Form;
  const auto error_of = [](const auto& spoil) { return error_of_spoilt(body_plan(), spoil); };
  expect_named(error_of([](Plan& p) { p.coupled.kinetics.form = static_cast<Form>(5); }), "an unknown form");
  expect_named(error_of([](Plan& p) { p.coupled.kinetics.form = Form::kPoints; }), "no tables for them");
  expect_named(error_of([](Plan& p) { p.coupled.kinetics.num_tables = 10; }), "number of tables");
  expect_named(error_of([](Plan& p) { p.coupled.kinetics.tables.pop_back(); }), "sums over pairs of modes");
  expect_named(error_of([](Plan& p) { p.coupled.kinetics.moments.front() = 1.0 / 0.0; }),
               "sums over pairs of modes");
  expect_named(error_of([](Plan& p) { p.fidelity = Fidelity::kCorotational; }), "links at true geometry");
  const Plan full = full_plan();
  expect_named(error_of_spoilt(full, [](Plan& p) { p.coupled.kinetics.num_tables = 9; }), "number of tables");
}

TEST(RungPlan, DamageInAPlanWithBodiesIsRefusedOrHarmless) {
  const DamageCount count = damage(body_plan(), 12, 2000, exercise_with_shadow);
  EXPECT_GT(count.num_refused, 500);
  EXPECT_GT(count.num_taken, 100);
}

}  // namespace
}  // namespace freeflex::testing
