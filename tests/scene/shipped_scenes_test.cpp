// The shipped scenes agree with their descriptions.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <set>

#include "service/io/scene/input.hpp"

namespace freeflex::testing {
namespace {

Scene read_shipped(const std::string& name) {
  const io::SceneResult result = io::read_scene(std::string(FREEFLEX_SOURCE_DIR) + "/service/scenes/" + name);
  for (const Fault& fault : result.faults) ADD_FAILURE() << io::format_fault(fault, result.sources);
  return result.scene.value_or(Scene{});
}

double total_mass(const Scene& scene) {
  return std::accumulate(scene.points.begin(), scene.points.end(), 0.0,
                         [](double sum, const PointMass& point) { return sum + point.mass; });
}

class ShippedScene : public ::testing::TestWithParam<const char*> {};

TEST_P(ShippedScene, BecomesAPlanWithoutFaults) {
  const io::PlanResult result =
      io::load_plan(std::string(FREEFLEX_SOURCE_DIR) + "/service/scenes/" + GetParam());
  for (const Fault& fault : result.faults) ADD_FAILURE() << io::format_fault(fault, result.sources);
  ASSERT_TRUE(result.plan.has_value());
  EXPECT_FALSE(result.plan->histories.empty()) << "without loads nothing would move in the scene";
  EXPECT_FALSE(result.plan->published_points.empty());
}

INSTANTIATE_TEST_SUITE_P(ShippedScenes, ShippedScene,
                         ::testing::Values("boom.yaml", "satellite.yaml", "rotor.yaml", "network.yaml",
                                           "beam101.yaml", "mast.yaml", "truss104.yaml", "truss-s1.yaml",
                                           "truss-s2.yaml", "truss-s4.yaml", "truss-s5.yaml"),
                         [](const auto& scene) {
                           const std::string name = scene.param;
                           std::string stem = name.substr(0, name.find('.'));
                           std::erase(stem, '-');
                           return stem;
                         });

TEST(ShippedScenes, RotorHasThePublishedMassAndNoForceUnderTranslation) {
  const Scene scene = read_shipped("rotor.yaml");
  ASSERT_EQ(scene.points.size(), 115u);
  EXPECT_NEAR(total_mass(scene), 77.966, 5e-4);  // the published mass has 5 digits
  ASSERT_EQ(scene.links.size(), 1u);
  const MatrixLink& link = std::get<MatrixLink>(scene.links[0].kind);
  ASSERT_EQ(link.matrix.rows(), 345);
  EXPECT_EQ(Eigen::SparseMatrix<double>(link.matrix.transpose()).toDense(), link.matrix.toDense());
  // a common translation of all points strains no link, to within the digits of the published matrix
  Eigen::VectorXd shift = Eigen::VectorXd::Zero(345);
  for (int i = 0; i < 115; ++i) shift[3 * i + 2] = 1.0;
  EXPECT_LT((link.matrix * shift).norm(), 1e-8 * link.matrix.norm());
}

TEST(ShippedScenes, TheRimOfTheRotorIsTheOuterRingOfTheDisc) {
  const Scene scene = read_shipped("rotor.yaml");
  ASSERT_FALSE(scene.groups.empty());
  ASSERT_EQ(scene.groups[0].name, "rim");
  std::set<int> rim(scene.groups[0].points.begin(), scene.groups[0].points.end()), outer;
  for (int i = 0; i < 115; ++i) {
    const Eigen::Vector3d& p = scene.points[static_cast<std::size_t>(i)].position;
    if (std::hypot(p.x(), p.y()) > 0.19) outer.insert(i);
  }
  EXPECT_EQ(rim, outer);
}

TEST(ShippedScenes, NetworkJoinsExactlyThePairsWithin15Angstrom) {
  const Scene scene = read_shipped("network.yaml");
  ASSERT_EQ(scene.points.size(), 76u);
  std::set<std::vector<int>> near, joined;
  for (int i = 0; i < 76; ++i)
    for (int k = i + 1; k < 76; ++k)
      if ((scene.points[static_cast<std::size_t>(i)].position -
           scene.points[static_cast<std::size_t>(k)].position)
              .norm() <= 15.0)
        near.insert({i, k});
  for (const Link& link : scene.links) {
    EXPECT_EQ(std::get<Spring>(link.kind).stiffness, 1.0);
    joined.insert(link.points);
  }
  EXPECT_EQ(near, joined);
  EXPECT_EQ(scene.links.size(), 1428u);
}

TEST(ShippedScenes, BeamBendsAtTheFrequenciesOfTheContinuousBeam) {
  const io::PlanResult result =
      io::load_plan(std::string(FREEFLEX_SOURCE_DIR) + "/service/scenes/beam101.yaml");
  ASSERT_TRUE(result.plan.has_value());
  const Plan& plan = *result.plan;
  EXPECT_EQ(plan.rigid_freedoms, 5);
  EXPECT_NEAR(plan.mass, 24.6835, 1e-9);                       // 2700 kg/m^3 * 9.142e-4 m^2 * 10 m
  const double scale = std::sqrt(7.5337e4 / 2.46835) / 100.0;  // [rad/s] sqrt(EI / rho A) / L^2
  const std::array<double, 3> beta{4.7300407, 7.8532046, 10.9956078};
  for (std::size_t mode = 0; mode < 3; ++mode) {
    const double exact = beta[mode] * beta[mode] * scale;
    // the mass is lumped on 101 points, so the relative error of the frequency of mode n is about
    // (n pi)^2 / 12 / 100^2, less than 2e-3 for the first three modes
    EXPECT_NEAR(plan.omega[2 * mode] / exact, 1.0, 2e-3);
    EXPECT_NEAR(plan.omega[2 * mode + 1] / plan.omega[2 * mode], 1.0, 1e-9)
        << "each frequency occurs twice, bending along y and z";
  }
}

TEST(ShippedScenes, TrussHasThePointsAndLinksOfItsDescription) {
  const Scene scene = read_shipped("truss104.yaml");
  ASSERT_EQ(scene.points.size(), 104u);
  ASSERT_EQ(scene.links.size(), 456u);
  const std::array<std::array<double, 2>, 4> corners{{{-.5, -.5}, {.5, -.5}, {.5, .5}, {-.5, .5}}};
  std::vector<std::vector<int>> ends;
  for (int i = 0; i < 26; ++i) {
    for (int c = 0; c < 4; ++c) {
      const PointMass& point = scene.points[static_cast<std::size_t>(4 * i + c)];
      const auto& [y, z] = corners[static_cast<std::size_t>(c)];
      EXPECT_EQ(point.position, Eigen::Vector3d(i - 12.5, y, z));
      EXPECT_EQ(point.mass, 1.0);
      EXPECT_EQ(point.name, "s" + std::to_string(i) + "c" + std::to_string(c));
      ends.push_back({4 * i + c, 4 * i + (c + 1) % 4});
    }
    ends.push_back({4 * i, 4 * i + 2});
    ends.push_back({4 * i + 1, 4 * i + 3});
    for (int c = 0; c < 4 && i < 25; ++c) {
      const int next = (c + 1) % 4;
      ends.push_back({4 * i + c, 4 * i + 4 + c});
      ends.push_back({4 * i + c, 4 * i + 4 + next});
      ends.push_back({4 * i + next, 4 * i + 4 + c});
    }
  }
  for (std::size_t k = 0; k < 456; ++k) {
    EXPECT_EQ(scene.links[k].points, ends[k]) << "spring " << k + 1;
    EXPECT_EQ(std::get<Spring>(scene.links[k].kind).stiffness, 1e5);
  }
}

}  // namespace
}  // namespace freeflex::testing
