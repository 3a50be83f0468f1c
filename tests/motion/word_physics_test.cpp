// The word beside the truth where one thing makes it wrong: each by the
// reference at true geometry, and the estimate within a factor of two of the
// true error.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "core/plan/make_plan.hpp"
#include "core/validity/judgement.hpp"
#include "tests/motion/rung_cases.hpp"

namespace freeflex::testing {
namespace {

int add_point(Scene &scene, double mass, const Eigen::Vector3d &at) {
  scene.points.push_back({"p" + std::to_string(scene.points.size()), mass, at, {}});
  return static_cast<int>(scene.points.size()) - 1;
}
void join(Scene &scene, std::vector<int> points, const LinkKind &kind) {
  Link link;
  link.name = "l" + std::to_string(scene.links.size());
  link.points = std::move(points);
  link.kind = kind;
  scene.links.push_back(link);
}

/// Displaces along elastic modes, counted from 1, all else at rest.
void ring(Scene &scene, const std::vector<std::pair<int, double>> &modes) {
  Faults faults;
  const auto structure = build_structure(scene, faults);
  scene.initial.points.clear();
  for (int i = 0; i < static_cast<int>(scene.points.size()); ++i) {
    Eigen::Vector3d V = Eigen::Vector3d::Zero();
    for (const auto &[mode, q] : modes)
      V += q * structure->shapes.block<3, 1>(
                   3 * i, static_cast<Eigen::Index>(structure->mechanisms.size()) + mode - 1);
    scene.initial.points.push_back({i, V, Eigen::Vector3d::Zero()});
  }
}

/// Error and estimate [-] of the larger scale.
struct Shares {
  double error = 0.0, estimate = 0.0;
  Verdict::Word word = Verdict::Word::kGood;
};
Shares shares_of(Scene scene, Fidelity rung, double end) {
  publish_everything(scene);
  scene.fidelity = rung;
  std::string fault;
  const auto system = make_true_geometry(scene, fault);
  EXPECT_TRUE(system) << fault;
  end = std::round(end * scene.rate) / scene.rate;
  const double times[] = {end};
  const ReferenceRun run = integrate(*system, times);
  EXPECT_EQ(run.error, "");
  Simulation simulation(scene);
  Judgement judgement(simulation.plan);
  Budget none;
  judgement.take(simulation.state, none);
  while (simulation.state.tick < std::llround(end * scene.rate)) {
    simulation.run(1);
    judgement.take(simulation.state, none);
  }
  const auto n = static_cast<Eigen::Index>(scene.points.size());
  Eigen::VectorXd mass(n);
  Eigen::Matrix3Xd rest(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    mass[i] = scene.points[static_cast<std::size_t>(i)].mass;
    rest.col(i) = scene.points[static_cast<std::size_t>(i)].position;
  }
  const auto size = [&](const Eigen::Matrix3Xd &V) {
    return std::sqrt((V.colwise().squaredNorm() * mass)(0) / mass.sum());
  };
  const Eigen::Matrix3Xd V = elastic_displacements(mass, rest, run.states.at(0).p_W);
  const Verdict &verdict = judgement.now();
  const double scale = std::max(verdict.scale, size(V));
  Shares shares{size(elastic_displacements(mass, rest, simulation.positions_W()) - V) / scale,
                verdict.error / verdict.scale, verdict.word};
  std::printf("%-11s %6.2f s: error %.2e of the scale, estimate %.2e, %s\n", name_of(rung), end, shares.error,
              shares.estimate, name_of(shares.word));
  return shares;
}
void expect_told(const Shares &shares) {
  EXPECT_GT(shares.estimate, 0.5 * shares.error);
  EXPECT_LT(shares.estimate, 2.0 * shares.error);
}

/// Two tetrahedra on a common edge, held against each other by a soft spring:
/// the hinge is the lowest mode by far.
Scene hinged_tetrahedra(double hinge) {
  Scene scene;
  const int a = add_point(scene, 1.0, {0.0, -0.5, 0.0}), b = add_point(scene, 1.0, {0.0, 0.5, 0.0});
  std::array<int, 2> tops{};
  for (const int side : {0, 1}) {
    const double x = side == 0 ? -1.0 : 1.0;
    const int end = add_point(scene, 1.0, {x, 0.1, 0.1 * x}),
              top = add_point(scene, 1.0, {0.6 * x, 0.0, 0.8});
    for (const int corner : {a, b}) {
      join(scene, {corner, end}, Spring{400.0});
      join(scene, {corner, top}, Spring{500.0});
    }
    join(scene, {end, top}, Spring{300.0});
    tops[static_cast<std::size_t>(side)] = top;
  }
  join(scene, {a, b}, Spring{600.0});
  join(scene, {tops[0], tops[1]}, Spring{hinge});
  scene.rate = 500.0;
  return scene;
}

TEST(WordPhysics, RingingDrivesASoftHinge) {
  Scene scene = hinged_tetrahedra(10.0);
  ring(scene, {{2, 3e-4}, {3, 3e-4}});
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kCoupled})
    expect_told(shares_of(scene, rung, 3.0));
  ring(scene, {{2, 3e-3}, {3, 3e-3}});
  const Shares large = shares_of(scene, Fidelity::kCoupled, 6.0);
  EXPECT_GT(large.error, 0.05);
  EXPECT_NE(large.word, Verdict::Word::kGood);
}

// a beam that is released about one axis at a bend: a mechanism that ringing of
// 1e-5 of the length drives
TEST(WordPhysics, RingingDrivesAFreeHinge) {
  Scene scene;
  for (int k = 0; k <= 2; ++k) add_point(scene, 1.0, {1.0 * k, 0.0, 0.0});
  add_point(scene, 1.0, {2.6, 0.5, 0.3});
  add_point(scene, 1.0, {3.1, 1.3, 0.2});
  for (int k = 0; k < 4; ++k) {
    Beam beam{.EA = 1e5, .GJ = 300.0, .EI_y = 400.0, .EI_z = 500.0, .y_axis = Eigen::Vector3d(0.0, 0.2, 1.0)};
    if (k == 2) beam.released[0][1] = true;
    join(scene, {k, k + 1}, beam);
  }
  scene.rate = 4000.0;
  ring(scene, {{2, 1e-5}});
  expect_told(shares_of(scene, Fidelity::kSeparated, 1.0));
  const Shares late = shares_of(scene, Fidelity::kCoupled, 20.0);
  EXPECT_GT(late.error, 0.05);
  EXPECT_NE(late.word, Verdict::Word::kGood);
}

/// Five points in a line, of which the springs of the angles bend: axial loads
/// do work on the bending.
Scene straight_chain() {
  Scene scene;
  for (int k = 0; k < 5; ++k) add_point(scene, 1.0, {1.0 * k, 0.0, 0.0});
  for (int k = 0; k < 4; ++k) join(scene, {k, k + 1}, Spring{3e5});
  for (int k = 0; k < 3; ++k) join(scene, {k, k + 1, k + 2}, BendingSpring{100.0});
  scene.rate = 2000.0;
  return scene;
}

// the load pulsates at the sum of two frequencies, or at twice one: they grow
// by each other
TEST(WordPhysics, AxialLoadsPulsateInResonance) {
  Scene scene = straight_chain();
  Faults faults;
  const auto structure = build_structure(scene, faults);
  // bending comes in pairs: the first, the third and so on of one plane
  for (const auto &[first, second] : {std::pair{0, 0}, {0, 2}}) {
    ring(scene, {{1, 1e-3}, {3, 5e-4}});
    Load load;
    load.axes = Axes::kBody;
    load.forces = {{0, {12.0, 0.0, 0.0}}, {4, {-12.0, 0.0, 0.0}}};
    load.history = SineHistory{(structure->omega[first] + structure->omega[second]) / (2.0 * M_PI), 0.0};
    scene.loads = {load};
    const Shares shares = shares_of(scene, Fidelity::kCoupled, 2.0);
    EXPECT_GT(shares.error, 0.01) << "else nothing is tried";
    expect_told(shares);
  }
}

// near the middle axis small errors of the attitude grow, and with them those
// of the centrifugal load
TEST(WordPhysics, TheAttitudeOfASpinAboutTheMiddleAxisIsOff) {
  Scene scene = hinged_tetrahedra(100.0);
  Faults faults;
  const auto structure = build_structure(scene, faults);
  const double lowest = structure->omega[static_cast<Eigen::Index>(structure->mechanisms.size())];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(structure->mass_properties.inertia);
  scene.initial.angular_velocity =
      0.08 * lowest * (axes.eigenvectors().col(1) + 0.2 * axes.eigenvectors().col(0));
  scene.damping.modal_ratio = 0.02;
  const double turn = 2.0 * M_PI / scene.initial.angular_velocity.norm();
  for (const double turns : {0.5, 2.0, 8.0, 25.0}) {
    const Shares shares = shares_of(scene, Fidelity::kSpinLoaded, turns * turn);
    EXPECT_GT(shares.estimate, 0.5 * shares.error) << turns;
  }
  EXPECT_EQ(shares_of(scene, Fidelity::kCoupled, 25.0 * turn).word, Verdict::Word::kGood);
}

// spin from rest: the error grows with the motion, and is nothing in the first
// ticks
TEST(WordPhysics, ASpinThatTheRungBendsByIsNotOutsideAtItsStart) {
  Scene scene = hinged_tetrahedra(100.0);
  scene.initial.angular_velocity = {0.05, 0.2, 0.1};
  scene.damping.modal_ratio = 0.02;
  EXPECT_EQ(shares_of(scene, Fidelity::kSpinLoaded, 0.02).word, Verdict::Word::kGood);
  EXPECT_NE(shares_of(scene, Fidelity::kSeparated, 1.0).word, Verdict::Word::kGood) << "it lacks the load";
}

}  // namespace
}  // namespace freeflex::testing
