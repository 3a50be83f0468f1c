// The error estimate covers the error on random scenes, and the rung that `fidelity: auto` chooses meets the
// tolerance.
#include "tests/tools/estimates_cases.hpp"

namespace freeflex::testing {
namespace {

TEST(Estimates, CoverTheErrorOnAFewRandomScenes) {
  const auto rows = tools::study_estimates(3, 15, [](double) { return true; });
  const auto sum = print(rows);
  ASSERT_EQ(sum.num_scenes, 15);
  // one of 15 scenes may fail even if the estimate covers the error in 95 of 100 scenes
  EXPECT_GE(sum.inside_position, 0.9);
  EXPECT_GE(sum.inside_elastic, 0.9);
  EXPECT_GE(sum.close_position, 0.8);
  EXPECT_GE(sum.close_elastic, 0.8);
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

}  // namespace
}  // namespace freeflex::testing
