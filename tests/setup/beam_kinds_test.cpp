// These tests check beams with shear, with releases, and built into rigid bodies. They also check flexibility
// matrices as input.
#include <Eigen/LU>
#include <cmath>

#include "core/structure/links/link_factor.hpp"
#include "core/structure/structure.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

Eigen::MatrixXd stiffness_of(const Scene& scene) {
  Faults faults;
  const LinkFactor factor = factor_links(scene, false, faults);
  EXPECT_TRUE(faults.empty());
  return factor.rows.transpose() * factor.rows;
}

constexpr double kEIy = 3e3, kEIz = 5e3, kGAy = 8e4, kGAz = 6e4;

Beam with_shear() { return {1e7, 1e4, kEIy, kEIz, {0.0, 1.0, 0.0}, kGAy, kGAz}; }

// S. Timoshenko, Strength of Materials I, section 39: the middle of a simply supported beam deflects by
// w = F L^3 / 48 EI + F L / 4 k G A.
TEST(TimoshenkoBeams, DeflectByBendingAndShear) {
  Scene scene;
  for (int i = 0; i < 3; ++i) add_point(scene, 1.0, {0.7 * i, 0.0, 0.0});
  for (int i = 0; i < 2; ++i) add_link(scene, i, i + 1, with_shear());
  const Eigen::MatrixXd K = stiffness_of(scene);
  const double L = 1.4;
  EXPECT_NEAR(1.0 / K(4, 4), L * L * L / (48.0 * kEIz) + L / (4.0 * kGAy), 1e-13 / K(4, 4));
  EXPECT_NEAR(1.0 / K(5, 5), L * L * L / (48.0 * kEIy) + L / (4.0 * kGAz), 1e-13 / K(5, 5));
}

// A free beam with the masses 1/4, 1/2, 1/4 and L = EI = 1 has omega^2 = 4 / (L^3 / 48 EI + L / 4 k G A),
// which is 192 without shear.
TEST(TimoshenkoBeams, VibrateMoreSlowlyWithShear) {
  Scene scene = lumped_beam(3);
  for (const double GA : {0.0, 1e4, 10.0, 1.0}) {
    for (Link& link : scene.links) {
      std::get<Beam>(link.kind).GA_y = GA;
      std::get<Beam>(link.kind).GA_z = GA;
    }
    const double shear = GA > 0.0 ? 1.0 / (4.0 * GA) : 0.0;
    EXPECT_NEAR(build(scene).omega[0], std::sqrt(4.0 / (1.0 / 48.0 + shear)), 1e-12 * 14.0) << GA;
  }
}

// Returns a rigid body of four points with a beam built into one of them.
Scene cantilever(const Beam& beam) {
  Scene scene;
  add_point(scene, 1e3, {0.0, 0.0, 0.0});
  add_point(scene, 1e3, {-1.0, 0.2, 0.0});
  add_point(scene, 1e3, {0.1, -1.0, 0.3});
  add_point(scene, 1e3, {0.0, 0.1, -1.0});
  add_point(scene, 1.0, {2.0, 0.0, 0.0});
  Link body;
  body.name = "body";
  body.points = {0, 1, 2, 3};
  body.kind = Rigid{};
  scene.links.push_back(body);
  add_link(scene, 0, 4, beam);
  return scene;
}

// w = F L^3 / 3 EI + F L / k G A at the tip of a cantilever.
TEST(TimoshenkoBeams, BendLikeCantileversIfBuiltIntoARigidBody) {
  const Eigen::MatrixXd K = stiffness_of(cantilever(with_shear()));
  EXPECT_NEAR(1.0 / K(13, 13), 8.0 / (3.0 * kEIz) + 2.0 / kGAy, 1e-12 / K(13, 13));
  EXPECT_NEAR(1.0 / K(14, 14), 8.0 / (3.0 * kEIy) + 2.0 / kGAz, 1e-12 / K(14, 14));
  Beam slender = with_shear();
  slender.GA_y = slender.GA_z = 0.0;
  const Eigen::MatrixXd euler = stiffness_of(cantilever(slender));
  EXPECT_NEAR(1.0 / euler(13, 13), 8.0 / (3.0 * kEIz), 1e-12 / euler(13, 13));
}

TEST(Releases, AReleaseHingesABeamOnlyAboutItsAxis) {
  Beam hinged = with_shear();
  hinged.released[0][2] = true;  // the release is about local z, so deflection along y is free
  const Scene scene = cantilever(hinged);
  const Eigen::MatrixXd K = stiffness_of(scene);
  EXPECT_NEAR(K(13, 13), 0.0, 1e-12 * K(14, 14));
  EXPECT_NEAR(1.0 / K(14, 14), 8.0 / (3.0 * kEIy) + 2.0 / kGAz, 1e-12 / K(14, 14));
  const Structure structure = build(scene);
  EXPECT_EQ(structure.mechanisms.size(), 1u);
}

// A second beam continues a cantilever. At its released end the bending moments are zero, but the force is
// not.
TEST(Releases, AReleasedEndCarriesNoBendingMoment) {
  Scene scene = cantilever(with_shear());
  add_point(scene, 1.0, {3.0, 1.0, 0.5});
  Beam released = with_shear();
  released.y_axis = {0.0, 0.0, 1.0};
  released.released[0] = {false, true, true};
  add_link(scene, 4, 5, released);
  scene.publication.links = {2};
  const Structure structure = build(scene);
  const LinkForceRows& force = structure.link_forces[0];
  const double largest = force.rows.cwiseAbs().maxCoeff();
  EXPECT_LT(force.rows.row(4).cwiseAbs().maxCoeff(), 1e-12 * largest);
  EXPECT_LT(force.rows.row(5).cwiseAbs().maxCoeff(), 1e-12 * largest);
  EXPECT_GT(force.rows.row(0).cwiseAbs().maxCoeff(), 1e-3 * largest);
}

TEST(Releases, AFrameWithPinnedEndsHasTheFrequenciesOfTheTrussOfItsBars) {
  Scene truss = square_truss(4);
  Scene frame = truss;
  for (std::size_t i = 0; i < truss.links.size(); ++i) {
    truss.links[i].kind = Bar{2e5};
    Beam beam{2e5, 1e4, 3e4, 5e4, Eigen::Vector3d::Zero()};
    beam.released = {{{true, true, true}, {true, true, true}}};
    frame.links[i].kind = beam;
  }
  frame.publication.links.clear();
  truss.publication.links.clear();
  const Structure a = build(truss), b = build(frame);
  ASSERT_EQ(a.omega.size(), b.omega.size());
  EXPECT_TRUE(b.mechanisms.empty());
  for (Eigen::Index k = 0; k < a.omega.size(); ++k)
    EXPECT_NEAR(b.omega[k], a.omega[k], 1e-12 * a.omega[k]) << k;
}

// Returns the displacements per force of a truss that is held at six chosen freedoms, as one would measure or
// compute them.
Eigen::MatrixXd flexibility(const Scene& truss, const std::vector<int>& held) {
  const Eigen::MatrixXd K = stiffness_of(truss);
  std::vector<int> free;
  for (int i = 0; i < K.rows(); ++i)
    if (std::find(held.begin(), held.end(), i) == held.end()) free.push_back(i);
  const Eigen::MatrixXd reduced = K(free, free);
  Eigen::MatrixXd F = Eigen::MatrixXd::Zero(K.rows(), K.cols());
  const Eigen::MatrixXd inverse = reduced.inverse();
  F(free, free) = inverse;
  return 0.5 * (F + F.transpose());
}

Scene described_by(const Scene& truss, const Eigen::MatrixXd& F) {
  Scene scene = truss;
  scene.links.clear();
  scene.publication.links.clear();
  Link link;
  link.name = "measured";
  for (std::size_t i = 0; i < truss.points.size(); ++i) link.points.push_back(static_cast<int>(i));
  link.kind = MatrixLink{F.sparseView(), true};
  scene.links.push_back(link);
  return scene;
}

TEST(Flexibility, AFlexibilityMatrixDescribesTheStructureForAnySupports) {
  const Scene truss = square_truss(3);
  const Structure exact = build(truss);
  // one corner is held in three directions, its neighbour along y in two, and its neighbour along z in one
  for (const std::vector<int>& held :
       {std::vector<int>{0, 1, 2, 3, 5, 9}, std::vector<int>{33, 34, 35, 30, 32, 24}}) {
    const Structure measured = build(described_by(truss, flexibility(truss, held)));
    EXPECT_EQ(measured.mass_properties.rigid_freedoms, 6);
    EXPECT_TRUE(measured.mechanisms.empty());
    ASSERT_EQ(measured.omega.size(), exact.omega.size());
    // the condition number of this flexibility matrix costs about five digits
    for (Eigen::Index k = 0; k < exact.omega.size(); ++k)
      EXPECT_NEAR(measured.omega[k], exact.omega[k], 1e-10 * exact.omega[k]) << k;
  }
}

TEST(Flexibility, TheMostAsymmetricEntryOfAMatrixIsReported) {
  const Scene truss = square_truss(2);
  Eigen::MatrixXd F = flexibility(truss, {0, 1, 2, 3, 5, 9});
  F(10, 20) *= 1.5;
  Faults faults;
  EXPECT_FALSE(build_structure(described_by(truss, F), faults));
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_NE(faults[0].message.find("the flexibility matrix is not symmetric"), std::string::npos)
      << faults[0].message;
  // row 10 is point 3 along y, and column 20 is point 6 along z
  EXPECT_NE(faults[0].message.find("The worst are the entries of point 'p6' z by point 'p3' y"),
            std::string::npos)
      << faults[0].message;
}

TEST(Flexibility, AMatrixThatIsNotPositiveDefiniteIsRefused) {
  const Scene truss = square_truss(2);
  Eigen::MatrixXd F = flexibility(truss, {0, 1, 2, 3, 5, 9});
  F.row(23).setZero();
  F.col(23).setZero();
  F(23, 23) = -1e-6;
  Faults faults;
  EXPECT_FALSE(build_structure(described_by(truss, F), faults));
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_NE(faults[0].message.find("the flexibility matrix is not positive definite"), std::string::npos)
      << faults[0].message;
  EXPECT_NE(faults[0].message.find(truss.points[7].name + "' z"), std::string::npos) << faults[0].message;
}

}  // namespace
}  // namespace freeflex::testing
