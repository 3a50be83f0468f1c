// The bytes of plans that omit features and contain a fallback plan.
#include "core/plan/file/plan_bytes.hpp"
#include "core/plan/rungs/rates.hpp"
#include "core/step/scope.hpp"
#include "tests/setup/plan_damage.hpp"
#include "tests/support/omissions.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

/// Returns a plan of five points in a plane that allows replanning, with a group and a load.
Plan fallback_plan() {
  Scene scene = square_truss(2);
  scene.points.resize(5);
  scene.links.clear();
  for (int i = 0; i < 5; ++i) {
    scene.points[static_cast<std::size_t>(i)].position = {static_cast<double>(i), 0.4 * (i % 2), 0.0};
    if (i == 0) continue;
    Link link;
    link.name = std::to_string(i);
    link.points = {i - 1, i};
    link.kind = Beam{.EA = 1e5, .GJ = 30.0, .EI_y = 40.0, .EI_z = 50.0, .y_axis = Eigen::Vector3d::UnitZ()};
    scene.links.push_back(link);
  }
  publish_everything(scene);
  scene.publication.links = {0};
  scene.groups = {{"end", {3, 4}, {}}};
  Load load;
  load.name = "push";
  load.axes = Axes::kBody;
  load.forces = {{4, {1.0, 2.0, 0.0}}};
  load.history = PulseHistory{0.0, 0.01};
  scene.loads = {load};
  scene.leave_out.on_need = OnNeed::kReplan;
  return reduced_plan_of(scene);
}

/// Steps a plan for six ticks, with a command at tick 2 if the plan accepts it, and resets the state at tick
/// 4. Sanitizers report any access out of bounds.
void exercise_with_command(const Plan& plan) {
  State state = make_state(plan);
  Workspace workspace = make_workspace(plan);
  StepReport report;
  ForceCommand command = make_command(0, 1, Axes::kBody, 5);
  add_force(command, 0, {0.1, 0.2, 0.3});
  const auto read = [&] {
    for (const std::int32_t point : plan.published_points) read_point(plan, state, point);
    for (const std::int32_t group : plan.published_groups) read_group(plan, state, group);
    std::array<double, 12> forces{};
    for (std::size_t k = 0; k < plan.link_outputs.size(); ++k)
      if (plan.link_outputs[k].num_rows <= 12)
        read_link(plan, state, static_cast<int>(k),
                  std::span(forces).first(static_cast<std::size_t>(plan.link_outputs[k].num_rows)));
    read_invariants(plan, state);
  };
  for (int tick = 0; tick < 6; ++tick) {
    const bool pushes = tick == 2 && plan.points[0].row >= 0 && plan.points[0].pushable;
    step(plan, state, {{&command, pushes ? 1U : 0U}}, workspace, report);
    read();
    if (tick == 4) reset_state(plan, state);
  }
}

TEST(FallbackPlan, RoundTripThroughBytesIsExact) {
  const Plan plan = fallback_plan();
  ASSERT_EQ(plan.fallback.size(), 1U);
  const std::vector<std::byte> bytes = plan_to_bytes(plan);
  std::string error;
  const auto back = plan_from_bytes(bytes, error);
  ASSERT_TRUE(back.has_value()) << error;
  EXPECT_EQ(plan_to_bytes(*back), bytes);
  EXPECT_EQ(back->fallback_modes, plan.fallback_modes);
  EXPECT_EQ(back->fallback.front().omega, plan.fallback.front().omega);
  EXPECT_EQ(back->features.size(), static_cast<std::size_t>(kNumFeatures));
  EXPECT_EQ(back->features[3].why, plan.features[3].why);
  exercise_with_command(*back);
}

TEST(FallbackPlan, AFallbackPlanThatDoesNotFitTheReducedPlanIsRefused) {
  const auto error_of = [](const auto& spoil) { return error_of_spoilt(fallback_plan(), spoil); };
  expect_named(error_of([](Plan& p) { p.fallback.push_back(p.fallback.front()); }),
               "more than one fallback plan");
  expect_named(error_of([](Plan& p) { p.fallback.front().fallback.push_back(p.fallback.front()); }),
               "contains a further plan");
  expect_named(error_of([](Plan& p) { p.fallback_modes.back() = p.fallback.front().num_elastic; }),
               "mode indices");
  expect_named(error_of([](Plan& p) { p.fallback_modes.pop_back(); }), "mode indices");
  expect_named(error_of([](Plan& p) { p.fallback.front().period *= 2.0; }), "another structure");
  expect_named(error_of([](Plan& p) { p.fallback.front().points[1].r[0] += 1.0; }), "another structure");
  expect_named(error_of([](Plan& p) { p.fallback.front().omega[0] = -1.0; }),
               "in its fallback plan a frequency is negative");
  expect_named(error_of([](Plan& p) { p.fallback.clear(); }), "no fallback plan");
  expect_named(error_of([](Plan& p) { p.propagator.undamped.pop_back(); }), "one value for each mode");
}

TEST(FallbackPlan, DamagedContentWithAValidChecksumIsRefusedOrHarmless) {
  const DamageCount count = damage(fallback_plan(), 7, 4000, exercise_with_command);
  EXPECT_GT(count.num_refused, 1000);
  EXPECT_GT(count.num_taken, 100);
}

TEST(FallbackPlan, AnotherRateAppliesToBothPlans) {
  Plan plan = fallback_plan();
  set_rate(plan, 500.0);
  EXPECT_EQ(plan.fallback.front().period, plan.period);
  EXPECT_EQ(find_inconsistency(plan), "");
  exercise_with_command(plan);
}

}  // namespace
}  // namespace freeflex::testing
