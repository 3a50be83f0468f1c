// These tests check forces that rotate with the local deformation.
#include <gtest/gtest.h>

#include <cstdio>

#include "core/structure/links/link_factor.hpp"
#include "core/structure/structure.hpp"
#include "tests/motion/linear_system.hpp"
#include "tests/support/simulation.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

// Returns a free beam of five points. A thrust along the beam acts at one end and rotates with that end if
// `follows` is true.
Scene rocket(double thrust, bool follows) {
  Scene scene;
  for (int i = 0; i < 5; ++i) {
    PointMass point;
    point.name = "p" + std::to_string(i);
    point.mass = i == 0 || i == 4 ? 1.0 : 2.0;
    point.position = {0.5 * i, i == 2 ? 0.01 : 0.0, i == 3 ? 0.02 : 0.0};
    scene.points.push_back(point);
  }
  for (int i = 0; i < 4; ++i) {
    Link link;
    link.name = "b" + std::to_string(i);
    link.points = {i, i + 1};
    link.kind = Beam{1e6, 50.0, 80.0, 80.0, {0.0, 1.0, 0.0}};
    scene.links.push_back(link);
  }
  publish_everything(scene);
  scene.initial.points.push_back({2, {0.0, 1e-4, 0.0}, {0.0, 0.0, 0.0}});
  Load load;
  load.name = "thrust";
  load.axes = follows ? Axes::kLocal : Axes::kBody;
  load.forces = {{0, {thrust, 0.0, 0.0}}};
  scene.loads.push_back(load);
  return scene;
}

// If all points rotate rigidly, the local rotations equal that rotation, whether they come from joints, rigid
// bodies or neighbouring points.
TEST(LocalRotations, EqualARigidRotationOfAllPoints) {
  Scene beams = rocket(1.0, true);
  Scene truss = square_truss(3);
  Scene body = square_truss(3);
  Link rigid;
  rigid.name = "rigid";
  rigid.points = {4, 5, 6, 7};
  rigid.kind = Rigid{};
  body.links.push_back(rigid);
  const Eigen::Vector3d rotation(0.3, -0.2, 0.5);
  for (const auto& [scene, point] : {std::pair<Scene&, int>{beams, 0}, {beams, 2}, {truss, 5}, {body, 5}}) {
    Load load;
    load.name = "local";
    load.axes = Axes::kLocal;
    load.forces = {{point, {1.0, 0.0, 0.0}}};
    scene.loads = {load};
    Faults faults;
    const LinkFactor factor = factor_links(scene, true, faults);
    // a rigid rotation of all points is the only "mode"
    Structure structure;
    structure.shapes.resize(3 * static_cast<Eigen::Index>(scene.points.size()), 1);
    for (std::size_t i = 0; i < scene.points.size(); ++i)
      structure.shapes.block<3, 1>(3 * static_cast<Eigen::Index>(i), 0) =
          rotation.cross(scene.points[i].position);
    const auto rotations = local_rotations(scene, factor, structure);
    EXPECT_LT((rotations.at(point) - rotation).norm(), 1e-11) << point;
  }
}

// The elastic equations M q'' + (c + E) q = b (f + theta(q) x f) are linear, so a matrix exponential solves
// them exactly. The step agrees with that solution to second order. verdict_test checks E, the stiffness from
// the internal forces that the force itself causes.
TEST(Followers, TheElasticMotionUnderFollowerForcesHasSecondOrder) {
  Scene scene = rocket(4.0, true);
  Faults faults;
  const auto structure = build_structure(scene, faults);
  ASSERT_TRUE(structure);
  const Eigen::Index n = structure->omega.size();
  const Eigen::Vector3d f(4.0, 0.0, 0.0);
  WideMatrix A = WideMatrix::Zero(2 * n + 1, 2 * n + 1);
  A.topRightCorner(n + 1, n).topRows(n).setZero();
  A.block(0, n, n, n).setIdentity();
  const WideMatrix b = structure->shapes.topRows<3>().cast<long double>();
  const WideMatrix theta = structure->local_rotations.at(0).cast<long double>();
  Eigen::Matrix3d cross;  // theta x f = -[f] theta
  cross << 0.0, -f.z(), f.y(), f.z(), 0.0, -f.x(), -f.y(), f.x(), 0.0;
  const long double M = structure->mass_properties.mass;
  A.block(n, 0, n, n) = -b.transpose() * cross.cast<long double>() * theta / M;
  for (Eigen::Index l = 0; l < n; ++l)
    A(n + l, l) -= static_cast<long double>(structure->omega[l]) * structure->omega[l];
  const LoadStiffness& stiffness = structure->load_stiffness.back();
  ASSERT_EQ(stiffness.reference.item, 0);
  for (std::size_t l = 0; l < stiffness.modes.size(); ++l)
    for (std::size_t u = 0; u < stiffness.modes.size(); ++u)
      A(n + stiffness.modes[l], stiffness.modes[u]) -=
          static_cast<long double>(
              stiffness.rows(static_cast<Eigen::Index>(l), static_cast<Eigen::Index>(u))) /
          M;
  A.block(n, 2 * n, n, 1) = b.transpose() * f.cast<long double>() / M;

  std::vector<double> errors;
  double effect = 0.0;
  for (const double rate : {500.0, 1000.0, 2000.0, 4000.0}) {
    scene.rate = rate;
    Simulation simulation(scene), fixed([&] {
      Scene plain = rocket(4.0, false);
      plain.rate = rate;
      return plain;
    }());
    WideVector y = WideVector::Zero(2 * n + 1);
    for (Eigen::Index l = 0; l < n; ++l) y[l] = simulation.state.q[static_cast<std::size_t>(l)];
    y[2 * n] = 1.0L;
    const WideVector end = (0.5L * A).exp() * y;
    simulation.run(std::llround(0.5 * rate));
    fixed.run(std::llround(0.5 * rate));
    double error = 0.0, largest = 0.0;
    effect = 0.0;
    for (Eigen::Index l = 0; l < n; ++l) {
      const auto mode = static_cast<std::size_t>(l);
      error = std::max(error, std::abs(simulation.state.q[mode] - static_cast<double>(end[l])));
      effect = std::max(effect, std::abs(simulation.state.q[mode] - fixed.state.q[mode]));
      largest = std::max(largest, std::abs(simulation.state.q[mode]));
    }
    errors.push_back(error / largest);
    effect /= largest;
    std::printf("follower, h = %g s: error %.2e, its rotation matters by %.1e\n", 1.0 / rate, errors.back(),
                effect);
  }
  EXPECT_GT(effect, 1e-2);
  for (std::size_t k = 1; k < errors.size(); ++k)
    EXPECT_NEAR(std::log2(errors[k - 1] / errors[k]), 2.0, 0.2) << k;
}

// A follower pushes the body sideways on the coupled rungs as it does on lower rungs, although on the coupled
// rungs terms of second order in the deformation also act on the body.
TEST(Followers, AccelerateTheBodyEquallyOnCoupledAndLowerRungs) {
  const auto velocity = [](Fidelity rung, bool follows) {
    Scene scene = rocket(4.0, follows);
    scene.fidelity = rung;
    scene.rate = 4000.0;
    Simulation simulation(scene);
    simulation.run(400);
    return Eigen::Vector3d(simulation.state.v_WB.data());
  };
  const Eigen::Vector3d below = velocity(Fidelity::kSeparated, true);
  const double effect = (below - velocity(Fidelity::kSeparated, false)).norm();
  for (const Fidelity rung : {Fidelity::kCoupled, Fidelity::kCorotational}) {
    const double difference = (velocity(rung, true) - below).norm();
    std::printf("velocity due to the rotation of the force %.1e m/s, on a coupled rung off by %.1e\n", effect,
                difference);
    EXPECT_LT(difference, 0.01 * effect) << "measured 7e-4";
  }
}

// A thrust that rotates with the bent end also rotates the body, because the resultant and the moment of the
// thrust are those of the rotated force.
TEST(Followers, FollowerForcesPushTheBodyAlongTheirRotatedDirection) {
  Scene scene = rocket(4.0, true);
  Simulation simulation(scene);
  simulation.run(100);
  const PlanFollower& follower = simulation.plan.histories[0].followers[0];
  const auto n = static_cast<std::size_t>(simulation.plan.num_padded);
  Eigen::Vector3d theta = Eigen::Vector3d::Zero();
  for (std::size_t l = 0; l < n; ++l)
    for (std::size_t a = 0; a < 3; ++a)
      theta[static_cast<Eigen::Index>(a)] += follower.rotation_rows[a * n + l] * simulation.state.q[l];
  EXPECT_GT(theta.norm(), 1e-6);
  const Eigen::Vector3d force = Eigen::Vector3d(4.0, 0.0, 0.0) + theta.cross(Eigen::Vector3d(4.0, 0.0, 0.0));
  const Eigen::Vector3d r(follower.r.data());
  const Eigen::Vector3d moment = r.cross(force);
  // the moment at the end of the step uses the deformation of the first pass, so it differs from the expected
  // moment by the change in the second pass, which is of order h^2
  for (std::size_t a = 0; a < 3; ++a)
    EXPECT_NEAR(simulation.state.moment_B[a], moment[static_cast<Eigen::Index>(a)],
                1e-6 * theta.norm() * 4.0);
}

}  // namespace
}  // namespace freeflex::testing
