// The error estimate meets the error on random scenes, and the rung that `fidelity: auto` chooses meets the
// tolerance.
#include "core/plan/rungs/automatic.hpp"
#include "core/structure/structure.hpp"
#include "tests/tools/estimates_cases.hpp"

namespace freeflex::testing {
namespace {

TEST(Estimates, MeetTheErrorOnAFewRandomScenes) {
  const auto rows = tools::study_estimates(3, 15, [](double) { return true; });
  const auto sum = print(rows);
  ASSERT_EQ(sum.num_scenes, 15);
  // one of 15 scenes may fail even if 95 of 100 estimates meet the error
  EXPECT_GE(sum.close_attitude, 0.9);
  EXPECT_GE(sum.close_elastic, 0.9);
  EXPECT_GE(sum.auto_meets, 0.9);
}

TEST(Estimates, RandomScenesDependOnlyOnSeedAndNumber) {
  for (int k = 0; k < 6; ++k) {
    const Scene a = tools::random_scene(5, k), b = tools::random_scene(5, k), c = tools::random_scene(6, k);
    ASSERT_EQ(a.points.size(), b.points.size());
    EXPECT_EQ(a.points[1].mass, b.points[1].mass);
    EXPECT_EQ(a.loads[0].forces[0].force, b.loads[0].forces[0].force);
    EXPECT_NE(a.loads[0].forces[0].force, c.loads[0].forces[0].force);
  }
}

// On modes at 1 kHz, the error of `corotational` is above the tolerance of this scene, and auto would find no
// rung. In points it is below.
TEST(Estimates, AutoTriesARungInPointsWhereItWillRunInPoints) {
  Scene scene = tools::random_scene(2, 194);
  scene.automatic = AutomaticRung{};
  scene.automatic->elastic = 1.1e-4;
  scene.automatic->horizon = 1.0;
  Faults faults;
  const auto structure = build_structure(scene, faults);
  ASSERT_TRUE(structure);
  std::vector<PlanRung> tried;
  EXPECT_EQ(choose_rung(scene, *structure, tried, faults), Fidelity::kCorotational);
}

}  // namespace
}  // namespace freeflex::testing
