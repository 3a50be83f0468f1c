// These tests compare the stiffness of beams with the textbook matrix, and check closed forms and the
// equilibrium of end forces.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "core/scene/link_kinds.hpp"
#include "core/structure/links/link_factor.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {
namespace {

using Matrix12 = Eigen::Matrix<double, 12, 12>;

// Returns the stiffness of a beam in its local axes, with freedoms u v w and three rotations at each end
// (Przemieniecki 1968, section 5.6, without shear).
Matrix12 textbook_stiffness(const Beam& beam, double L) {
  Matrix12 k = Matrix12::Zero();
  const auto set = [&](int i, int j, double value) { k(i, j) = k(j, i) = value; };
  for (const int at : {0, 3}) {
    const double value = (at == 0 ? beam.EA : beam.GJ) / L;
    set(at, at, value);
    set(at + 6, at + 6, value);
    set(at, at + 6, -value);
  }
  const auto bend = [&](int v, int rotation, double EI, double sign) {
    set(v, v, 12.0 * EI / (L * L * L));
    set(v + 6, v + 6, 12.0 * EI / (L * L * L));
    set(v, v + 6, -12.0 * EI / (L * L * L));
    set(v, rotation, sign * 6.0 * EI / (L * L));
    set(v, rotation + 6, sign * 6.0 * EI / (L * L));
    set(v + 6, rotation, -sign * 6.0 * EI / (L * L));
    set(v + 6, rotation + 6, -sign * 6.0 * EI / (L * L));
    set(rotation, rotation, 4.0 * EI / L);
    set(rotation + 6, rotation + 6, 4.0 * EI / L);
    set(rotation, rotation + 6, 2.0 * EI / L);
  };
  bend(1, 5, beam.EI_z, 1.0);
  bend(2, 4, beam.EI_y, -1.0);
  return k;
}

// Returns a space frame with one closed loop. No two beams are in line, and the four stiffnesses of each beam
// differ from each other.
Scene space_frame() {
  Scene scene;
  add_point(scene, 1.0, {0.0, 0.0, 0.0});
  add_point(scene, 2.0, {1.0, 0.2, 0.0});
  add_point(scene, 3.0, {1.1, 1.3, 0.4});
  add_point(scene, 1.5, {0.2, 0.9, -0.3});
  add_point(scene, 0.5, {0.3, 0.4, 1.7});
  const Beam beam{5e6, 2e3, 3e3, 7e3, {0.3, 0.1, 1.0}};
  add_link(scene, 0, 1, beam);
  add_link(scene, 1, 2, beam);
  add_link(scene, 2, 3, Beam{4e6, 1e3, 9e3, 2e3, {0.0, 0.0, 0.0}});
  add_link(scene, 3, 0, beam);
  add_link(scene, 0, 4, Beam{1e6, 8e3, 4e3, 6e3, {1.0, 0.0, 0.0}});
  scene.publication.links = {0, 1, 2, 3, 4};
  return scene;
}

// Returns the textbook stiffness of the displacements. The rotations are eliminated by Cholesky.
Eigen::MatrixXd condensed_textbook(const Scene& scene) {
  const auto n = 3 * static_cast<Eigen::Index>(scene.points.size());
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(2 * n, 2 * n);
  for (const Link& link : scene.links) {
    const Eigen::Vector3d span = scene.points[static_cast<std::size_t>(link.points[1])].position -
                                 scene.points[static_cast<std::size_t>(link.points[0])].position;
    const Eigen::Matrix3d axes = axes_of(scene, link);
    Matrix12 R = Matrix12::Zero();
    for (int block = 0; block < 4; ++block) R.block<3, 3>(3 * block, 3 * block) = axes.transpose();
    const Matrix12 k = R.transpose() * textbook_stiffness(std::get<Beam>(link.kind), span.norm()) * R;
    std::vector<Eigen::Index> freedoms;
    for (const int point : link.points)
      for (const Eigen::Index first : {3 * point + Eigen::Index{0}, n + 3 * point})
        for (Eigen::Index axis = 0; axis < 3; ++axis) freedoms.push_back(first + axis);
    K(freedoms, freedoms) += k;
  }
  const Eigen::MatrixXd K_tv = K.bottomLeftCorner(n, n);
  return K.topLeftCorner(n, n) - K_tv.transpose() * K.bottomRightCorner(n, n).ldlt().solve(K_tv);
}

TEST(Beams, TheCondensedFactorEqualsTheCondensedTextbookStiffness) {
  const Scene scene = space_frame();
  Faults faults;
  const LinkFactor factor = factor_links(scene, false, faults);
  const Eigen::MatrixXd expected = condensed_textbook(scene);
  // Cholesky on the assembled matrix loses digits in proportion to its condition number, EA L^2 / EI of about
  // 1e3
  EXPECT_LT((factor.rows.transpose() * factor.rows - expected).norm(), 1e-12 * expected.norm());
}

TEST(Beams, ASimplySupportedBeamHasTheClosedFormStiffness) {
  Scene scene;
  for (const double x : {0.0, 0.7, 1.4}) add_point(scene, 1.0, {x, 0.0, 0.0});
  for (int i = 0; i < 2; ++i) add_link(scene, i, i + 1, Beam{1e7, 1e4, 3.0e3, 5.0e3, {0.0, 1.0, 0.0}});
  Faults faults;
  const LinkFactor factor = factor_links(scene, false, faults);
  const Eigen::MatrixXd K = factor.rows.transpose() * factor.rows;
  const double L3 = 1.4 * 1.4 * 1.4;
  EXPECT_NEAR(K(4, 4), 48.0 * 5.0e3 / L3, 1e-13 * K(4, 4));  // bending along y has EI_z
  EXPECT_NEAR(K(5, 5), 48.0 * 3.0e3 / L3, 1e-13 * K(5, 5));  // bending along z has EI_y
  EXPECT_NEAR(K(3, 3), 2.0 * 1e7 / 0.7, 1e-13 * K(3, 3));
}

TEST(Beams, ACollinearChainLosesItsFreeRotationButKeepsEveryMode) {
  const Structure chain = build(lumped_beam(6));
  EXPECT_EQ(chain.mass_properties.rigid_freedoms, 5);
  EXPECT_EQ(chain.omega.size(), 13);
  EXPECT_TRUE(chain.mechanisms.empty());
  EXPECT_GT(chain.omega[0], 1.0);
}

// Returns the force and moment that an end of a beam exerts on its point, in scene axes.
Eigen::Matrix<double, 6, 1> end_force(const Scene& scene, const LinkForceRows& force,
                                      const Eigen::VectorXd& q, int end) {
  const Eigen::VectorXd all = force.rows * q;
  const Eigen::Matrix3d axes = axes_of(scene, scene.links[static_cast<std::size_t>(force.link)]);
  Eigen::Matrix<double, 6, 1> in_scene;
  in_scene << axes * all.segment<3>(6 * end), axes * all.segment<3>(6 * end + 3);
  return in_scene;
}

TEST(Beams, EndForcesBalanceEachBeamEachJointAndTheStiffness) {
  const Scene scene = space_frame();
  const Structure structure = build(scene);
  Faults faults;
  const LinkFactor factor = factor_links(scene, false, faults);
  std::mt19937_64 engine(3);
  std::normal_distribution<double> normal;
  Eigen::VectorXd q(structure.omega.size());
  for (double& each : q) each = 1e-3 * normal(engine);
  const Eigen::VectorXd V = structure.shapes * q;

  Eigen::VectorXd point_force = Eigen::VectorXd::Zero(15), joint_moment = Eigen::VectorXd::Zero(15);
  double largest = 0.0;
  for (const LinkForceRows& force : structure.link_forces) {
    const Link& link = scene.links[static_cast<std::size_t>(force.link)];
    const auto first = end_force(scene, force, q, 0), second = end_force(scene, force, q, 1);
    const Eigen::Vector3d span = scene.points[static_cast<std::size_t>(link.points[1])].position -
                                 scene.points[static_cast<std::size_t>(link.points[0])].position;
    largest = std::max({largest, first.norm(), second.norm()});
    EXPECT_LT((first.head<3>() + second.head<3>()).norm(), 1e-12 * first.norm());
    const Eigen::Vector3d lever = span.cross(second.head<3>());
    EXPECT_LT((first.tail<3>() + second.tail<3>() + lever).norm(), 1e-12 * (first.norm() + lever.norm()));
    point_force.segment<3>(3 * link.points[0]) += first.head<3>();
    point_force.segment<3>(3 * link.points[1]) += second.head<3>();
    joint_moment.segment<3>(3 * link.points[0]) += first.tail<3>();
    joint_moment.segment<3>(3 * link.points[1]) += second.tail<3>();
  }
  // no moment acts on a joint, so the moments of the beams at this joint cancel, and the forces of all beams
  // together hold the points at V
  EXPECT_LT(joint_moment.norm(), 1e-11 * largest);
  EXPECT_LT((point_force - factor.rows.transpose() * (factor.rows * V)).norm(), 1e-11 * largest);
}

TEST(Beams, TheAxialForceOfAStretchedBeamIsPositiveAtItsSecondEnd) {
  Scene scene;
  add_point(scene, 1.0, {0.0, 0.0, 0.0});
  add_point(scene, 1.0, {2.0, 0.0, 0.0});
  add_link(scene, 0, 1, Beam{6e5, 1e3, 1e3, 1e3, {0.0, 1.0, 0.0}});
  add_link(scene, 0, 1, Bar{4e5});
  add_link(scene, 1, 0, Spring{7e4});
  scene.publication.links = {0, 1, 2};
  const Structure structure = build(scene);
  // the only elastic mode stretches the beam by 1 mm
  const double stretch = structure.shapes(3, 0) - structure.shapes(0, 0);
  const Eigen::VectorXd q = Eigen::VectorXd::Constant(1, 1e-3 / stretch);
  const Eigen::VectorXd beam = structure.link_forces[0].rows * q;
  EXPECT_NEAR(beam[0], -300.0, 1e-11);
  EXPECT_NEAR(beam[6], 300.0, 1e-11);
  EXPECT_NEAR((structure.link_forces[1].rows * q)[0], 200.0, 1e-11);
  EXPECT_NEAR((structure.link_forces[2].rows * q)[0], 70.0, 1e-12);
}

}  // namespace
}  // namespace freeflex::testing
