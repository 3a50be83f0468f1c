// The trusses in the shipped scene files are the trusses of the published figures.
#include <gtest/gtest.h>

#include "service/io/scene/input.hpp"
#include "tests/support/structures.hpp"

namespace freeflex {
namespace {

/// Compares points, springs, push and spin of a shipped scene file with those of the scene `built`. Returns
/// the scene of the file.
Scene expect_equal(const std::string& name, const Scene& built) {
  const io::SceneResult result = io::read_scene(FREEFLEX_SOURCE_DIR "/service/scenes/" + name + ".yaml");
  for (const Fault& fault : result.faults) ADD_FAILURE() << io::format_fault(fault, result.sources);
  if (!result.scene) return {};
  const Scene& file = *result.scene;
  EXPECT_EQ(file.name, name);
  EXPECT_EQ(file.points.size(), built.points.size());
  EXPECT_EQ(file.links.size(), built.links.size());
  if (file.points.size() != built.points.size() || file.links.size() != built.links.size()) return file;
  for (std::size_t i = 0; i < built.points.size(); ++i) {
    EXPECT_EQ(file.points[i].position, built.points[i].position) << i;
    EXPECT_EQ(file.points[i].mass, built.points[i].mass) << i;
  }
  for (std::size_t i = 0; i < built.links.size(); ++i) {
    EXPECT_EQ(file.links[i].points, built.links[i].points) << i;
    EXPECT_EQ(std::get<Spring>(file.links[i].kind).stiffness, std::get<Spring>(built.links[i].kind).stiffness)
        << i;
  }
  EXPECT_EQ(file.initial.angular_velocity, built.initial.angular_velocity);
  EXPECT_EQ(file.loads.size(), 1U);
  if (file.loads.size() != 1 || file.loads[0].forces.size() != 1) return file;
  EXPECT_EQ(file.loads[0].axes, Axes::kWorld);
  EXPECT_EQ(file.loads[0].forces[0].point, built.loads[0].forces[0].point);
  EXPECT_EQ(file.loads[0].forces[0].force, built.loads[0].forces[0].force);
  const auto& pulse = std::get<PulseHistory>(file.loads[0].history);
  EXPECT_EQ(pulse.start, 0.0);
  EXPECT_EQ(pulse.duration, 0.1);
  return file;
}

TEST(SceneFile, TheSceneTruss104IsTheTrussS2) { expect_equal("truss104", testing::truss_s2()); }

TEST(SceneFile, TheTrussesOfTheReportAreS1ToS5WithoutDamping) {
  using Build = Scene (*)();
  constexpr Build kBuild[] = {testing::truss_s1, testing::truss_s2, testing::truss_s3, testing::truss_s4,
                              [] { return testing::truss_s5(); }};
  for (int k = 0; k < 5; ++k) {
    const Scene file = expect_equal("truss-s" + std::to_string(k + 1), kBuild[k]());
    EXPECT_EQ(file.damping.modal_ratio, 0.0);
    EXPECT_TRUE(file.gravity.isZero(0.0));
  }
}

}  // namespace
}  // namespace freeflex
