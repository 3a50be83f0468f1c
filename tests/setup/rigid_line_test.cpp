// These tests use rigid bodies whose points lie on a line. The links at these points rotate with the bodies,
// and rotation about the line has no inertia.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "core/structure/links/link_factor.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {
namespace {

// Returns the scene rotated at random and moved by (away, -away, away / 2) [m].
Scene placed(Scene scene, std::uint64_t seed, double away) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  const Eigen::Matrix3d R = Eigen::Quaterniond(normal(engine), normal(engine), normal(engine), normal(engine))
                                .normalized()
                                .matrix();
  for (PointMass& point : scene.points)
    point.position = R * point.position + Eigen::Vector3d(away, -away, 0.5 * away);
  for (Link& link : scene.links)
    if (auto* beam = std::get_if<Beam>(&link.kind)) beam->y_axis = R * beam->y_axis;
  return scene;
}

double largest_difference(const Eigen::VectorXd& omega, const Eigen::VectorXd& expected) {
  return ((omega - expected).array() / expected.array()).abs().maxCoeff();
}

constexpr double kEA = 1e6, kGJ = 1e3, kEI = 300.0;
Beam tube() { return {kEA, kGJ, kEI, kEI, Eigen::Vector3d::Zero()}; }

// A cross piece along z has 3 kg at +-0.7 m and 2 kg at its middle. A beam of 1.3 m begins at the middle and
// has 1.5 kg at its end. The end deflects by F L^3 / (3 EI) relative to the body, so
// omega^2 = 3 EI / L^3 (1 / m + 1 / M_b + L^2 / J). The beam stretches with
// omega^2 = EA / L (1 / m + 1 / M_b). About the line the body has no inertia, and the beam rotates freely.
TEST(RigidBodiesOnALine, ClampABeamAcrossTheirLineButLetItRotateAboutTheLine) {
  constexpr double kArm = 0.7, kLength = 1.3, kEnd = 1.5, kBody = 8.0;
  Scene scene;
  add_point(scene, 2.0, {0.0, 0.0, 0.0});
  add_point(scene, 3.0, {0.0, 0.0, kArm});
  add_point(scene, 3.0, {0.0, 0.0, -kArm});
  add_point(scene, kEnd, {kLength, 0.0, 0.0});
  add_link(scene, {0, 1, 2}, Rigid{});
  add_link(scene, {0, 3}, tube());
  const double inertia = 6.0 * kArm * kArm;
  Eigen::Vector2d expected(
      3.0 * kEI / std::pow(kLength, 3) * (1.0 / kEnd + 1.0 / kBody + kLength * kLength / inertia),
      kEA / kLength * (1.0 / kEnd + 1.0 / kBody));
  expected = expected.cwiseSqrt().eval();
  double worst = 0.0;
  for (const double away : {0.0, 3.0, 1000.0})
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      Faults warnings;
      const Structure structure = build(placed(scene, seed, away), &warnings);
      EXPECT_TRUE(warnings.empty());
      EXPECT_TRUE(structure.mechanisms.empty());
      ASSERT_EQ(structure.omega.size(), 2) << away << ", seed " << seed;
      // the bound allows some rounding errors of the coordinates, relative to the size of the body
      const double error = largest_difference(structure.omega, expected) / std::max(1.0, away);
      EXPECT_LT(error, 1e-14) << away << ", seed " << seed;
      worst = std::max(worst, error);
    }
  std::printf("beam on a cross piece: relative difference from the closed form %.1e m of the coordinates\n",
              worst);
}

// Arms along x begin at both ends of a body along z. For motion out of the plane of the arms, the rotation of
// the body about its line couples the ends of the arms. With the displacements y_i of the arm ends and Y_i of
// the body ends, the elongation e = (y_1 - Y_1) - (y_2 - Y_2) has the stiffness k / 2 with k = 3 EI / L^3, so
// omega^2 = k (1 / m + 1 / m_body). The moments of the two joints about the line cancel.
TEST(RigidBodiesOnALine, CoupleTheBeamsAtTheirPointsByRotatingAboutTheLine) {
  constexpr double kLength = 1.3, kEnd = 1.5, kBodyEnd = 3.0;
  Scene scene;
  add_point(scene, kBodyEnd, {0.0, 0.0, 0.8});
  add_point(scene, kBodyEnd, {0.0, 0.0, -0.8});
  add_point(scene, 2.0, {0.0, 0.0, 0.0});
  add_point(scene, kEnd, {kLength, 0.0, 0.8});
  add_point(scene, kEnd, {kLength, 0.0, -0.8});
  add_link(scene, {0, 1, 2}, Rigid{});
  for (const int arm : {0, 1}) {
    Beam beam = tube();
    beam.y_axis = {0.0, 1.0, 0.0};
    add_link(scene, {arm, 3 + arm}, beam);
  }
  scene.publication.links = {1, 2};
  const double expected = std::sqrt(3.0 * kEI / std::pow(kLength, 3) * (1.0 / kEnd + 1.0 / kBodyEnd));
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Structure structure = build(placed(scene, seed, 3.0));
    ASSERT_EQ(structure.omega.size(), 3 * 5 - 6 - 4);
    EXPECT_TRUE(structure.mechanisms.empty());
    EXPECT_LT((structure.omega.array() / expected - 1.0).abs().minCoeff(), 1e-13) << seed;
    // M_z at the first end of each arm
    const Eigen::RowVectorXd first = structure.link_forces[0].rows.row(5),
                             second = structure.link_forces[1].rows.row(5);
    EXPECT_GT(first.norm(), 1.0);
    // rounding errors of the stiffest row, EA, are large relative to bending
    EXPECT_LT((first + second).norm(), 1e-10 * first.norm()) << seed;
  }
}

struct LineCase {
  const char* name;
  std::function<void(Scene&)>
      add;  // adds links between points 0 to 2 of the body and points 3 to 6 next to it
};

// Returns a body of three points on a line (0 to 2) and points around it. If `off_line` [kg] > 0, the body
// has a further point of this mass off the line.
Scene with_body(const LineCase& each, double off_line, double distance = 1.0) {
  Scene scene;
  const Eigen::Vector3d along = Eigen::Vector3d(0.3, -0.7, 0.9).normalized();
  for (const double at : {-0.8, 0.1, 1.0}) add_point(scene, 2.0 + at, at * along);
  add_point(scene, 1.0, {1.1, 0.2, 0.3});
  add_point(scene, 1.3, {2.0, 0.6, -0.2});
  add_point(scene, 0.8, {-0.4, 1.2, 0.9});
  add_point(scene, 1.7, {0.6, 1.1, 1.3});
  each.add(scene);
  std::vector<int> body{0, 1, 2};
  if (off_line > 0.0)
    body.push_back(add_point(scene, off_line, 0.4 * along + distance * along.unitOrthogonal()));
  add_link(scene, body, Rigid{});
  return scene;
}

const std::vector<LineCase>& line_cases() {
  static const std::vector<LineCase> kCases{
      {"beams at its middle",
       [](Scene& scene) {
         for (const auto& [i, j] : {std::pair{1, 3}, {3, 4}, {1, 5}, {5, 6}}) add_link(scene, {i, j}, tube());
       }},
      {"beams at its ends and its middle",
       [](Scene& scene) {
         for (const auto& [i, j] : {std::pair{0, 3}, {3, 4}, {1, 5}, {2, 6}}) add_link(scene, {i, j}, tube());
       }},
      {"beams with releases",
       [](Scene& scene) {
         Beam pinned = tube();
         pinned.released[0] = {false, true, false};
         add_link(scene, {0, 3}, pinned);
         add_link(scene, {3, 4}, tube());
         add_link(scene, {5, 1}, tube());
         pinned.released = {};
         pinned.released[1] = {true, false, true};
         add_link(scene, {6, 2}, pinned);
         add_link(scene, {6, 5}, tube());
         add_link(scene, {4, 5}, tube());
       }},
      {"plates",
       [](Scene& scene) {
         const Plate plate{2e7, 0.3, 0.02};
         for (const std::vector<int>& points : {std::vector<int>{1, 3, 4}, {1, 2, 5}, {2, 5, 6}})
           add_link(scene, points, plate);
       }},
      {"bending and torsion springs beside beams",
       [](Scene& scene) {
         for (const auto& [i, j] : {std::pair{1, 3}, {3, 4}, {1, 5}}) add_link(scene, {i, j}, tube());
         add_link(scene, {2, 6}, Spring{2e4});
         add_link(scene, {0, 1, 6}, BendingSpring{150.0});
         add_link(scene, {3, 1, 2, 6}, TorsionSpring{90.0});
       }},
  };
  return kCases;
}

// A light point off the line adds one frequency, which depends on the inertia of the point about the line.
// The point shifts the other frequencies in proportion to its mass.
TEST(RigidBodiesOnALine, AreTheLimitOfALightPointOffTheLine) {
  for (const LineCase& each : line_cases()) {
    SCOPED_TRACE(each.name);
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const Structure line = build(placed(with_body(each, 0.0), seed, 2.0));
      const Structure light = build(placed(with_body(each, 1e-9), seed, 2.0));
      EXPECT_TRUE(line.mechanisms.empty());
      EXPECT_GT(line.omega[0], 0.0);
      ASSERT_EQ(line.omega.size(), 3 * 7 - 6 - 4);
      ASSERT_EQ(light.omega.size(), line.omega.size() + 1);
      const double error = largest_difference(light.omega.head(line.omega.size()), line.omega);
      EXPECT_LT(error, 1e-8);
      EXPECT_GT(light.omega.tail<1>()[0], 10.0 * line.omega.tail<1>()[0]);
      if (seed == 1) std::printf("%s: 1e-9 kg off the line moves frequencies by %.1e\n", each.name, error);
    }
  }
}

// A point of 1 kg is so near the line that its inertia about the line is negligible. The rotation of a body
// follows from its points, however thin the body is.
TEST(RigidBodiesOnALine, AreTheLimitOfEverThinnerBodies) {
  for (const double width : {1e-5, 1e-7}) {
    const LineCase& each = line_cases()[1];
    const Structure thin = build(placed(with_body(each, 1.0, width), 4, 0.0));
    Scene scene = with_body(each, 0.0);
    // the same mass on the line
    scene.links.back().points.push_back(
        add_point(scene, 1.0, 0.4 * Eigen::Vector3d(0.3, -0.7, 0.9).normalized()));
    const Structure line = build(placed(scene, 4, 0.0));
    ASSERT_EQ(thin.omega.size(), line.omega.size() + 1);
    const double error = largest_difference(thin.omega.head(line.omega.size()), line.omega);
    // the distance of the point from the line is `width`
    EXPECT_LT(error, 10.0 * width);
    std::printf("a body %.0e m wide: frequencies differ by %.1e from those of one on a line\n", width, error);
  }
}

// Beams join four points along x, and a cross piece along z lies at the first point.
TEST(RigidBodiesOnALine, ClampTheRootOfATee) {
  for (const double off_line : {0.0, 1e-9}) {
    Scene scene;
    for (int i = 0; i < 4; ++i) add_point(scene, i == 0 ? 2.0 : 1.0, {1.0 * i, 0.0, 0.0});
    std::vector<int> body{0, add_point(scene, 3.0, {0.0, 0.0, 1.0}), add_point(scene, 3.0, {0.0, 0.0, -1.0})};
    if (off_line > 0.0) body.push_back(add_point(scene, off_line, {0.0, 1.0, 0.0}));
    for (int i = 0; i < 3; ++i) add_link(scene, {i, i + 1}, Beam{1e6, 1e3, 100.0, 100.0, {0.0, 1.0, 0.0}});
    add_link(scene, body, Rigid{});
    const Structure structure = build(scene);
    EXPECT_TRUE(structure.mechanisms.empty());
    ASSERT_GE(structure.omega.size(), 8);
    const Eigen::VectorXd hertz = structure.omega / (2.0 * M_PI);
    // the expected frequencies are those of the body with a light point off the line, to the printed digits
    EXPECT_NEAR(hertz[0], 0.84, 0.005);
    EXPECT_NEAR(hertz[1], 2.16, 0.005);
    EXPECT_NEAR(hertz[2], 3.25, 0.005);
  }
}

// Beams in line with the body rotate about that line freely, and no point moves.
TEST(RigidBodiesOnALine, FreeRotationAboutTheirLineMovesNoPoint) {
  Scene scene;
  for (int i = 0; i < 5; ++i) add_point(scene, 1.0 + i, {0.0, 0.0, 0.5 * i});
  add_link(scene, {0, 1, 2}, Rigid{});
  add_link(scene, {2, 3}, tube());
  add_link(scene, {3, 4}, tube());
  for (const bool has_more : {false, true}) {
    if (has_more) {
      // a point of 1 kg on springs is added, so that the points are not all on one line
      const int more = add_point(scene, 1.0, {0.7, 0.3, 1.0});
      for (const int i : {0, 2, 4}) add_link(scene, {i, more}, Spring{1e4});
    }
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      Faults warnings;
      const Structure structure = build(placed(scene, seed, 2.0), &warnings);
      EXPECT_TRUE(warnings.empty()) << warnings[0].message;
      EXPECT_EQ(structure.omega.size(), has_more ? 3 * 6 - 6 - 4 : 3 * 5 - 5 - 4);
      EXPECT_GT(structure.omega[0], 0.0);
    }
  }
}

// If an arm rotates about the line, only its end moves. Two arms at one body rotate together.
TEST(RigidBodiesOnALine, ArmsThatRotateAboutTheLineAreOneMechanism) {
  Scene scene;
  for (const double z : {-0.8, 0.0, 0.9}) add_point(scene, 1.0, {0.0, 0.0, z});
  const int away = add_point(scene, 2.0, {-1.0, 0.2, 0.1}), beyond = add_point(scene, 2.0, {-0.9, -1.0, 0.3});
  add_link(scene, {0, 1, 2}, Rigid{});
  for (const auto& [i, j] : {std::pair{0, away}, {2, away}, {0, beyond}, {2, beyond}, {away, beyond}})
    add_link(scene, {i, j}, Spring{1e5});
  for (const int num_arms : {1, 2}) {
    const int end = add_point(scene, 0.5, {1.2, 0.0, num_arms == 1 ? 0.9 : -0.8});
    add_link(scene, {num_arms == 1 ? 2 : 0, end}, tube());
    Faults warnings;
    const Structure structure = build(scene, &warnings);
    ASSERT_EQ(structure.mechanisms.size(), 1u) << num_arms;
    std::vector<int> moved = structure.mechanisms[0].moved_points;
    std::sort(moved.begin(), moved.end());
    EXPECT_EQ(moved, num_arms == 1 ? (std::vector<int>{5}) : (std::vector<int>{5, 6}));
    EXPECT_EQ(warnings.size(), 1u);
    EXPECT_GT(structure.omega[1], 0.0);
  }
}

// A follower force on a point of the body rotates as if the body had a light point off the line
// (THEORY 8.25).
TEST(RigidBodiesOnALine, RotateTheFollowerForcesAtTheirPoints) {
  const auto followed = [](double off_line) {
    Scene scene = with_body(line_cases()[1], off_line);
    Load load;
    load.axes = Axes::kLocal;
    load.forces.push_back({1, Eigen::Vector3d(1.0, 0.0, 0.0)});
    scene.loads.push_back(load);
    return build(placed(scene, 3, 1.0));
  };
  const Structure line = followed(0.0), light = followed(1e-9);
  const Eigen::MatrixXd rotation = line.local_rotations.at(1);
  EXPECT_GT(rotation.norm(), 0.1);
  // mode shapes change by the relative mass of the light point, divided by the gap between frequencies
  EXPECT_LT((light.local_rotations.at(1) - rotation).norm(), 1e-6 * rotation.norm());
}

// If two bodies share two points, the body with points off the line rotates their joints. Two such bodies
// together are one rigid body.
TEST(RigidBodiesOnALine, AreOneBodyWithABodyThatSharesTwoOfTheirPoints) {
  const auto bodies = [](const std::vector<std::vector<int>>& each) {
    Scene scene;
    for (const double x : {0.0, 0.6, 1.0}) add_point(scene, 2.0, {x, 0.0, 0.0});
    add_point(scene, 1.0, {0.2, 0.7, 0.1});
    add_point(scene, 1.5, {0.1, 0.2, 1.4});
    add_point(scene, 0.8, {0.7, -1.2, 0.3});
    for (const std::vector<int>& points : each) add_link(scene, points, Rigid{});
    add_link(scene, {0, 4}, tube());
    add_link(scene, {1, 5}, tube());
    return build(scene);
  };
  const Structure one = bodies({{0, 1, 2, 3}}), two = bodies({{0, 1, 2}, {0, 1, 3}});
  ASSERT_EQ(two.omega.size(), one.omega.size());
  EXPECT_LT(largest_difference(two.omega, one.omega), 1e-13);
}

}  // namespace
}  // namespace freeflex::testing
