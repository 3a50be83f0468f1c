// A scene beyond the limits is refused in bounded time and memory.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "service/io/scene/input.hpp"
#include "tests/scene/temporary_folder.hpp"

namespace freeflex::testing {
namespace {

class Limits : public ::testing::Test {
 protected:
  std::vector<std::string> read(const std::string& path) {
    const io::SceneResult result = io::read_scene(path);
    EXPECT_FALSE(result.scene.has_value());
    std::vector<std::string> messages;
    for (const Fault& fault : result.faults)
      messages.push_back(io::format_fault(fault, result.sources, false));
    return messages;
  }
  std::vector<std::string> read_text(const std::string& text) {
    folder_.write("scene.yaml", text);
    return read("scene.yaml");
  }
  using Messages = std::vector<std::string>;
  TemporaryFolder folder_;
};

TEST_F(Limits, AMissingSceneFileIsReported) {
  EXPECT_EQ(read("boom.yaml"),
            Messages{"boom.yaml: error: cannot read 'boom.yaml': No such file or directory"});
  EXPECT_EQ(read(""), Messages{"error: cannot read '': the file name is empty"});
}

TEST_F(Limits, FoldersAndPipesAreRefusedWithoutWaiting) {
  EXPECT_EQ(read("."), Messages{".: error: cannot read '.': it is a directory"});
  ASSERT_EQ(::mkfifo("pipe.yaml", 0600), 0);
  EXPECT_EQ(read("pipe.yaml"),
            Messages{"pipe.yaml: error: cannot read 'pipe.yaml': it is not a regular file"});
}

TEST_F(Limits, AFileThatIsTooLargeIsNotRead) {
  folder_.write("scene.yaml", "");
  std::filesystem::resize_file("scene.yaml", 268435457);  // sparse
  EXPECT_EQ(read("scene.yaml"), Messages{"scene.yaml: error: cannot read 'scene.yaml': it has 268435457 "
                                         "bytes, but at most 268435456 are read"});
}

TEST_F(Limits, TooManyPointsAreRefused) {
  std::string csv = "mass,x,y,z\n";
  for (int i = 0; i < 263000; ++i) csv += "1," + std::to_string(i) + ",0,0\n";
  folder_.write("points.csv", csv);
  EXPECT_EQ(read_text("points: {csv: points.csv}\n"),
            Messages{"points.csv:200002:1: error: this is point 200001 of 262145 or more, but at most 200000 "
                     "are allowed; merge points, or remove some"});
}

// one reading reports both faults, so that no second fault appears after the first is corrected
TEST_F(Limits, TooManyPointsAreReportedTogetherWithOtherFaults) {
  std::string csv = "mass,x,y,z\n-1,0,0,0\n";
  for (int i = 1; i < 200100; ++i) csv += "1," + std::to_string(i) + ",0,0\n";
  folder_.write("points.csv", csv);
  EXPECT_EQ(read_text("points: {csv: points.csv}\n"),
            (Messages{"points.csv:2:1: error: point in row 1: mass is -1 kg, but must be >= 0",
                      "points.csv:200002:1: error: this is point 200001 of 200100, but at most 200000 are "
                      "allowed; merge points, or remove some"}));
}

TEST_F(Limits, TooManyGroupsAreRefused) {
  std::string text = "points: {name: a, mass: 1, at: [0, 0, 0]}\ngroups:\n";
  for (int i = 0; i < 1100; ++i) text += "  g" + std::to_string(i) + ": a\n";
  EXPECT_EQ(
      read_text(text),
      Messages{
          "scene.yaml:1027:3: error: there are more than 1024 groups, so the rest is not read; remove some"});
}

TEST_F(Limits, TooManyFeedbacksAreRefused) {
  std::string text = "points: {name: a, mass: 1, at: [0, 0, 0]}\nfeedback:\n";
  for (int i = 0; i < 300; ++i) text += "  - {at: a, velocity: 1}\n";
  EXPECT_EQ(read_text(text), Messages{"scene.yaml:259:5: error: there are more than 256 feedbacks, so the "
                                      "rest is not read; remove some"});
}

TEST_F(Limits, NestedAliasesAreNotExpanded) {
  std::string text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 30; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    text += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + before;
    for (int k = 0; k < 9; ++k) text += ", " + before;
    text += "]\n";
  }
  const Messages messages = read_text(text + "points: *a29\n");  // 1e30 words
  ASSERT_EQ(messages.size(), 31u);  // the faults are 30 unknown keys and one point that is a list
  EXPECT_EQ(messages[29],
            "scene.yaml:29:11: error: point 1 is a list, but must be a mapping of name, mass, at, inertia, "
            "offset, axes");
}

TEST_F(Limits, MergedMappingsCountTowardsTheLimitOfValues) {
  std::string text = "base: &base {";
  for (int i = 0; i < 2000; ++i) text += (i ? ", k" : "k") + std::to_string(i) + ": 1";
  text += "}\nmany:\n";
  for (int i = 0; i < 1000; ++i) text += "  - {<<: *base}\n";
  EXPECT_EQ(read_text(text),
            Messages{"scene.yaml:500:15: error: the scene has more than 1000000 values; put points and links "
                     "into CSV files, and matrices into Matrix Market files"});
}

TEST_F(Limits, ListsOfTooManyItemsAreRefused) {
  std::string csv = "mass,x,y,z\n";
  for (int i = 0; i < 8192; ++i) csv += "1," + std::to_string(i) + ",0,0\n";
  folder_.write("points.csv", csv);
  std::string text = "points: {csv: points.csv}\nlinks:\n";
  for (int i = 0; i < 140; ++i) text += "  - {spring: [1..8192], stiffness: 1}\n";
  EXPECT_EQ(read_text(text), Messages{"scene.yaml:131:5: error: there are more than 1048576 links, so the "
                                      "rest is not read; remove some"});
  text = "points: {csv: points.csv}\nlinks:\n";
  for (int i = 0; i < 1100; ++i) text += "  - {rigid: all}\n";
  EXPECT_EQ(read_text(text), Messages{"scene.yaml:1026:13: error: the scene's lists name more than 8388608 "
                                      "items, so it is not read further; shorten the lists"});
  text = "points: {csv: points.csv}\ngroups:\n";
  for (int i = 0; i < 1024; ++i) text += "  g" + std::to_string(i) + ": all\n";
  EXPECT_EQ(read_text(text + "loads: [{forces: {'1': [0, 0, 1]}}]\n").size(), 1u);
}

// up to 1000 points, everything is published and pushable by default. Above 1000 points, only the points that
// the scene lists are published or pushable; `all` lists every point
TEST_F(Limits, AboveAThousandPointsOnlyListedPointsArePublishedOrPushable) {
  constexpr int kPoints = 1100;
  std::string csv = "mass,x,y,z\n", springs = "from,to,stiffness\n";
  for (int i = 1; i <= kPoints; ++i) {
    csv += "1," + std::to_string(i) + ",0,0\n";
    if (i > 1) springs += std::to_string(i - 1) + "," + std::to_string(i) + ",1\n";
  }
  folder_.write("points.csv", csv);
  folder_.write("springs.csv", springs);
  const auto read_with = [&](const std::string& more) {
    folder_.write("scene.yaml", "points: {csv: points.csv}\nlinks: {csv: springs.csv}\n" + more);
    return io::read_scene("scene.yaml");
  };
  const io::SceneResult none = read_with("");
  ASSERT_TRUE(none.scene);
  EXPECT_TRUE(none.scene->publication.points.empty());
  EXPECT_TRUE(none.scene->publication.links.empty());
  EXPECT_TRUE(none.scene->pushable.empty());
  ASSERT_EQ(none.faults.size(), 1u);
  EXPECT_EQ(
      io::format_fault(none.faults[0], none.sources, false),
      "points.csv:2:1: warning: none of the 1100 points is published, because in a scene of more than 1000 "
      "points, only points and links that the scene names are published, can be pushed and are listed on the "
      "bus; name them in 'publish: points: of', 'publish: loads: of' and 'commands: points', or in groups");
  const io::SceneResult all = read_with("publish: {points: {of: all}, loads: {of: all}}\n");
  ASSERT_TRUE(all.scene);
  EXPECT_EQ(all.scene->publication.points.size(), 1100u);
  EXPECT_EQ(all.scene->publication.links.size(), 1099u);
  EXPECT_TRUE(all.scene->pushable.empty());
  const io::SceneResult some = read_with("publish: {points: {of: ['1100']}}\ncommands: {points: ['1099']}\n");
  ASSERT_TRUE(some.scene);
  EXPECT_TRUE(some.faults.empty());
  EXPECT_EQ(some.scene->publication.points, std::vector<int>{1099});
  EXPECT_EQ(some.scene->pushable, std::vector<int>{1098});
}

// 3 x 1236 - 6 = 3702 constraints are too many for the dense decomposition
TEST_F(Limits, RigidBodiesOfTooManyPointsAreRefused) {
  std::string csv = "mass,x,y,z\n";
  for (int i = 0; i < 1236; ++i) csv += "1," + std::to_string(i) + "," + std::to_string(i % 7) + ",0\n";
  folder_.write("points.csv", csv);
  folder_.write("scene.yaml", "points: {csv: points.csv}\nlinks: {rigid: all}\n");
  const io::PlanResult result = io::load_plan("scene.yaml");
  EXPECT_FALSE(result.plan);
  // the first fault is the warning that no point is published
  ASSERT_EQ(result.faults.size(), 2u);
  EXPECT_NE(io::format_fault(result.faults[1], result.sources, false)
                .find("impose 3702 constraints together, but at most 1500 can be handled"),
            std::string::npos)
      << io::format_fault(result.faults[1], result.sources, false);
}

TEST_F(Limits, AtMostAThousandFaultsAreListed) {
  std::string csv = "mass,x,y,z\n";
  for (int i = 0; i < 5000; ++i) csv += "-1,0,0,0\n";
  folder_.write("points.csv", csv);
  const Messages messages = read_text("points: {csv: points.csv}\n");
  ASSERT_EQ(messages.size(), 1001u);
  EXPECT_EQ(messages[999], "points.csv:1001:1: error: point in row 1000: mass is -1 kg, but must be >= 0");
  EXPECT_EQ(messages[1000], "scene.yaml: error: there are more than 1000 faults; the rest is not listed");
}

TEST_F(Limits, AMatrixThatDeclaresTooManyEntriesIsRefusedAtItsSizeLine) {
  folder_.write("points.csv", [] {
    std::string csv = "mass,x,y,z\n";
    for (int i = 0; i < 8192; ++i) csv += "1,0,0,0\n";
    return csv;
  }());
  folder_.write("K.mtx", "%%MatrixMarket matrix array real general\n24576 24576\n");
  EXPECT_EQ(read_text("points: {csv: points.csv}\nlinks: {matrix: K.mtx, points: all}\n"),
            Messages{"K.mtx:2:1: error: the matrix has 603979776 entries, but at most 16777216 are read"});
}

}  // namespace
}  // namespace freeflex::testing
