// Scenes that consist of another scene and values that are set in it.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "service/io/scene/input.hpp"
#include "tests/scene/good_scene.hpp"

namespace freeflex::testing {
namespace {

io::SceneResult read_over(const std::string& changed, const io::Settings& settings = {}) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "beside");
  folder.write("beside/pair.yaml", kTwoPoints + "name: pair\n");
  folder.write("beside/middle.yaml", "base: pair.yaml\nset: {points.a.mass: 3, points.b.mass: 4}\n");
  folder.write("changed.yaml", changed);
  return io::read_scene("changed.yaml", settings);
}

std::vector<double> masses(const io::SceneResult& result) {
  for (const Fault& fault : result.faults) ADD_FAILURE() << io::format_fault(fault, result.sources);
  std::vector<double> values;
  if (result.scene)
    for (const PointMass& point : result.scene->points) values.push_back(point.mass);
  return values;
}

std::string first_fault(const io::SceneResult& result) {
  return result.faults.empty() ? "" : io::format_fault(result.faults.front(), result.sources, false);
}

TEST(Base, IsTheSceneInWhichValuesAreSet) {
  EXPECT_EQ(masses(read_over("base: beside/pair.yaml")), (std::vector<double>{1, 1}));
  EXPECT_EQ(masses(read_over("{base: beside/pair.yaml, set: {points.b.mass: 5, points.*.mass*: 2}}")),
            (std::vector<double>{2, 10}));
  EXPECT_EQ(masses(read_over("base: beside/pair.yaml\nset:\n  - points.b.mass: 5\n  - points.b.mass: 6\n")),
            (std::vector<double>{1, 6}))
      << "a list may set one path twice";
}

TEST(Base, MayHaveABaseOfItsOwn) {
  EXPECT_EQ(masses(read_over("base: beside/middle.yaml")), (std::vector<double>{3, 4}));
  EXPECT_EQ(masses(read_over("{base: beside/middle.yaml, set: {points.b.mass: 7}}",
                             {{"points.a.mass", "9", "--set points.a.mass=9"}})),
            (std::vector<double>{9, 7}))
      << "values of the command line are set last, those of the innermost base first";
}

TEST(Base, GivesTheNameUnlessTheSceneHasOne) {
  EXPECT_EQ(read_over("base: beside/pair.yaml").scene.value().name, "pair");
  EXPECT_EQ(read_over("{name: heavy, base: beside/pair.yaml}").scene.value().name, "heavy");
}

TEST(Base, ValuesMayBeTextsListsAndMappings) {
  const io::SceneResult result = read_over(
      "base: beside/pair.yaml\n"
      "set: {points.b.at: [2, 0, 0.5], damping: {ratio: 0.1}, fidelity: coupled}\n");
  ASSERT_TRUE(result.scene.has_value()) << first_fault(result);
  EXPECT_EQ(result.scene->points[1].position, Eigen::Vector3d(2, 0, 0.5));
  EXPECT_EQ(result.scene->damping.modal_ratio, 0.1);
  EXPECT_EQ(result.scene->fidelity, Fidelity::kCoupled);
}

TEST(Base, FaultsSayWhereAndWhat) {
  EXPECT_EQ(first_fault(read_over("base: none.yaml")),
            "changed.yaml:1:7: error: cannot read 'none.yaml': No such file or directory");
  EXPECT_EQ(first_fault(read_over("{base: beside/pair.yaml, set: {points.b.mass: -1}}")),
            "changed.yaml: points.b.mass=-1: error: point 'b': mass is -1 kg, but must be >= 0");
  EXPECT_EQ(
      first_fault(read_over("{base: beside/pair.yaml, set: 5}")),
      "changed.yaml:1:31: error: scene: set is the text '5', but must be a mapping of paths to values, as in "
      "{points.hub.mass: 41}, or a list of such mappings");
  EXPECT_EQ(first_fault(read_over("{base: beside/pair.yaml, points: []}")),
            "changed.yaml:1:26: error: scene: the key 'points' is unknown; allowed are name, base, set");
  EXPECT_EQ(first_fault(read_over("base: changed.yaml")),
            "changed.yaml:1:1: error: a scene may have at most 8 bases, each the base of the next; does a "
            "base name "
            "itself?");
}

}  // namespace
}  // namespace freeflex::testing
