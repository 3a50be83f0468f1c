// The truss that ships as a scene file is the truss that the figures refer to.
#include <gtest/gtest.h>

#include "service/io/input.hpp"
#include "tests/support/structures.hpp"

namespace freeflex {
namespace {

TEST(SceneFile, Truss104IsTheTrussS2) {
  const io::SceneResult result = io::read_scene(FREEFLEX_SOURCE_DIR "/service/scenes/truss104.yaml");
  ASSERT_TRUE(result.scene.has_value());
  const Scene& file = *result.scene;
  const Scene built = testing::truss_s2();
  ASSERT_EQ(file.points.size(), built.points.size());
  for (std::size_t i = 0; i < built.points.size(); ++i) {
    EXPECT_EQ(file.points[i].position, built.points[i].position) << i;
    EXPECT_EQ(file.points[i].mass, built.points[i].mass) << i;
  }
  ASSERT_EQ(file.links.size(), built.links.size());
  for (std::size_t i = 0; i < built.links.size(); ++i) {
    EXPECT_EQ(file.links[i].points, built.links[i].points) << i;
    EXPECT_EQ(std::get<Spring>(file.links[i].kind).stiffness, std::get<Spring>(built.links[i].kind).stiffness)
        << i;
  }
  ASSERT_EQ(file.loads.size(), 1U);
  ASSERT_EQ(file.loads[0].forces.size(), 1U);
  EXPECT_EQ(file.loads[0].axes, Axes::kWorld);
  EXPECT_EQ(file.loads[0].forces[0].point, built.loads[0].forces[0].point);
  EXPECT_EQ(file.loads[0].forces[0].force, built.loads[0].forces[0].force);
  const auto& pulse = std::get<PulseHistory>(file.loads[0].history);
  EXPECT_EQ(pulse.start, 0.0);
  EXPECT_EQ(pulse.duration, 0.1);
}

}  // namespace
}  // namespace freeflex
