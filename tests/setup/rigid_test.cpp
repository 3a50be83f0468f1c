// These tests check which freedoms rigid links and rigid bodies remove, the limit of stiff springs,
// redundancy, and which forces these links and bodies carry.
#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>

#include "core/plan/compile.hpp"
#include "core/plan/file/plan_bytes.hpp"
#include "core/structure/structure.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

void add_rigid(Scene& scene, std::vector<int> points, const std::string& name) {
  Link link;
  link.name = name;
  link.points = std::move(points);
  link.kind = Rigid{};
  scene.links.push_back(link);
}

// Returns a braced cube of springs. Two edges of the cube have the given stiffness, or are rigid if it is 0.
Scene cube(double stiffness) {
  Scene scene;
  std::mt19937_64 engine(11);
  std::uniform_real_distribution<double> jitter(-0.1, 0.1), mass(0.5, 2.0);
  for (int i = 0; i < 8; ++i)
    add_point(scene, mass(engine),
              {(i & 1) + jitter(engine), ((i >> 1) & 1) + jitter(engine), (i >> 2) + jitter(engine)});
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < i; ++j) {
      const bool is_edge = i == 1 || (i == 7 && j == 3);  // the two edges have no common point
      if (is_edge && stiffness == 0.0)
        add_rigid(scene, {i, j}, "r" + std::to_string(i) + std::to_string(j));
      else
        add_link(scene, i, j, Spring{is_edge ? stiffness : 1e4});
    }
  return scene;
}

TEST(RigidLinks, EachRigidLinkRemovesOneFreedom) {
  const Structure rigid = build(cube(0.0));
  EXPECT_EQ(rigid.num_constraints, 2);
  EXPECT_EQ(rigid.omega.size(), 3 * 8 - 6 - 2);
  EXPECT_TRUE(rigid.mechanisms.empty());
}

// Over nine decades, frequencies with stiff springs approach the rigid limit from below in proportion to 1 /
// stiffness.
TEST(RigidLinks, AreTheLimitOfStiffSprings) {
  const Structure limit = build(cube(0.0));
  double softer = 0.0;
  for (int decade = 0; decade < 9; ++decade) {
    const double stiffness = std::pow(10.0, 7 + decade);
    const Structure stiff = build(cube(stiffness));
    const Eigen::VectorXd low = stiff.omega.head(limit.omega.size());
    const double error = ((low - limit.omega).array() / limit.omega.array()).abs().maxCoeff();
    std::printf("stiffness %.0e: relative difference %.3e, times stiffness ratio %.3f\n", stiffness, error,
                error * stiffness / 1e4);
    // the difference is of first order in 1 / stiffness, second-order terms are a few times the square of the
    // difference, and both sides have rounding errors
    const double ratio = 1e4 / stiffness;
    if (decade > 0) {
      EXPECT_NEAR(softer / error, 10.0, 10.0 * (300.0 * ratio + 30.0 * 2.3e-16 / error)) << decade;
    }
    softer = error;
  }
}

TEST(RigidLinks, AFullyRigidStructureHasNoElasticCoordinateAndAConsistentPlan) {
  Scene scene = cube(0.0);
  scene.links.clear();
  add_rigid(scene, {0, 1, 2, 3, 4, 5, 6, 7}, "body");
  const Structure structure = build(scene);
  EXPECT_EQ(structure.num_constraints, 3 * 8 - 6);
  EXPECT_EQ(structure.omega.size(), 0);
  scene.initial.angular_velocity = {0.1, 0.2, 0.3};
  const Plan plan = compile(scene);
  EXPECT_EQ(plan.num_elastic, 0);
  EXPECT_EQ(find_inconsistency(plan), "");
}

// 1 kg and 2 kg at one position of a rigid body equal 3 kg there, whatever the order of the points.
TEST(RigidBodies, ARigidBodyMayHaveCoincidentPointsInAnyOrder) {
  const auto with = [](const std::vector<double>& masses_at_corner, const std::vector<int>& body) {
    Scene scene;
    for (const Eigen::Vector3d& at : {Eigen::Vector3d(1.0, 0.1, 0.0), Eigen::Vector3d(0.2, 1.0, 0.3)})
      add_point(scene, 1.5, at);
    add_point(scene, 2.0, {0.3, 0.4, 1.0});
    add_point(scene, 0.7, {-0.5, 0.6, 0.8});
    for (const double mass : masses_at_corner) add_point(scene, mass, {0.0, 0.0, 0.0});
    add_rigid(scene, body, "body");
    for (const auto& [i, j] : {std::pair{0, 2}, {1, 2}, {4, 2}, {0, 3}, {1, 3}, {4, 3}, {2, 3}})
      add_link(scene, i, j, Spring{1e3 + 10.0 * i});
    return scene;
  };
  const Structure whole = build(with({3.0}, {0, 1, 4}));
  ASSERT_EQ(whole.omega.size(), 3 * 5 - 6 - 3);
  for (const std::vector<int>& body :
       {std::vector<int>{4, 5, 0, 1}, {4, 0, 5, 1}, {0, 4, 1, 5}, {5, 4, 1, 0}}) {
    const Structure split = build(with({1.0, 2.0}, body));
    ASSERT_EQ(split.omega.size(), whole.omega.size());
    // the bound allows a few rounding errors
    EXPECT_LT(((split.omega - whole.omega).array() / whole.omega.array()).abs().maxCoeff(), 1e-13);
  }
  Faults faults;
  EXPECT_FALSE(build_structure(with({1.0, 2.0, 4.0}, {4, 5, 6}), faults));
  EXPECT_NE(faults[0].message.find("link 'body' has all its points in one place"), std::string::npos)
      << faults[0].message;
}

TEST(RigidLinks, RedundantRigidLinksAreFoundAndReported) {
  Scene scene;
  add_point(scene, 1.0, {0.0, 0.0, 0.0});
  add_point(scene, 1.0, {1.0, 0.0, 0.0});
  add_point(scene, 1.0, {0.0, 1.0, 0.0});
  add_rigid(scene, {0, 1}, "ab");
  add_rigid(scene, {1, 2}, "bc");
  add_rigid(scene, {2, 0}, "ca");
  add_rigid(scene, {0, 1}, "again");
  Faults warnings;
  const Structure structure = build(scene, &warnings);
  EXPECT_EQ(structure.num_constraints, 3);
  EXPECT_EQ(structure.omega.size(), 0);
  ASSERT_EQ(warnings.size(), 1u);
  // either of two equal links may be reported as redundant
  EXPECT_TRUE(warnings[0].message.find(
                  "rigid link 'again' is redundant, because a freedom that it removes is removed by 'ab'") !=
                  std::string::npos ||
              warnings[0].message.find(
                  "rigid link 'ab' is redundant, because a freedom that it removes is removed by 'again'") !=
                  std::string::npos)
      << warnings[0].message;
}

// Rigid links fix all six distances of four points in a plane. One link is redundant, and the loop contains
// all six.
TEST(RigidLinks, AllLinksOfARigidSquareWithBothDiagonalsAreReported) {
  Scene scene;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}})
    add_point(scene, 1.0, {x, y, 0.0});
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < i; ++j) add_rigid(scene, {i, j}, "r" + std::to_string(i) + std::to_string(j));
  Faults warnings;
  const Structure structure = build(scene, &warnings);
  EXPECT_EQ(structure.num_constraints, 5);
  // no link resists warping of the square out of its plane
  EXPECT_EQ(structure.omega.size(), 1);
  EXPECT_EQ(structure.mechanisms.size(), 1u);
  ASSERT_GE(warnings.size(), 1u);
  int named = 0;
  for (const char* name : {"'r10'", "'r20'", "'r21'", "'r30'", "'r31'", "'r32'"})
    if (warnings[0].message.find(name) != std::string::npos) ++named;
  EXPECT_EQ(named, 6) << warnings[0].message;
}

// Beams that end at a rigid body are clamped to it, as if very stiff beams replaced the body.
TEST(RigidBodies, ARigidBodyClampsTheRotationsOfItsBeams) {
  const auto scene_of = [](bool is_rigid) {
    Scene scene;
    add_point(scene, 5.0, {0.0, 0.0, 0.0});
    add_point(scene, 3.0, {0.4, 0.0, 0.0});
    add_point(scene, 4.0, {0.0, 0.5, 0.0});
    add_point(scene, 2.0, {0.1, 0.1, 0.6});
    add_point(scene, 1.0, {2.0, 0.1, 0.0});
    add_point(scene, 1.5, {0.1, 2.2, 0.3});
    const double stiff = 1e6;
    if (is_rigid)
      add_rigid(scene, {0, 1, 2, 3}, "hub");
    else
      for (int i = 0; i < 4; ++i)
        for (int j = 0; j < i; ++j)
          add_link(scene, i, j,
                   Beam{stiff * 1e5, stiff * 1e3, stiff * 1e3, stiff * 1e3, Eigen::Vector3d::Zero()});
    add_link(scene, 1, 4, Beam{1e5, 2e2, 3e2, 4e2, Eigen::Vector3d::Zero()});
    add_link(scene, 2, 5, Beam{1e5, 2e2, 3e2, 4e2, Eigen::Vector3d::Zero()});
    return scene;
  };
  const Structure rigid = build(scene_of(true)), stiff = build(scene_of(false));
  ASSERT_EQ(rigid.omega.size(), 3 * 6 - 6 - 6);
  EXPECT_TRUE(rigid.mechanisms.empty());
  for (Eigen::Index k = 0; k < rigid.omega.size(); ++k)
    EXPECT_NEAR(stiff.omega[k], rigid.omega[k], 1e-5 * rigid.omega[k]) << k;  // ten times the stiffness ratio
}

}  // namespace
}  // namespace freeflex::testing
