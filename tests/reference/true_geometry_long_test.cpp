// These slower tests of the true-geometry reference check large deflections, buckling, a spinning disc and
// free motion.
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "tests/reference/free_motion.hpp"
#include "tests/reference/true_geometry.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Vector3d;

// Under the dead loads P and -P a free column rotates rigidly before it buckles, so the test considers only
// the elastic motions.
TEST(TrueBeam, AColumnBucklesAtEulersLoad) {
  std::array<double, 2> critical{};
  for (std::size_t k = 0; k < 2; ++k) {
    const auto softest = [&](double P) {
      Scene scene = beam_of(k == 0 ? 20 : 40, kAxial);
      push(scene, 0, Axes::kWorld, {P, 0.0, 0.0});
      push(scene, static_cast<int>(scene.points.size()) - 1, Axes::kWorld, {-P, 0.0, 0.0});
      const Eigen::MatrixXd K = steady_motion_of(scene).stiffness;
      return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(0.5 * (K + K.transpose())).eigenvalues()[0];
    };
    critical[k] = secant_root(9.5, 10.2, softest);
  }
  const double limit = critical[1] + (critical[1] - critical[0]) / 3.0;
  std::printf("Euler's load: %.6f %.6f, limit %.6f for %.6f\n", critical[0], critical[1], limit, M_PI * M_PI);
  EXPECT_NEAR(limit, M_PI * M_PI, 1e-4 * M_PI * M_PI);
}

// Opposite couples act on two rigid crosses at the ends and rotate with them, so the beam becomes an arc of a
// circle.
TEST(TrueBeam, ABeamUnderOppositeCouplesRollsUpToACircle) {
  constexpr int kElements = 20;
  Scene scene = beam_of(kElements, 1e4);
  constexpr double kArm = 0.1;
  for (const int end : {0, kElements}) {
    const double x = end == 0 ? 0.0 : 1.0;
    const int up = add_point(scene, 0.02, {x, kArm, 0.0}), down = add_point(scene, 0.02, {x, -kArm, 0.0});
    Link body;
    body.points = {end, up, down};
    body.kind = Rigid{};
    // three points on a line do not determine the rotation about the line, so a fourth point is added
    body.points.push_back(add_point(scene, 0.02, {x, 0.0, kArm}));
    scene.links.push_back(body);
  }
  const int first = kElements + 1;
  const auto set_moment = [&](double M) {
    scene.loads.clear();
    const double force = 0.5 * M / kArm;
    for (const int end : {0, 1}) {
      const double sign = end == 0 ? 1.0 : -1.0;
      push(scene, first + 3 * end, Axes::kLocal, {sign * force, 0.0, 0.0});
      push(scene, first + 3 * end + 1, Axes::kLocal, {-sign * force, 0.0, 0.0});
    }
  };
  Eigen::VectorXd e;
  constexpr int kSteps = 24;
  for (int step = 1; step <= kSteps; ++step) {
    set_moment(2.0 * M_PI * step / kSteps);
    const SteadyMotion motion = steady_motion(true_geometry_of(scene), e);
    ASSERT_EQ(motion.error, "") << "step " << step;
    e = motion.e;
  }
  // if the beam is a full circle, its radius is 1 / (2 pi) and its ends meet
  const CartesianSystem system = true_geometry_of(scene);
  const Eigen::Matrix3Xd x = system.r + Eigen::Map<const Eigen::Matrix3Xd>(e.data(), 3, system.r.cols());
  Vector3d centre = Vector3d::Zero();
  for (int i = 0; i < kElements; ++i) centre += x.col(i) / kElements;
  double off = 0.0;
  for (int i = 0; i <= kElements; ++i)
    off = std::max(off, std::abs(2.0 * M_PI * (x.col(i) - centre).norm() - 1.0));
  const double gap = (x.col(0) - x.col(kElements)).norm();
  std::printf("radius off by %.1e, ends %.1e apart\n", off, gap);
  EXPECT_LT(off, 2e-5);  // the term theta^4 / 1920 of the bow alone gives 5e-6
  EXPECT_LT(gap, 2e-5);
}

TEST(TruePlate, SpinningDiscAgreesWithLambAndSouthwell) {
  constexpr double kNu = 0.3, kSpin = 1.0;
  std::array<std::vector<double>, 3> found;
  constexpr std::array<int, 3> kRings{3, 4, 5};
  for (std::size_t mesh = 0; mesh < 3; ++mesh) {
    Scene scene = disc_of_plates(kRings[mesh], kNu);
    scene.initial.angular_velocity = {0.0, 0.0, kSpin};
    found[mesh] = frequencies_along(steady_motion_of(scene), 2, 1.1 * kSpin);
  }
  // An error of order h^6 remains. With 4, 5 and 6 rings it would be 4e-4, half of it from the stretch of the
  // disc due to its spin.
  expect_lamb_and_southwell(kRings, found, kSpin, kNu, 3e-3);
}

TEST(TrueLinks, FreeMotionOfSixMoreStructuresConservesEnergyAndMomenta) {
  for (std::uint64_t seed = 3; seed <= 8; ++seed) expect_conservation(seed);
}

}  // namespace
}  // namespace freeflex::testing
