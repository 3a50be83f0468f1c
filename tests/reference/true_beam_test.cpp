// Beams of the true-geometry reference against published and closed forms.
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "tests/reference/true_geometry.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Vector3d;

constexpr double kAxial = 1e6;  // [-] EA over EI / L^2: a chain that hardly stretches

// first two bending frequencies of a free beam under an end thrust that follows it
std::array<double, 2> rocket(int elements, double thrust) {
  Scene scene = beam_of(elements, kAxial);
  push(scene, 0, Axes::kLocal, {thrust, 0.0, 0.0});
  const SteadyMotion motion = steady_motion_of(scene);
  EXPECT_NEAR(motion.acceleration.x(), thrust, 1e-9 * std::max(thrust, 1.0));
  std::vector<double> found;  // both planes alike
  for (const auto& rate : motion.rates)
    if (rate.imag() > 5.0) found.push_back(rate.imag());
  std::sort(found.begin(), found.end());
  EXPECT_NEAR(found[0], found[1], 1e-5 * found[0]);
  return {found[0], found[2]};
}

// Beal (1965, AIAA J. 3, 486-494) for the model; figures by 60 Hermite elements with consistent mass
TEST(TrueBeam, RocketMeetsTheContinuousBeam) {
  constexpr double table[][3] = {
      {0.0, 22.3733, 61.6728}, {20.0, 19.5294, 57.7753}, {100.0, 13.9483, 34.0619}};
  for (const auto& [thrust, first, second] : table) {
    const auto coarse = rocket(20, thrust), fine = rocket(40, thrust);
    for (std::size_t k = 0; k < 2; ++k) {
      const double expected = k == 0 ? first : second;
      const double limit = fine[k] + (fine[k] - coarse[k]) / 3.0;
      const double order = std::log2((coarse[k] - expected) / (fine[k] - expected));
      std::printf("T %5.1f omega_%zu: %.4f %.4f, limit %.4f for %.4f, order %.2f\n", thrust, k + 1, coarse[k],
                  fine[k], limit, expected, order);
      EXPECT_NEAR(limit, expected, 3e-4 * expected);
      EXPECT_NEAR(order, 2.0, 0.2);
    }
  }
}

TEST(TrueBeam, RocketNearFlutter) {
  const double first = rocket(40, 109.5)[0];
  std::printf("T 109.5: %.3f\n", first);
  EXPECT_NEAR(first, 21.24, 0.02);
}

TEST(TrueBeam, SpinningBeamMeetsTheContinuousBeam) {
  constexpr double kFirst = 22.3733;
  constexpr double table[][4] = {{0.05, 1.003805, 2.759439, 5.406541},
                                 {0.1, 1.015134, 2.768118, 5.414389},
                                 {0.5, 1.327300, 3.032316, 5.659362},
                                 {1.0, 2.010022, 3.735482, 6.359921}};
  for (const auto& row : table) {
    const double spin = row[0] * kFirst;
    std::array<std::vector<double>, 2> across, within;
    for (std::size_t k = 0; k < 2; ++k) {
      Scene scene = beam_of(k == 0 ? 20 : 40, kAxial);
      scene.initial.angular_velocity = {0.0, 0.0, spin};
      const SteadyMotion motion = steady_motion_of(scene);
      across[k] = frequencies_along(motion, 2, 1.01 * spin);
      within[k] = frequencies_along(motion, 1, 1e-2 * kFirst);
    }
    for (std::size_t mode = 0; mode < 3; ++mode) {
      const double expected = row[mode + 1] * kFirst;
      const double limit = across[1][mode] + (across[1][mode] - across[0][mode]) / 3.0;
      const double in_plane = std::sqrt(expected * expected - spin * spin);
      const double in_plane_limit = within[1][mode] + (within[1][mode] - within[0][mode]) / 3.0;
      std::printf("Omega %.2f mode %zu: %.6f for %.6f, in the plane off by %.1e\n", row[0], mode + 1,
                  limit / kFirst, row[mode + 1], in_plane_limit / in_plane - 1.0);
      EXPECT_NEAR(limit, expected, 5e-4 * expected);
      EXPECT_NEAR(in_plane_limit, in_plane, 1e-3 * in_plane);
    }
  }
}

// 11 points of 1 kg, 10 equal beams of 1 m, EI 2200 N m^2, EA 1e7 N
Scene frame_of_eleven() {
  Scene scene;
  for (int i = 0; i < 11; ++i) add_point(scene, 1.0, {static_cast<double>(i), 0.0, 0.0});
  for (int i = 0; i < 10; ++i) add_link(scene, i, i + 1, Beam{1e7, 2200.0, 2200.0, 2200.0, {0.0, 1.0, 0.0}});
  return scene;
}

TEST(TrueBeam, ElevenPointsMeetTheirTable) {
  const double first = rest_modes(true_geometry_of(frame_of_eleven())).omega[0];
  std::printf("at rest %.4f\n", first);
  constexpr double spins[][2] = {{0.06, 8.825}, {0.11, 8.953}, {0.34, 10.223}};
  for (const auto& [share, expected] : spins) {
    Scene scene = frame_of_eleven();
    scene.initial.angular_velocity = {0.0, 0.0, share * first};
    const double found = frequencies_along(steady_motion_of(scene), 2, 1.01 * share * first)[0];
    std::printf("spin %.2f: %.4f for %.3f\n", share, found, expected);
    EXPECT_NEAR(found, expected, 2e-3);
  }
  constexpr double thrusts[][2] = {{20.0, 7.732}, {60.0, 4.938}};
  for (const auto& [thrust, expected] : thrusts) {
    Scene scene = frame_of_eleven();
    push(scene, 0, Axes::kLocal, {thrust * 2200.0 / 100.0, 0.0, 0.0});
    const SteadyMotion motion = steady_motion_of(scene);
    double found = 1e9;
    for (const auto& rate : motion.rates)
      if (rate.imag() > 1.0) found = std::min(found, rate.imag());
    std::printf("thrust %.0f: %.4f for %.3f\n", thrust, found, expected);
    EXPECT_NEAR(found, expected, 2e-3);
  }
}

// dead loads P and -P: the free column tips before it buckles, so among motions that are not rigid
TEST(TrueBeam, ColumnBucklesAtEulersLoad) {
  std::array<double, 2> critical{};
  for (std::size_t k = 0; k < 2; ++k) {
    const auto softest = [&](double P) {
      Scene scene = beam_of(k == 0 ? 20 : 40, kAxial);
      push(scene, 0, Axes::kWorld, {P, 0.0, 0.0});
      push(scene, static_cast<int>(scene.points.size()) - 1, Axes::kWorld, {-P, 0.0, 0.0});
      const Eigen::MatrixXd K = steady_motion_of(scene).stiffness;
      return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(0.5 * (K + K.transpose())).eigenvalues()[0];
    };
    // by the secant, which a nearly straight line asks for
    double low = 9.5, high = 10.2, at_low = softest(low), at_high = softest(high);
    for (int step = 0; step < 3; ++step) {
      const double next = low - at_low * (high - low) / (at_high - at_low);
      low = high;
      at_low = at_high;
      high = next;
      at_high = softest(high);
    }
    critical[k] = high;
  }
  const double limit = critical[1] + (critical[1] - critical[0]) / 3.0;
  std::printf("Euler's load: %.6f %.6f, limit %.6f for %.6f\n", critical[0], critical[1], limit, M_PI * M_PI);
  EXPECT_NEAR(limit, M_PI * M_PI, 1e-4 * M_PI * M_PI);
}

// equal masses in a row, spinning: Legendre's equation in differences, exact for any number of masses
void check_chain(const Scene& scene, double spin, double tolerance) {
  const SteadyMotion motion = steady_motion_of(scene);
  const std::vector<double> across = frequencies_along(motion, 2, 1.2 * spin);
  const std::vector<double> within = frequencies_along(motion, 1, 0.2 * spin);
  for (std::size_t k = 0; k + 2 < scene.points.size(); ++k) {
    const double n = static_cast<double>(k) + 2.0;
    const double out = spin * std::sqrt(n * (n + 1.0) / 2.0),
                 in = spin * std::sqrt(n * (n + 1.0) / 2.0 - 1.0);
    std::printf("n %.0f: out of plane off by %.1e, in plane by %.1e\n", n, across[k] / out - 1.0,
                within[k] / in - 1.0);
    EXPECT_NEAR(across[k], out, tolerance * out);
    EXPECT_NEAR(within[k], in, tolerance * in);
  }
}

TEST(TrueChain, OfSpringsSpins) {
  Scene scene;
  for (int i = 0; i < 6; ++i) add_point(scene, 2.0, {0.5 * i, 0.0, 0.0});
  for (int i = 0; i < 5; ++i) add_link(scene, i, i + 1, Spring{1e9});
  scene.initial.angular_velocity = {0.0, 0.0, 3.0};
  check_chain(scene, 3.0, 1e-6);
}

TEST(TrueChain, OfRigidLinksSpins) {
  Scene scene;
  for (int i = 0; i < 6; ++i) add_point(scene, 2.0, {0.5 * i, 0.0, 0.0});
  for (int i = 0; i < 5; ++i) add_link(scene, i, i + 1, Rigid{});
  scene.initial.angular_velocity = {0.0, 0.0, 3.0};
  check_chain(scene, 3.0, 1e-7);
}

// two rigid crosses at the ends carry opposite couples that turn with them: the beam becomes an arc of a
// circle
TEST(TrueBeam, RollsUpToACircle) {
  constexpr int kElements = 20;
  Scene scene = beam_of(kElements, 1e4);
  constexpr double kArm = 0.1;
  for (const int end : {0, kElements}) {
    const double x = end == 0 ? 0.0 : 1.0;
    const int up = add_point(scene, 0.02, {x, kArm, 0.0}), down = add_point(scene, 0.02, {x, -kArm, 0.0});
    Link body;
    body.points = {end, up, down};
    body.kind = Rigid{};
    // three points on a line hold no turn about it: one more
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
  // a whole circle: radius 1 / (2 pi), ends together
  const CartesianSystem system = true_geometry_of(scene);
  const Eigen::Matrix3Xd x = system.r + Eigen::Map<const Eigen::Matrix3Xd>(e.data(), 3, system.r.cols());
  Vector3d centre = Vector3d::Zero();
  for (int i = 0; i < kElements; ++i) centre += x.col(i) / kElements;
  double off = 0.0;
  for (int i = 0; i <= kElements; ++i)
    off = std::max(off, std::abs(2.0 * M_PI * (x.col(i) - centre).norm() - 1.0));
  const double gap = (x.col(0) - x.col(kElements)).norm();
  std::printf("radius off by %.1e, ends %.1e apart\n", off, gap);
  EXPECT_LT(off, 2e-5);  // (theta^4 / 1920 of the bow) 5e-6
  EXPECT_LT(gap, 2e-5);
}

}  // namespace
}  // namespace freeflex::testing
