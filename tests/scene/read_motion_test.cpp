// The rung, attractors, followers and feedback are read as written.
#include "tests/scene/good_scene.hpp"

namespace freeflex::testing {
namespace {

TEST(ReadMotion, DefaultIsTheSeparatedRungWithoutAttractorOrFeedback) {
  const Scene scene = read_good(kTwoPoints);
  EXPECT_EQ(scene.fidelity, Fidelity::kSeparated);
  EXPECT_EQ(scene.attractor.mu, 0.0) << "no attractor";
  EXPECT_TRUE(scene.feedbacks.empty());
}

TEST(ReadMotion, FidelityIsReadByName) {
  EXPECT_EQ(read_good(kTwoPoints + "fidelity: separated\n").fidelity, Fidelity::kSeparated);
  EXPECT_EQ(read_good(kTwoPoints + "fidelity: spin-loaded\n").fidelity, Fidelity::kSpinLoaded);
}

TEST(ReadMotion, AttractorIsAtTheOriginByDefault) {
  const Scene at_origin = read_good(kTwoPoints + "attractor: {mu: 3.986004418e14}\n");
  EXPECT_EQ(at_origin.attractor.mu, 3.986004418e14);
  EXPECT_EQ(at_origin.attractor.position, Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(at_origin.attractor.origin.line, 3);
  const Scene placed = read_good(kTwoPoints + "attractor: {at: [1, -2, 3e6], mu: 5}\n");
  EXPECT_EQ(placed.attractor.position, Eigen::Vector3d(1, -2, 3e6));
}

TEST(ReadMotion, ForcesMayFollowTheLocalRotation) {
  const Scene scene = read_good(kTwoPoints + "loads: {axes: local, forces: {b: [1, 2, 3]}}\n");
  ASSERT_EQ(scene.loads.size(), 1u);
  EXPECT_EQ(scene.loads[0].axes, Axes::kLocal);
  ASSERT_EQ(scene.loads[0].forces.size(), 1u);
  EXPECT_EQ(scene.loads[0].forces[0].force, Eigen::Vector3d(1, 2, 3));
}

TEST(ReadMotion, FeedbackSensesItsOwnPointByDefault) {
  const Scene scene = read_good(kTwoPoints +
                                "feedback:\n"
                                "  - {name: own, at: b, velocity: -2}\n"
                                "  - {at: a, from: b, displacement: 3}\n");
  ASSERT_EQ(scene.feedbacks.size(), 2u);
  EXPECT_EQ(scene.feedbacks[0].name, "own");
  EXPECT_EQ(scene.feedbacks[0].point, 1);
  EXPECT_EQ(scene.feedbacks[0].sensor, 1);
  EXPECT_EQ(scene.feedbacks[0].origin.line, 4);
  EXPECT_EQ(scene.feedbacks[1].name, "2");
  EXPECT_EQ(scene.feedbacks[1].point, 0);
  EXPECT_EQ(scene.feedbacks[1].sensor, 1);
}

TEST(ReadMotion, AGainMayBeANumberADiagonalOrTheRowsOfAMatrix) {
  const Scene scene = read_good(kTwoPoints +
                                "feedback:\n"
                                "  at: b\n"
                                "  displacement: -4\n"
                                "  velocity: [1, 2, 3]\n"
                                "  acceleration: [[11, 12, 13], [21, 22, 23], [31, 32, 33]]\n");
  ASSERT_EQ(scene.feedbacks.size(), 1u) << "a mapping is read as a list of one item";
  Eigen::Matrix3d displacement, velocity, acceleration;
  displacement << -4, 0, 0, 0, -4, 0, 0, 0, -4;
  velocity << 1, 0, 0, 0, 2, 0, 0, 0, 3;
  acceleration << 11, 12, 13, 21, 22, 23, 31, 32, 33;
  EXPECT_EQ(scene.feedbacks[0].displacement_gain, displacement);
  EXPECT_EQ(scene.feedbacks[0].velocity_gain, velocity);
  EXPECT_EQ(scene.feedbacks[0].acceleration_gain, acceleration);
}

TEST(ReadMotion, MissingGainIsZero) {
  const Scene scene = read_good(kTwoPoints + "feedback: {at: b, velocity: 1}\n");
  ASSERT_EQ(scene.feedbacks.size(), 1u);
  EXPECT_TRUE(scene.feedbacks[0].displacement_gain.isZero(0.0));
  EXPECT_TRUE(scene.feedbacks[0].acceleration_gain.isZero(0.0));
}

}  // namespace
}  // namespace freeflex::testing
