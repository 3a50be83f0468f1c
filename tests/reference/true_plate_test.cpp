// These tests check the plates of the true-geometry reference by patch tests, and by a strip that must
// vibrate like a beam.
#include <Eigen/Geometry>

#include "tests/reference/true_geometry.hpp"
#include "tools/verification/reference/rotations.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

// Returns a square of side 2 that is divided into triangles by an inner point in general position.
Scene patch(const Plate& plate) {
  Scene scene;
  for (const auto& [x, y] : {std::pair{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}, {0.3, -0.2}})
    add_point(scene, 1.0, {x, y, 0.0});
  for (int k = 0; k < 4; ++k) add_plate(scene, {k, (k + 1) % 4, 4}, plate);
  return scene;
}

TEST(TruePlate, UniformStretchPassesThePatchTestAtAnyAttitude) {
  const Plate plate{1e9, 0.3, 0.02};
  const CartesianSystem system = true_geometry_of(patch(plate));
  Matrix3d U = Matrix3d::Identity();
  U.topLeftCorner<2, 2>() << 1.004, 0.003, 0.003, 0.998;
  const Matrix3d R = Eigen::AngleAxisd(2.1, Vector3d(0.3, -0.5, 0.8).normalized()).toRotationMatrix();
  const Matrix3Xd e = R * U * system.r - system.r;
  Matrix3Xd force = Matrix3Xd::Zero(3, 5);
  const double energy = system.true_geometry->add_forces(e, force);
  const double xx = 0.004, yy = -0.002, xy = 0.003;
  const double expected = 0.5 * 4.0 * plate.E * plate.thickness / (1.0 - 0.09) *
                          (xx * xx + yy * yy + 0.6 * xx * yy + 2.0 * 0.7 * xy * xy);
  std::printf("energy off by %.1e, inner force %.1e of the outer\n", energy / expected - 1.0,
              force.col(4).norm() / force.norm());
  EXPECT_NEAR(energy, expected, 1e-12 * expected);
  EXPECT_LT(force.col(4).norm(), 1e-12 * force.norm());
}

TEST(TruePlate, UniformCurvaturePassesThePatchTest) {
  const Plate plate{1e9, 0.3, 0.02};
  const Scene scene = patch(plate);
  // deflection w = (a x^2 + b y^2) / 2 + c x y, so small that the membrane strain is negligible
  const double a = 2e-6, b = -1e-6, c = 1.5e-6;
  double energy = 0.0;
  for (const Link& link : scene.links) {
    std::array<Vector3d, 3> corner, d;
    std::array<Matrix3d, 3> ends;
    for (std::size_t k = 0; k < 3; ++k)
      corner[k] = scene.points[static_cast<std::size_t>(link.points[k])].position;
    const TruePlate one(plate, corner);
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = corner[k].x(), y = corner[k].y();
      d[k] = {0.0, 0.0, 0.5 * (a * x * x + b * y * y) + c * x * y};
      const Vector3d rotation(b * y + c * x, -a * x - c * y, 0.0);
      ends[k] = quaternion_of(rotation).toRotationMatrix() * one.rest;
    }
    LinkGradient result;
    one.evaluate(d, ends, false, result);
    energy += result.energy;
  }
  const double D = plate.E * std::pow(plate.thickness, 3) / (12.0 * (1.0 - 0.09));
  const double expected = 0.5 * 4.0 * D * (a * a + b * b + 0.6 * a * b + 2.0 * 0.7 * c * c);
  std::printf("energy off by %.1e\n", energy / expected - 1.0);
  EXPECT_NEAR(energy, expected, 1e-6 * expected);
}

TEST(TruePlate, ASpinningStripVibratesLikeABeam) {
  constexpr double kFirst = 22.3733;
  // expected first frequency, as a ratio to omega_1, of the continuous beam at rest and of the beam that
  // spins in its plane at 0.5 omega_1
  for (const auto& [share, expected] : {std::pair{0.0, 1.0}, {0.5, 1.327300}}) {
    std::array<double, 2> found{};
    for (std::size_t k = 0; k < 2; ++k) {
      Scene scene = strip_of_plates(k == 0 ? 12 : 24, 2e-3);
      scene.initial.angular_velocity = {0.0, 0.0, share * kFirst};
      const SteadyMotion motion = steady_motion_of(scene);
      found[k] = frequencies_along(motion, 2, std::max(1.05 * share, 0.5) * kFirst)[0] / kFirst;
    }
    const double limit = found[1] + (found[1] - found[0]) / 3.0;
    std::printf("Omega %.2f: %.5f %.5f, limit %.5f for %.5f\n", share, found[0], found[1], limit, expected);
    EXPECT_NEAR(limit, expected, 2e-3 * expected);
  }
}

}  // namespace
}  // namespace freeflex::testing
