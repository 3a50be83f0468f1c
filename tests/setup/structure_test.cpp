// Properties that every structure has, for shapes of every class.
#include "core/structure/structure.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <functional>

#include "core/rounding.hpp"
#include "core/structure/links/link_factor.hpp"
#include "core/structure/masses/mass_properties.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

using Engine = std::mt19937_64;

double uniform(Engine& engine, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(engine);
}
Eigen::Vector3d random_vector(Engine& engine) {
  return {uniform(engine, -1.0, 1.0), uniform(engine, -1.0, 1.0), uniform(engine, -1.0, 1.0)};
}
// Returns a value between 10^0 and 10^decades.
double graded(Engine& engine, double decades) { return std::pow(10.0, uniform(engine, 0.0, decades)); }

struct ShapeClass {
  const char* name;
  int rigid_freedoms;
  int num_mechanisms;
  std::function<Scene(Engine&)> make;
};

Scene one_point(Engine& engine) {
  Scene scene;
  add_point(scene, 2.0, random_vector(engine));
  return scene;
}

Scene two_points(Engine& engine) {
  Scene scene;
  add_point(scene, 2.0, random_vector(engine));
  add_point(scene, 3.0, random_vector(engine));
  join_all(scene, 1e4);
  return scene;
}

// Returns points on a line. Beams keep the line from folding.
Scene collinear(Engine& engine) {
  Scene scene;
  const Eigen::Vector3d start = random_vector(engine), along = random_vector(engine);
  for (int i = 0; i < 7; ++i)
    add_point(scene, uniform(engine, 0.5, 2.0), start + (i + uniform(engine, 0.0, 0.3)) * along);
  for (int i = 0; i < 6; ++i) add_link(scene, i, i + 1, Beam{1e6, 1e3, 2e3, 3e3, Eigen::Vector3d::Zero()});
  return scene;
}

// Returns springs that all lie in one plane, so each point moves freely out of the plane. Three combinations
// of these motions are rigid.
Scene planar_bars(Engine& engine) {
  Scene scene;
  const Eigen::Vector3d u = random_vector(engine), v = random_vector(engine);
  for (int i = 0; i < 6; ++i)
    add_point(scene, uniform(engine, 0.5, 2.0),
              uniform(engine, -1.0, 1.0) * u + uniform(engine, -1.0, 1.0) * v);
  join_all(scene, 1e5);
  return scene;
}

Scene spatial(Engine& engine) { return random_structure(engine(), 9); }

// Returns a stiff body with one point on a single spring, free in two directions, and one point on two
// springs, free in one direction.
Scene dangling(Engine& engine) {
  Scene scene = spatial(engine);
  const int one = add_point(scene, 0.3, {9.0, 8.0, 7.0});
  add_link(scene, 0, one, Spring{1e5});
  const int two = add_point(scene, 0.4, {-9.0, 7.0, -8.0});
  add_link(scene, 1, two, Spring{1e5});
  add_link(scene, 2, two, Spring{1e5});
  return scene;
}

Scene mass_graded(Engine& engine) {
  Scene scene = spatial(engine);
  for (PointMass& point : scene.points) point.mass = graded(engine, 12.0);
  return scene;
}

Scene stiffness_graded(Engine& engine) {
  Scene scene = spatial(engine);
  for (Link& link : scene.links) link.kind = Spring{graded(engine, 12.0)};
  return scene;
}

const std::vector<ShapeClass>& shape_classes() {
  static const std::vector<ShapeClass> kClasses{{"one point", 3, 0, one_point},
                                                {"two points", 5, 0, two_points},
                                                {"collinear", 5, 0, collinear},
                                                {"planar bars", 6, 3, planar_bars},
                                                {"spatial", 6, 0, spatial},
                                                {"dangling", 6, 3, dangling},
                                                {"masses over 1e12", 6, 0, mass_graded},
                                                {"stiffnesses over 1e12", 6, 0, stiffness_graded}};
  return kClasses;
}

void for_each_structure(const std::function<void(const ShapeClass&, const Scene&, const Structure&)>& check) {
  for (const ShapeClass& shape : shape_classes())
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      SCOPED_TRACE(std::string(shape.name) + ", seed " + std::to_string(seed));
      Engine engine(seed);
      const Scene scene = shape.make(engine);
      check(shape, scene, build(scene));
    }
}

TEST(Structures, TheNumberOfFreedomsDependsOnTheShape) {
  for_each_structure([](const ShapeClass& shape, const Scene& scene, const Structure& structure) {
    const auto num_freedoms = 3 * static_cast<Eigen::Index>(scene.points.size());
    EXPECT_EQ(structure.mass_properties.rigid_freedoms, shape.rigid_freedoms);
    EXPECT_EQ(static_cast<int>(structure.mechanisms.size()), shape.num_mechanisms);
    ASSERT_EQ(structure.omega.size(), num_freedoms - shape.rigid_freedoms);
    ASSERT_EQ(structure.shapes.rows(), num_freedoms);
    ASSERT_EQ(structure.shapes.cols(), structure.omega.size());
    for (Eigen::Index mode = 0; mode < structure.omega.size(); ++mode) {
      if (mode < shape.num_mechanisms) {
        EXPECT_EQ(structure.omega[mode], 0.0);
      } else {
        EXPECT_GT(structure.omega[mode], 0.0);
      }
      if (mode > 0) {
        EXPECT_GE(structure.omega[mode], structure.omega[mode - 1]);
      }
    }
  });
}

// The products of THEORY 4.3 hold up to a few rounding errors for each of the n terms.
TEST(Structures, UnitDisplacementsAreOrthonormalInTheMassMetric) {
  for_each_structure([](const ShapeClass&, const Scene& scene, const Structure& structure) {
    const double M = structure.mass_properties.mass;
    const Eigen::MatrixXd gram =
        structure.shapes.transpose() * masses(scene).asDiagonal() * structure.shapes / M;
    if (gram.size() == 0) return;
    EXPECT_LT((gram - Eigen::MatrixXd::Identity(gram.rows(), gram.cols())).cwiseAbs().maxCoeff(), 2e-14);
  });
}

// The conditions of THEORY 2.12 hold for each unit displacement.
TEST(Structures, UnitDisplacementsHaveNoMomentum) {
  for_each_structure([](const ShapeClass&, const Scene& scene, const Structure& structure) {
    const MassProperties& body = structure.mass_properties;
    const double length = std::sqrt(body.principal.sum() / (2.0 * body.mass));
    for (Eigen::Index mode = 0; mode < structure.omega.size(); ++mode) {
      Eigen::Vector3d momentum = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();
      for (Eigen::Index i = 0; i < body.r.cols(); ++i) {
        const Eigen::Vector3d mb =
            scene.points[static_cast<std::size_t>(i)].mass * structure.shapes.block<3, 1>(3 * i, mode);
        momentum += mb;
        moment += body.r.col(i).cross(mb);
      }
      EXPECT_LT(momentum.norm(), 1e-12 * body.mass);
      EXPECT_LT(moment.norm(), 1e-12 * body.mass * length);
    }
  });
}

// omega^2 M = b' K b holds up to rounding errors of b, which change a frequency by some eps times the largest
// frequency.
TEST(Structures, FrequenciesAreTheRayleighQuotientsOfTheirShapes) {
  for_each_structure([](const ShapeClass&, const Scene& scene, const Structure& structure) {
    if (structure.omega.size() == 0) return;
    Faults faults;
    const LinkFactor factor = factor_links(scene, false, faults);
    const Eigen::MatrixXd strain = factor.rows * structure.shapes / std::sqrt(structure.mass_properties.mass);
    // the rounding errors of coordinates affect the directions of short links most
    double shortest = 1.0;
    for (const Link& link : scene.links)
      shortest = std::min(shortest, (scene.points[static_cast<std::size_t>(link.points[1])].position -
                                     scene.points[static_cast<std::size_t>(link.points[0])].position)
                                        .norm());
    const double tolerance = 64.0 * kEpsilon / shortest * structure.omega.maxCoeff();
    for (Eigen::Index mode = 0; mode < structure.omega.size(); ++mode)
      EXPECT_NEAR(strain.col(mode).norm(), structure.omega[mode], tolerance);
  });
}

TEST(Structures, ARigidMotionStrainsNoLink) {
  for_each_structure([](const ShapeClass&, const Scene& scene, const Structure& structure) {
    Faults faults;
    const LinkFactor factor = factor_links(scene, false, faults);
    const Eigen::MatrixXd strain = factor.rows * rigid_motions(structure.mass_properties);
    if (strain.size() == 0) return;
    EXPECT_LT(strain.cwiseAbs().maxCoeff(), 32.0 * kEpsilon * factor.rows.norm());
  });
}

TEST(Structures, TheLargestComponentOfAModeShapeIsPositive) {
  for_each_structure([](const ShapeClass&, const Scene&, const Structure& structure) {
    for (Eigen::Index mode = 0; mode < structure.omega.size(); ++mode)
      EXPECT_GT(structure.shapes.col(mode).maxCoeff(), -(1.0 - 2e-6) * structure.shapes.col(mode).minCoeff());
  });
}

TEST(Mechanisms, AreReportedWithThePointsThatMove) {
  Engine engine(11);
  Faults warnings;
  const Structure structure = build(dangling(engine), &warnings);
  ASSERT_EQ(structure.mechanisms.size(), 3U);
  std::vector<int> movers;
  for (const Mechanism& mechanism : structure.mechanisms) {
    ASSERT_EQ(mechanism.moved_points.size(), 1U);
    movers.push_back(mechanism.moved_points[0]);
  }
  std::sort(movers.begin(), movers.end());
  EXPECT_EQ(movers, (std::vector<int>{9, 9, 10}));
  EXPECT_NE(warnings.back().message.find("moves without straining any link"), std::string::npos);
}

// To first order, a point of a chain may leave the line without changing its distances from the other points.
TEST(Mechanisms, EachMechanismOfAChainMovesOnePointRelativeToTwoPointsAtRest) {
  Scene scene;
  for (int i = 0; i < 4; ++i) add_point(scene, 1.0 + i, {0.5 * i, 0.0, 0.0});
  for (int i = 0; i < 3; ++i) add_link(scene, i, i + 1, Spring{100.0});
  const Structure structure = build(scene);
  ASSERT_EQ(structure.mechanisms.size(), 4U);
  for (const Mechanism& mechanism : structure.mechanisms) {
    ASSERT_EQ(mechanism.moved_points.size(), 1U);
    EXPECT_GE(mechanism.moved_points[0], 2);
  }
}

TEST(Mechanisms, SoftLinksAreNeverTakenForMechanisms) {
  Engine engine(5);
  Scene scene = spatial(engine);
  for (std::size_t i = 0; i < scene.links.size(); ++i)
    scene.links[i].kind = Spring{i % 2 == 0 ? 1e-15 : 1e12};
  const Structure structure = build(scene);
  EXPECT_TRUE(structure.mechanisms.empty());
  EXPECT_GT(structure.omega[0], 0.0);
}

TEST(Mechanisms, AStructureWithoutLinksHasOnlyMechanisms) {
  Scene scene;
  for (int i = 0; i < 4; ++i) add_point(scene, 1.0, {0.3 * i, 1.0 * i * i, i == 2 ? 1.0 : 0.0});
  const Structure structure = build(scene);
  EXPECT_EQ(structure.mechanisms.size(), 6U);
  EXPECT_TRUE(structure.omega.isZero(0.0));
}

// Points with a width of 1e-12 of the length are not on a line, but points with a width of the size of
// rounding errors are.
TEST(RigidFreedoms, PointsOnALineHaveFiveAndPointsJustOffALineHaveSix) {
  for (const double width : {1e-3, 1e-12, 0.0}) {
    Scene scene;
    for (int i = 0; i < 5; ++i)
      add_point(scene, i == 0 ? 1e6 : 1.0, {0.1 * i, i == 2 ? 0.5 * width : 0.0, 0.0});
    Faults faults;
    const MassProperties body = find_mass_properties(scene, faults);
    EXPECT_EQ(body.rigid_freedoms, width > 0.0 ? 6 : 5) << width;
    EXPECT_EQ(faults.size(), width == 1e-12 ? 1U : 0U) << width;
  }
  // the line is not parallel to a coordinate axis
  Scene scene;
  for (int i = 0; i < 9; ++i)
    add_point(scene, 1.0, Eigen::Vector3d(1.0, 2.0, 3.0) + 0.1 * i * Eigen::Vector3d(0.3, -0.7, 0.9));
  Faults faults;
  EXPECT_EQ(find_mass_properties(scene, faults).rigid_freedoms, 5);
  EXPECT_TRUE(faults.empty());
}

// A box of 8 equal masses at its corners has I_x = M (b^2 + c^2) / 4 for edges a, b, c.
TEST(MassPropertiesOfABox, HaveTheClosedForm) {
  Scene scene;
  for (int corner = 0; corner < 8; ++corner)
    add_point(scene, 0.5, {10.0 + (corner & 1) * 2.0, -3.0 + (corner & 2) * 1.5, (corner & 4) * 1.0});
  Faults faults;
  const MassProperties body = find_mass_properties(scene, faults);
  EXPECT_DOUBLE_EQ(body.mass, 4.0);
  EXPECT_TRUE(body.p_SB.isApprox(Eigen::Vector3d(11.0, -1.5, 2.0), 1e-15));
  EXPECT_TRUE(body.principal.isApprox(Eigen::Vector3d(4.0 + 9.0, 4.0 + 16.0, 9.0 + 16.0), 1e-14));
  EXPECT_TRUE(body.inertia.isApprox(Eigen::Vector3d(25.0, 20.0, 13.0).asDiagonal().toDenseMatrix(), 1e-14));
  EXPECT_NEAR(body.principal_axes.determinant(), 1.0, 1e-14);
}

TEST(FrequencyClusters, FrequenciesWithinTheGapAreInOneCluster) {
  const auto clusters = frequency_clusters(Eigen::Vector4d(1.0, 1.0 + 1e-10, 2.0, 3.0), 1e-9);
  ASSERT_EQ(clusters.size(), 3U);
  EXPECT_EQ(clusters[0].count, 2);
  EXPECT_EQ(clusters[2].first, 3);
}

}  // namespace
}  // namespace freeflex::testing
