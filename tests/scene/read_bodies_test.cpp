// Bodies, masses of links, superelements and wheels are read as written.
#include <Eigen/Geometry>

#include "core/scene/bodies.hpp"
#include "tests/scene/good_scene.hpp"

namespace freeflex::testing {
namespace {

const std::string kPoints =
    "points:\n"
    "  - {name: hub, mass: 2, at: [0, 0, 0], inertia: [3, 4, 5], offset: [0.1, 0, 0.2]}\n"
    "  - {name: b, mass: 0, at: [2, 0, 0]}\n"
    "  - {name: c, mass: 1, at: [2, 1, 0]}\n";

// returns all faults of reading and set-up
std::string faults_of(const std::string& text) {
  const TemporaryFolder folder;
  folder.write("scene.yaml", text);
  const io::PlanResult result = io::load_plan("scene.yaml");
  std::string all;
  for (const Fault& fault : result.faults) all += fault.message + "\n";
  return all;
}

TEST(ReadBodies, InertiaAndOffsetAreReadInTheAxesOfTheBody) {
  const Scene scene = read_good(
      "points:\n"
      "  - {name: a, mass: 2, at: [0, 0, 0], inertia: [3, 4, 5], offset: [0.1, 0, 0.2]}\n"
      "  - {name: b, mass: 2, at: [1, 0, 0], inertia: [3, 4, 5, -0.1, 0.2, 0.3]}\n"
      "  - {name: c, mass: 2, at: [2, 0, 0], inertia: [3, 4, 5], offset: [1, 0, 0], axes: [0.6, 0, 0, 0.8]}\n"
      "links: [{beam: [a, b, c], EA: 1e5, GJ: 1e3, EIy: 1e3, EIz: 1e3}]\n");
  EXPECT_EQ(scene.points[0].inertia, Eigen::Matrix3d(Eigen::Vector3d(3.0, 4.0, 5.0).asDiagonal()));
  EXPECT_EQ(scene.points[0].offset, Eigen::Vector3d(0.1, 0.0, 0.2));
  Eigen::Matrix3d six;
  six << 3.0, -0.1, 0.2, -0.1, 4.0, 0.3, 0.2, 0.3, 5.0;
  EXPECT_EQ(scene.points[1].inertia, six);
  // the quaternion (0.6, 0, 0, 0.8) rotates x to (-0.28, 0.96, 0)
  EXPECT_LT((scene.points[2].offset - Eigen::Vector3d(-0.28, 0.96, 0.0)).norm(), 1e-15);
  const Eigen::Vector3d x(-0.28, 0.96, 0.0), y(-0.96, -0.28, 0.0);
  const Eigen::Matrix3d J = scene.points[2].inertia;
  EXPECT_NEAR(x.dot(J * x), 3.0, 1e-14);
  EXPECT_NEAR(y.dot(J * y), 4.0, 1e-14);
}

TEST(ReadBodies, LinksHaveTheMassAndDistributionThatTheirKeysGive) {
  const Scene scene = read_good(
      kPoints +
      "links:\n"
      "  - {beam: [hub, b], EA: 1e5, GJ: 1e3, EIy: 1e3, EIz: 1e3, mass_per_length: 3, mean_axial: true}\n"
      "  - {bar: [b, c], EA: 1e5, mass_per_length: 2, lumped: true}\n"
      "  - {plate: [hub, b, c], E: 1e9, nu: 0.3, thickness: 0.01, density: 100}\n"
      "  - {beam: [b, c], EA: 1e5, GJ: 1e3, EIy: 1e3, EIz: 1e3, mass_per_length: 1, lumped: false}\n");
  EXPECT_DOUBLE_EQ(mass_of(scene, scene.links[0]), 6.0);
  EXPECT_EQ(mass_distribution_of(scene.links[0]), MassDistribution::kMeanAxial);
  EXPECT_FALSE(has_mass(scene.links[1]));  // its 2 kg are on b and c, 1 kg each
  const Scene bare =
      read_good(kPoints + "links: [{beam: [hub, b, c], EA: 1e5, GJ: 1e3, EIy: 1e3, EIz: 1e3}]\n");
  for (const std::size_t k : {0U, 1U, 2U})
    EXPECT_DOUBLE_EQ(scene.points[k].mass - bare.points[k].mass, k == 0U ? 0.0 : 1.0) << k;
  EXPECT_DOUBLE_EQ(mass_of(scene, scene.links[2]), 1.0);
  EXPECT_EQ(mass_distribution_of(scene.links[2]), MassDistribution::kConsistent);
  EXPECT_EQ(mass_distribution_of(scene.links[3]), MassDistribution::kConsistent);
}

TEST(ReadBodies, WheelsAndTorquesAreReadByName) {
  const Scene scene = read_good(kPoints +
                                "links: [{beam: [hub, b, c], EA: 1e5, GJ: 1e3, EIy: 1e3, EIz: 1e3}]\n"
                                "wheels:\n"
                                "  - {name: fly, at: hub, axis: [0, 3, 4], momentum: -2.5}\n"
                                "  - {at: hub, axis: [1, 0, 0]}\n"
                                "loads:\n"
                                "  - {torques: {hub: [1, 2, 3]}, wheels: {fly: 0.5}}\n");
  ASSERT_EQ(scene.wheels.size(), 2U);
  EXPECT_EQ(scene.wheels[0].name, "fly");
  EXPECT_EQ(scene.wheels[0].point, 0);
  EXPECT_LT((scene.wheels[0].axis - Eigen::Vector3d(0.0, 0.6, 0.8)).norm(), 1e-15);
  EXPECT_EQ(scene.wheels[0].momentum, -2.5);
  EXPECT_EQ(scene.wheels[1].momentum, 0.0);
  ASSERT_EQ(scene.loads.size(), 1U);
  ASSERT_EQ(scene.loads[0].torques.size(), 1U);
  EXPECT_EQ(scene.loads[0].torques[0].torque, Eigen::Vector3d(1.0, 2.0, 3.0));
  ASSERT_EQ(scene.loads[0].wheels.size(), 1U);
  EXPECT_EQ(scene.loads[0].wheels[0].torque, 0.5);
}

TEST(ReadBodies, FaultsOfWheelsTorquesAndMassKeysAreReported) {
  const std::string beam = "links: [{beam: [hub, b, c], EA: 1e5, GJ: 1e3, EIy: 1e3, EIz: 1e3}]\n";
  const auto expect = [](const std::string& scene, const std::string& what) {
    const std::string text = faults_of(scene);
    EXPECT_NE(text.find(what), std::string::npos) << text;
  };
  expect(kPoints + beam + "loads: [{wheels: {fly: 1}}]\n", "names the wheel 'fly'");
  expect(kPoints + beam + "loads: [{torques: {c: [1, 0, 0]}}]\n", "has no attitude");
  expect(kPoints + "links: [{bar: [hub, c], EA: 1e5, mass_per_length: 1, lumped: true, mean_axial: true}]\n",
         "remove one of them");
}

}  // namespace
}  // namespace freeflex::testing
