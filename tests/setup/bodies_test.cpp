// These tests compare bodies with inertia, and massless points, with closed forms, a published beam, and the
// same structures made of point masses.
#include "core/scene/bodies.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/structure/masses/particles.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {
namespace {

constexpr double kTwoPi = 2.0 * M_PI;

int add_body(Scene& scene, double mass, const Eigen::Vector3d& at, const Eigen::Matrix3d& inertia,
             const Eigen::Vector3d& offset = Eigen::Vector3d::Zero()) {
  const int point = add_point(scene, mass, at);
  scene.points.back().inertia = inertia;
  scene.points.back().offset = offset;
  return point;
}

Eigen::Matrix3d diagonal(double x, double y, double z) { return Eigen::Vector3d(x, y, z).asDiagonal(); }

double largest_difference(const Eigen::VectorXd& omega, const Eigen::VectorXd& expected) {
  EXPECT_EQ(omega.size(), expected.size());
  if (omega.size() != expected.size()) return HUGE_VAL;
  return ((omega - expected).array() / expected.array()).abs().maxCoeff();
}

// NASTRAN-95 demonstration problem 12-1-1. The published frequencies, 81.85413, 512.7766, 1435.909 and
// 2815.451 Hz, come from a reduction to 11 points. The frequencies that are checked here are those of all 101
// points. Without the inertia the first frequency would be 358.8 Hz.
TEST(Bodies, AFreeBeamWithAHeavyRotaryEndHasThePublishedFrequencies) {
  constexpr double kE = 10.4e6, kI = 0.083, kLength = 20.0, kDensity = 0.2523e-3;
  constexpr int kSpans = 100;
  Scene scene;
  for (int i = 0; i <= kSpans; ++i) {
    const double share = kDensity * kLength / kSpans * (i == 0 || i == kSpans ? 0.5 : 1.0);
    add_point(scene, share, {kLength * i / kSpans, 0.0, 0.0});
  }
  scene.points[0].mass += 10.0;
  scene.points[0].inertia = diagonal(1666.66, 1666.66, 1666.66);
  for (int i = 0; i < kSpans; ++i)
    add_link(scene, i, i + 1, Beam{kE, 1e6, kE * kI, kE * kI, {0.0, 1.0, 0.0}});
  const Structure structure = build(scene);
  for (const double published : {81.85407, 512.7597, 1435.544, 2812.775}) {
    // each frequency occurs twice, for bending in two planes
    const auto count = ((structure.omega.array() / kTwoPi - published).abs() < 1e-6 * published).count();
    EXPECT_EQ(count, 2) << published;
  }
  EXPECT_GT(structure.omega[0], kTwoPi * 81.8);
  EXPECT_LT(structure.frequency_accuracy, 1e-6);
}

// Two equal bodies at the ends of a massless beam.
TEST(Bodies, TwoBodiesOnABeamVibrateAsInClosedForm) {
  constexpr double kM = 3.0, kL = 1.7, kEA = 5e5, kGJ = 700.0, kBendY = 900.0, kBendZ = 1300.0;
  const Eigen::Vector3d J(0.4, 0.5, 0.7);
  Scene scene;
  add_body(scene, kM, {0.0, 0.0, 0.0}, J.asDiagonal());
  add_body(scene, kM, {kL, 0.0, 0.0}, J.asDiagonal());
  add_link(scene, 0, 1, Beam{kEA, kGJ, kBendY, kBendZ, {0.0, 1.0, 0.0}});
  const Structure structure = build(scene);
  ASSERT_EQ(structure.omega.size(), 6);
  // the squared frequencies are 2 EI / (L J) for the symmetric mode and 6 EI / (L J) (1 + 4 J / (m L^2)) for
  // the antisymmetric mode, in which the ends and the chord rotate
  Eigen::VectorXd square(6);
  square << 2.0 * kEA / (kL * kM), 2.0 * kGJ / (kL * J[0]), 2.0 * kBendZ / (kL * J[2]),
      2.0 * kBendY / (kL * J[1]), 6.0 * kBendZ / (kL * J[2]) * (1.0 + 4.0 * J[2] / (kM * kL * kL)),
      6.0 * kBendY / (kL * J[1]) * (1.0 + 4.0 * J[1] / (kM * kL * kL));
  Eigen::VectorXd omega = square.cwiseSqrt();
  std::sort(omega.begin(), omega.end());
  EXPECT_LT(largest_difference(structure.omega, omega), 1e-13);
}

// Returns a bent frame of beams with point masses and a body with an offset and inertia in its own axes.
Scene frame_with_body() {
  Scene scene;
  const Eigen::Matrix3d R = Eigen::Quaterniond(0.8, 0.3, -0.4, 0.2).normalized().matrix();
  add_body(scene, 4.0, {0.1, 0.0, 0.2}, R * diagonal(0.3, 0.5, 0.6) * R.transpose(), {0.2, -0.1, 0.3});
  add_point(scene, 0.5, {1.0, 0.1, 0.0});
  add_point(scene, 0.7, {1.8, 0.9, 0.3});
  add_point(scene, 0.3, {0.4, 1.1, -0.2});
  const Beam beam{4e5, 300.0, 500.0, 800.0, {0.1, 0.2, 1.0}};
  for (const auto& [a, b] : {std::pair{0, 1}, {1, 2}, {0, 3}}) add_link(scene, a, b, beam);
  return scene;
}

// Returns the frame with four point masses in place of the body. A rigid link joins the four point masses and
// the joint.
Scene frame_of_points(const Scene& scene, double joint_mass) {
  Scene points = scene;
  const std::vector<CarriedMass> carried = carried_masses(scene, Freedoms(scene));
  points.points[0].inertia.setZero();
  points.points[0].offset.setZero();
  points.points[0].mass = joint_mass;
  std::vector<int> rigid{0};
  for (const CarriedMass& each : carried)
    if (each.point == 0) rigid.push_back(add_point(points, each.mass, scene.points[0].position + each.arm));
  add_link(points, rigid, Rigid{});
  return points;
}

TEST(Bodies, VibrateLikePointMassesJoinedByARigidLink) {
  const Scene scene = frame_with_body();
  // the joint of the copy must have a mass, and the difference of the frequencies is proportional to that
  // mass
  const auto difference = [&](double joint_mass) {
    return largest_difference(build(frame_of_points(scene, joint_mass)).omega, build(scene).omega);
  };
  EXPECT_LT(difference(1e-9), 1e-8);
  EXPECT_NEAR(difference(1e-5) / difference(1e-7), 100.0, 0.1);
}

TEST(Bodies, FrequenciesDoNotDependOnThePositionAndAttitudeOfTheScene) {
  const Scene scene = frame_with_body();
  Scene rotated = scene;
  const Eigen::Matrix3d R = Eigen::Quaterniond(0.2, -0.6, 0.5, 0.7).normalized().matrix();
  for (PointMass& point : rotated.points) {
    point.position = R * point.position + Eigen::Vector3d(10.0, -20.0, 5.0);
    point.offset = R * point.offset;
    point.inertia = R * point.inertia * R.transpose();
  }
  for (Link& link : rotated.links) std::get<Beam>(link.kind).y_axis = R * std::get<Beam>(link.kind).y_axis;
  EXPECT_LT(largest_difference(build(rotated).omega, build(scene).omega), 1e-13);
}

TEST(Bodies, SumsOverABodyEqualSumsOverItsParticles) {
  const Scene scene = frame_with_body();
  double mass = 0.0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const CarriedMass& each : carried_masses(scene, Freedoms(scene)))
    if (each.point == 0) {
      mass += each.mass;
      moment += each.mass * each.arm;
      second +=
          each.mass * (each.arm - scene.points[0].offset) * (each.arm - scene.points[0].offset).transpose();
    }
  EXPECT_NEAR(mass, 4.0, 1e-15);
  EXPECT_LT((moment - 4.0 * scene.points[0].offset).norm(), 1e-15);
  EXPECT_LT((second.trace() * Eigen::Matrix3d::Identity() - second - scene.points[0].inertia).norm(), 1e-15);

  const Structure structure = build(scene);
  const Particles& particles = structure.particles;
  const Eigen::MatrixXd& b = particles.shapes;
  Eigen::VectorXd weight(b.rows());
  for (Eigen::Index i = 0; i < weight.size(); ++i) weight[i] = particles.mass[i / 3];
  const double total = structure.mass_properties.mass;
  EXPECT_LT((b.transpose() * weight.asDiagonal() * b / total - Eigen::MatrixXd::Identity(b.cols(), b.cols()))
                .cwiseAbs()
                .maxCoeff(),
            1e-13);
  for (Eigen::Index l = 0; l < b.cols(); ++l) {
    Eigen::Vector3d momentum = Eigen::Vector3d::Zero(), spin = momentum;
    for (Eigen::Index p = 0; p < particles.mass.size(); ++p) {
      momentum += particles.mass[p] * b.block<3, 1>(3 * p, l);
      spin += particles.mass[p] * Eigen::Vector3d(particles.r.col(p)).cross(b.block<3, 1>(3 * p, l));
    }
    EXPECT_LT(momentum.norm() + spin.norm(), 1e-13 * total) << l;
  }
}

TEST(Bodies, ABodyHasTheMassPropertiesOfItsParticles) {
  const Scene scene = frame_with_body();
  const MassProperties with = build(scene).mass_properties,
                       of_points = build(frame_of_points(scene, 1e-12)).mass_properties;
  EXPECT_NEAR(with.mass, of_points.mass, 1e-11);
  EXPECT_LT((with.p_SB - of_points.p_SB).norm(), 1e-11);
  EXPECT_LT((with.inertia - of_points.inertia).norm(), 1e-11);
  EXPECT_LT((with.principal - of_points.principal).norm(), 1e-11);
}

// Each of two rigid links contains a body, and springs join the arms of the two bodies.
TEST(Bodies, RigidArmsFollowTheRotationOfTheirBody) {
  Scene scene;
  const int a = add_body(scene, 2.0, {0.0, 0.0, 0.0}, diagonal(0.2, 0.3, 0.4)),
            b = add_body(scene, 1.0, {2.0, 0.1, 0.2}, diagonal(0.1, 0.15, 0.2));
  std::array<std::vector<int>, 2> arms{std::vector<int>{a}, std::vector<int>{b}};
  const std::array<Eigen::Vector3d, 3> corners{
      Eigen::Vector3d{0.3, 0.4, 0.0}, {0.3, -0.3, 0.4}, {0.3, -0.2, -0.5}};
  for (const int side : {0, 1})
    for (const Eigen::Vector3d& corner : corners) {
      const Eigen::Vector3d at = scene.points[side == 0 ? a : b].position + (side == 0 ? 1.0 : -1.0) * corner;
      arms[static_cast<std::size_t>(side)].push_back(add_point(scene, 0.0, at));
    }
  for (const auto& arm : arms) add_link(scene, arm, Rigid{});
  for (std::size_t k = 1; k < 4; ++k)
    for (std::size_t l = 1; l < 4; ++l) add_link(scene, arms[0][k], arms[1][l], Spring{1000.0});
  // the copy is made of point masses, and its joints have almost no mass
  Scene points = scene;
  const std::vector<CarriedMass> carried = carried_masses(scene, Freedoms(scene));
  points.links.erase(points.links.begin(), points.links.begin() + 2);
  for (PointMass& each : points.points) each.inertia.setZero(), each.mass = 1e-12;
  for (const int body : {a, b}) {
    std::vector<int> rigid = arms[body == a ? 0 : 1];
    for (const CarriedMass& each : carried)
      if (each.point == body)
        rigid.push_back(
            add_point(points, each.mass, scene.points[static_cast<std::size_t>(body)].position + each.arm));
    add_link(points, rigid, Rigid{});
  }
  const Structure structure = build(scene);
  EXPECT_EQ(structure.omega.size(), 6);
  EXPECT_LT(largest_difference(structure.omega, build(points).omega), 1e-9);
  // the tips of the arms have no mass, so there are six modes, and damping may refer to each of them
  scene.damping.mode_ratios = {{6, 0.01}};
  build(scene);
  scene.damping.mode_ratios = {{7, 0.01}};
  Faults faults;
  EXPECT_FALSE(build_structure(scene, faults));
}

// Massless points divide a beam. The frequencies equal those of one beam of the whole length.
TEST(MasslessPoints, MasslessPointsWithinABeamDoNotChangeItsFrequencies) {
  const auto two_bodies = [](const std::vector<double>& between) {
    Scene scene;
    add_body(scene, 3.0, {0.0, 0.0, 0.0}, diagonal(0.4, 0.5, 0.7));
    for (const double x : between) add_point(scene, 0.0, {x, 0.0, 0.0});
    add_body(scene, 1.0, {2.0, 0.0, 0.0}, diagonal(0.1, 0.1, 0.1), {0.0, 0.1, 0.0});
    for (int i = 0; i + 1 < static_cast<int>(scene.points.size()); ++i)
      add_link(scene, i, i + 1, Beam{5e5, 700.0, 900.0, 1300.0, {0.0, 1.0, 0.0}});
    return build(scene).omega;
  };
  EXPECT_LT(largest_difference(two_bodies({0.3, 1.0, 1.1}), two_bodies({})), 1e-12);
}

TEST(MasslessPoints, MasslessPointsNotHeldInEveryDirectionAreReported) {
  Scene scene = frame_with_body();
  add_point(scene, 0.0, {3.0, 0.0, 0.0});
  add_link(scene, 2, 4, Spring{100.0});
  Faults faults;
  EXPECT_FALSE(build_structure(scene, faults));
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].message,
            "point 'p4' has no mass, and links do not hold it in every direction; give a mass, or add links");
}

TEST(Bodies, ABodyWithAnImpossibleInertiaIsRefused) {
  for (const auto& [inertia, words] :
       {std::pair{diagonal(1.0, 1.0, 2.1), "but no moment may exceed the sum of the two others"},
        std::pair{diagonal(-1.0, 1.0, 1.0), "but it must be >= 0"}}) {
    Scene scene = frame_with_body();
    scene.points[0].inertia = inertia;
    Faults faults;
    EXPECT_FALSE(build_structure(scene, faults));
    ASSERT_FALSE(faults.empty());
    EXPECT_NE(faults[0].message.find(words), std::string::npos) << faults[0].message;
  }
}

// If springs hold a body only at its point, it can rotate about that point. These rotations are mechanisms,
// which are reported with the name of the body.
TEST(Bodies, ABodyThatIsFreeToRotateIsAMechanism) {
  Scene scene;
  add_body(scene, 2.0, {0.0, 0.0, 0.0}, diagonal(0.2, 0.3, 0.4));
  for (const Eigen::Vector3d& at : {Eigen::Vector3d{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}})
    add_point(scene, 1.0, at);
  join_all(scene, 100.0);
  Faults warnings;
  const Structure structure = build(scene, &warnings);
  EXPECT_EQ(structure.mechanisms.size(), 3u);
  EXPECT_EQ(structure.omega.size(), 12 + 3 - 6);
  for (const Mechanism& mechanism : structure.mechanisms)
    EXPECT_EQ(mechanism.moved_points, std::vector<int>{0});
}

TEST(Bodies, ABodyAloneHasNoElasticFreedom) {
  Scene scene;
  add_body(scene, 2.0, {0.0, 0.0, 0.0}, diagonal(0.2, 0.3, 0.4));
  const Structure structure = build(scene);
  EXPECT_EQ(structure.omega.size(), 0);
  EXPECT_EQ(structure.mass_properties.rigid_freedoms, 6);
  EXPECT_LT((structure.mass_properties.principal - Eigen::Vector3d(0.2, 0.3, 0.4)).norm(), 1e-15);
}

}  // namespace
}  // namespace freeflex::testing
