// The keys of a scene are read as written. Tests in other files cover bodies, the kinds of links, motion and
// leave_out.
#include <gtest/gtest.h>

#include "tests/scene/good_scene.hpp"

namespace freeflex::testing {
namespace {

// a scene whose values are distinct, so that the tests below can compare them
const std::string kEveryKey = R"(
name: everything
rate: 500
points:
  - {name: hub, mass: 10, at: [0.5, -1.5, 2e-1]}
  - {mass: .25, at: [1, 0, 0]}
  - {name: tip, mass: +3., at: [2, 0, 0]}
  - {name: end, mass: 4, at: [2, 1, 0]}
links:
  - {name: l1, spring: [hub, tip], stiffness: 1e5}
  - {bar: [hub, end], EA: 2e7}
  - {name: tube, beam: [hub..tip, hub], EA: 11, GJ: 12, EIy: 13, EIz: 14, y_axis: [0, 3, 1]}
groups: {panel: [tip, end], everything: all}
damping: {ratio: 0.01, modes: {7: 0.02, 2: 0.03}, rayleigh: {alpha: 0.5, beta: 1e-6}}
gravity: [0, 0, -9.81]
initial:
  position: [1, 2, 3]
  attitude: [0.5, -0.5, 0.5, -0.5]
  velocity: [4, 5, 6]
  angular_velocity: [7, 8, 9]
  points: {tip: {displacement: [0.1, 0.2, 0.3], velocity: [0.4, 0.5, 0.6]}}
  modes: {3: {q: 0.7, q_dot: 0.8}}
loads:
  - {name: kick, axes: body, forces: {tip: [1, 2, 3]}, pulse: {start: 0.5, duration: 0.1}}
  - {wrenches: {panel: {force: [4, 5, 6], torque: [7, 8, 9]}}, sine: {frequency: 2, phase: 0.25}}
  - {forces: {hub: [1, 0, 0], end: [-1, 0, 0]}, table: {times: [0, 1, 3], values: [0, 2, -1]}}
  - {forces: {hub: [0, 1, 0]}}
publish:
  state: 100
  points: {rate: 25, of: [tip, hub]}
  loads: {rate: 0, of: [tube.2, l1]}
  groups: [everything]
  status: 5
commands: {points: [tip, '2'], force_limit: 1000, torque_limit: 100, max_age: 0.2,
  sender_share: 0.5, max_hold: 5}
)";

TEST(ReadScene, PointsAndLinksAreReadAsWritten) {
  const Scene scene = read_good(kEveryKey);
  EXPECT_EQ(scene.name, "everything");
  EXPECT_EQ(scene.rate, 500.0);
  ASSERT_EQ(scene.points.size(), 4u);
  EXPECT_EQ(scene.points[0].position, Eigen::Vector3d(0.5, -1.5, 0.2));
  EXPECT_EQ(scene.points[1].name, "2") << "the name of a point without a name is its number";
  EXPECT_EQ(scene.points[1].mass, 0.25);
  EXPECT_EQ(scene.points[2].mass, 3.0);
  EXPECT_EQ(scene.points[2].origin.line, 7);
  EXPECT_EQ(scene.points[2].origin.column, 5);
  ASSERT_EQ(scene.links.size(), 5u);
  EXPECT_EQ(std::get<Spring>(scene.links[0].kind).stiffness, 1e5);
  EXPECT_EQ(scene.links[0].points, (std::vector<int>{0, 2}));
  EXPECT_EQ(scene.links[1].name, "2");
  EXPECT_EQ(std::get<Bar>(scene.links[1].kind).EA, 2e7);
}

TEST(ReadScene, AChainJoinsEachPointToTheNext) {
  const Scene scene = read_good(kEveryKey);
  ASSERT_EQ(scene.links.size(), 5u);
  const std::vector<std::vector<int>> ends{{0, 1}, {1, 2}, {2, 0}};
  for (std::size_t i = 0; i < 3; ++i) {
    const Link& link = scene.links[2 + i];
    EXPECT_EQ(link.name, "tube." + std::to_string(i + 1));
    EXPECT_EQ(link.points, ends[i]);
    const Beam& beam = std::get<Beam>(link.kind);
    EXPECT_EQ(std::vector<double>({beam.EA, beam.GJ, beam.EI_y, beam.EI_z}),
              std::vector<double>({11, 12, 13, 14}));
    EXPECT_EQ(beam.y_axis, Eigen::Vector3d(0, 3, 1));
  }
}

TEST(ReadScene, DampingGravityAndInitialStateAreReadAsWritten) {
  const Scene scene = read_good(kEveryKey);
  EXPECT_EQ(scene.damping.modal_ratio, 0.01);
  EXPECT_EQ(scene.damping.mode_ratios, (std::vector<std::pair<int, double>>{{7, 0.02}, {2, 0.03}}));
  EXPECT_EQ(scene.damping.alpha, 0.5);
  EXPECT_EQ(scene.damping.beta, 1e-6);
  EXPECT_EQ(scene.gravity, Eigen::Vector3d(0, 0, -9.81));
  const Initial& initial = scene.initial;
  EXPECT_EQ(initial.position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(initial.attitude, Eigen::Vector4d(0.5, -0.5, 0.5, -0.5));
  EXPECT_EQ(initial.velocity, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(initial.angular_velocity, Eigen::Vector3d(7, 8, 9));
  ASSERT_EQ(initial.points.size(), 1u);
  EXPECT_EQ(initial.points[0].point, 2);
  EXPECT_EQ(initial.points[0].displacement, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(initial.points[0].velocity, Eigen::Vector3d(0.4, 0.5, 0.6));
  ASSERT_EQ(initial.modes.size(), 1u);
  EXPECT_EQ(initial.modes[0].mode, 3);
  EXPECT_EQ(initial.modes[0].q, 0.7);
  EXPECT_EQ(initial.modes[0].q_dot, 0.8);
}

TEST(ReadScene, LoadsAndTheirHistoriesAreReadAsWritten) {
  const Scene scene = read_good(kEveryKey);
  ASSERT_EQ(scene.loads.size(), 4u);
  EXPECT_EQ(scene.loads[0].name, "kick");
  EXPECT_EQ(scene.loads[0].axes, Axes::kBody);
  ASSERT_EQ(scene.loads[0].forces.size(), 1u);
  EXPECT_EQ(scene.loads[0].forces[0].point, 2);
  EXPECT_EQ(scene.loads[0].forces[0].force, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(std::get<PulseHistory>(scene.loads[0].history).start, 0.5);
  EXPECT_EQ(std::get<PulseHistory>(scene.loads[0].history).duration, 0.1);
  EXPECT_EQ(scene.loads[1].axes, Axes::kWorld);
  ASSERT_EQ(scene.loads[1].wrenches.size(), 1u);
  EXPECT_EQ(scene.loads[1].wrenches[0].group, 0);
  EXPECT_EQ(scene.loads[1].wrenches[0].force, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(scene.loads[1].wrenches[0].torque, Eigen::Vector3d(7, 8, 9));
  EXPECT_EQ(std::get<SineHistory>(scene.loads[1].history).frequency, 2.0);
  EXPECT_EQ(std::get<SineHistory>(scene.loads[1].history).phase, 0.25);
  EXPECT_EQ(scene.loads[2].forces.size(), 2u);
  EXPECT_EQ(std::get<TableHistory>(scene.loads[2].history).times, (std::vector<double>{0, 1, 3}));
  EXPECT_EQ(std::get<TableHistory>(scene.loads[2].history).values, (std::vector<double>{0, 2, -1}));
  EXPECT_TRUE(std::holds_alternative<ConstantHistory>(scene.loads[3].history));
}

TEST(ReadScene, SelectionsKeepTheirWrittenOrder) {
  const Scene scene = read_good(kEveryKey);
  ASSERT_EQ(scene.groups.size(), 2u);
  EXPECT_EQ(scene.groups[0].points, (std::vector<int>{2, 3}));
  EXPECT_EQ(scene.groups[1].points, (std::vector<int>{0, 1, 2, 3}));
  const Publication& publication = scene.publication;
  EXPECT_EQ(publication.points, (std::vector<int>{2, 0}));
  EXPECT_EQ(publication.links, (std::vector<int>{3, 0}));
  EXPECT_EQ(publication.groups, (std::vector<int>{1}));
  EXPECT_EQ(publication.rates[kStateChannel], 100.0);
  EXPECT_EQ(publication.rates[kPointsChannel], 25.0);
  EXPECT_EQ(publication.rates[kLoadsChannel], 0.0);
  EXPECT_EQ(publication.status_rate, 5.0);
  EXPECT_EQ(scene.pushable, (std::vector<int>{2, 1}));
  EXPECT_EQ(scene.force_limit, 1000.0);
  EXPECT_EQ(scene.command_limits, (CommandLimits{.max_age = 0.2, .sender_share = 0.5, .max_hold = 5.0}));
  EXPECT_EQ(scene.torque_limit, 100.0);
}

TEST(ReadScene, EverythingIsPublishedAndPushableByDefault) {
  const Scene scene = read_good(
      "points: [{name: a, mass: 1, at: [0, 0, 0]}, {name: b, mass: 1, at: [1, 0, 0]}]\n"
      "links: {spring: [a, b], stiffness: 1}\n"
      "groups: {both: all}\n");
  EXPECT_EQ(scene.name, "scene") << "the name comes from the file name";
  EXPECT_EQ(scene.publication.points, (std::vector<int>{0, 1}));
  EXPECT_EQ(scene.publication.links, (std::vector<int>{0}));
  EXPECT_EQ(scene.publication.groups, (std::vector<int>{0}));
  EXPECT_EQ(scene.pushable, (std::vector<int>{0, 1}));
  EXPECT_EQ(scene.force_limit, 0.0);
  EXPECT_EQ(scene.command_limits, (CommandLimits{.max_age = 1.0, .sender_share = 0.25, .max_hold = 60.0}));
}

TEST(ReadScene, AnchorsAndMergesAreExpanded) {
  const Scene scene = read_good(
      "points:\n"
      "  - &first {name: a, mass: 7, at: [0, 0, 0]}\n"
      "  - {<<: *first, name: b, at: &there [1, 0, 0]}\n"
      "links: []\n"
      "gravity: *there\n");
  ASSERT_EQ(scene.points.size(), 2u);
  EXPECT_EQ(scene.points[1].name, "b");
  EXPECT_EQ(scene.points[1].mass, 7.0);
  EXPECT_EQ(scene.gravity, Eigen::Vector3d(1, 0, 0));
}

TEST(ReadScene, ASceneInJsonIsReadAsYaml) {
  const Scene scene = read_good(
      "{\n\t\"name\": \"json\",\r\n"
      "  \"points\": [{\"name\": \"a\", \"mass\": 1.5, \"at\": [0, -1e-3, 2E+2]}]\n}\n");
  ASSERT_EQ(scene.points.size(), 1u);
  EXPECT_EQ(scene.points[0].position, Eigen::Vector3d(0, -1e-3, 200));
}

TEST(ReadScene, NumbersAreReadToTheLastBit) {
  const Scene scene = read_good(
      "points: {mass: 0.1, at: [1.7976931348623157e308, 4.9406564584124654e-324, 9007199254740993]}\n");
  ASSERT_EQ(scene.points.size(), 1u);
  EXPECT_EQ(scene.points[0].mass, 0x1.999999999999ap-4);
  EXPECT_EQ(scene.points[0].position[0], 0x1.fffffffffffffp1023);
  EXPECT_EQ(scene.points[0].position[1], 0x0.0000000000001p-1022);
  EXPECT_EQ(scene.points[0].position[2], 9007199254740992.0) << "2^53 + 1 rounds to even";
}

TEST(ReadScene, AttitudeIsNormalisedToWithinRounding) {
  const Scene scene =
      read_good("points: {mass: 1, at: [0, 0, 0]}\ninitial: {attitude: [0.7071068, 0, 0.7071068, 0]}\n");
  EXPECT_NEAR(scene.initial.attitude.norm(), 1.0,
              2.3e-16);  // the norm and each quotient are rounded once
  EXPECT_EQ(scene.initial.attitude[0], scene.initial.attitude[2]);
}

TEST(ReadScene, TheSceneHashCoversEveryFileInOrder) {
  const TemporaryFolder folder;
  const auto hash = [&](const std::string& yaml, const std::string& csv) {
    folder.write("scene.yaml", yaml);
    folder.write("points.csv", csv);
    const io::SceneResult result = io::read_scene("scene.yaml");
    EXPECT_EQ(result.sources, (std::vector<std::string>{"scene.yaml", "points.csv"}));
    return result.scene ? result.scene->hash : 0;
  };
  const std::string yaml = "points: {csv: points.csv}\n", csv = "mass,x,y,z\n1,0,0,0\n";
  const std::uint64_t first = hash(yaml, csv);
  EXPECT_NE(first, 0u);
  EXPECT_EQ(hash(yaml, csv), first);
  EXPECT_NE(hash(yaml + "\n", csv), first);
  EXPECT_NE(hash(yaml, csv + "\n"), first);
  EXPECT_EQ(first, 0x3f1483d8e9accb3bu) << "XXH3-64, seed 0, of both texts as one";
}

TEST(ReadScene, PublicationRatesAboveTheTickRateGiveAWarning) {
  const TemporaryFolder folder;
  folder.write("scene.yaml", "rate: 100\npoints: {mass: 1, at: [0, 0, 0]}\npublish: {state: 200}\n");
  const io::SceneResult result = io::read_scene("scene.yaml");
  EXPECT_TRUE(result.scene.has_value());
  ASSERT_EQ(result.faults.size(), 1u);
  EXPECT_EQ(io::format_fault(result.faults[0], result.sources, false),
            "scene.yaml:3:18: warning: publish: state 200 Hz is above the tick rate of 100 Hz; each tick is "
            "published at "
            "most once");
}

TEST(ReadScene, FilesAreFoundInTheFolderOfTheScene) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "scenes");
  folder.write("scenes/scene.yaml", "points: {csv: points.csv}\n");
  folder.write("scenes/points.csv", "mass,x,y,z\n1,0,0,0\n");
  const io::SceneResult result = io::read_scene("scenes/scene.yaml");
  EXPECT_TRUE(result.scene.has_value());
  EXPECT_EQ(result.sources, (std::vector<std::string>{"scenes/scene.yaml", "scenes/points.csv"}));
}

}  // namespace
}  // namespace freeflex::testing
