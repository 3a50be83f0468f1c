// These tests run set-ups of 3,000 points up to a plan. They also run under sanitizers.
#include <gtest/gtest.h>

#include "tests/setup/make_scene.hpp"
#include "tests/support/large_scenes.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

void keeps_thirty(Scene scene) {
  scene.publication = {};
  scene.publication.points = scene.pushable = {0, 1};
  scene.loads.clear();
  scene.modes.count = 30;
  Faults faults;
  const auto structure = build_structure(scene, faults);
  ASSERT_TRUE(structure) << (faults.empty() ? "" : faults.back().message);
  EXPECT_GE(structure->omega.size(), 30);
  EXPECT_LE(structure->omega.size(), 31);
  EXPECT_LT(structure->frequency_accuracy, 1e-6);
  const auto plan = make_plan(scene, *structure, faults);
  ASSERT_TRUE(plan) << (faults.empty() ? "" : faults.back().message);
  EXPECT_GT(plan->num_elastic, 0);
}

TEST(SparseLarge, SetsUpAMastOf3000Points) { keeps_thirty(square_truss(750)); }
TEST(SparseLarge, SetsUpAPlateOf3042Points) { keeps_thirty(two_layer_plate(39)); }

}  // namespace
}  // namespace freeflex::testing
