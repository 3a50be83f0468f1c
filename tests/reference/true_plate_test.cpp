// Plates of the true-geometry reference: patches, a strip beside the beam, a spinning disc without stiffness.
#include <Eigen/Geometry>

#include "core/reference/rotations.hpp"
#include "tests/reference/true_geometry.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

using Triangle = std::array<int, 3>;

void add_plate(Scene& scene, const Triangle& corners, const Plate& plate) {
  Link link;
  link.name = std::to_string(scene.links.size());
  link.points = {corners.begin(), corners.end()};
  link.kind = plate;
  scene.links.push_back(link);
}

// lumps a third of each plate's mass at each of its corners
void set_masses(Scene& scene, double density_thickness) {
  for (PointMass& point : scene.points) point.mass = 0.0;
  for (const Link& link : scene.links) {
    const auto at = [&](std::size_t k) {
      return scene.points[static_cast<std::size_t>(link.points[k])].position;
    };
    const double area = 0.5 * (at(1) - at(0)).cross(at(2) - at(0)).norm();
    for (const int point : link.points)
      scene.points[static_cast<std::size_t>(point)].mass += density_thickness * area / 3.0;
  }
}

// a square of side 2 around an inner point that is nowhere special
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
  // w = (a x^2 + b y^2) / 2 + c x y, so small that the membrane does not feel it
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
      const Vector3d turn(b * y + c * x, -a * x - c * y, 0.0);
      ends[k] = quaternion_of(turn).toRotationMatrix() * one.rest;
    }
    TurnResult result;
    one.evaluate(d, ends, false, result);
    energy += result.energy;
  }
  const double D = plate.E * std::pow(plate.thickness, 3) / (12.0 * (1.0 - 0.09));
  const double expected = 0.5 * 4.0 * D * (a * a + b * b + 0.6 * a * b + 2.0 * 0.7 * c * c);
  std::printf("energy off by %.1e\n", energy / expected - 1.0);
  EXPECT_NEAR(energy, expected, 1e-6 * expected);
}

// a strip of length 1 along x, one plate pair wide, without lateral contraction: a beam
Scene strip(int elements, double thickness) {
  constexpr double kWidth = 0.04;
  Scene scene;
  for (int i = 0; i <= elements; ++i)
    for (const double side : {-0.5, 0.5})
      add_point(scene, 1.0, {static_cast<double>(i) / elements, side * kWidth, 0.0});
  // EI = 1
  const Plate plate{12.0 / (kWidth * std::pow(thickness, 3)), 0.0, thickness};
  for (int i = 0; i < elements; ++i) {
    const int k = 2 * i;
    // diagonals to either side in turn
    if (i % 2 == 0) {
      add_plate(scene, {k, k + 2, k + 3}, plate);
      add_plate(scene, {k, k + 3, k + 1}, plate);
    } else {
      add_plate(scene, {k, k + 2, k + 1}, plate);
      add_plate(scene, {k + 2, k + 3, k + 1}, plate);
    }
  }
  set_masses(scene, 1.0 / kWidth);
  return scene;
}

TEST(TruePlate, SpinningStripIsABeam) {
  constexpr double kFirst = 22.3733;
  // at rest and at Omega = 0.5 omega_1 in its own plane: the continuous beam
  for (const auto& [share, expected] : {std::pair{0.0, 1.0}, {0.5, 1.327300}}) {
    std::array<double, 2> found{};
    for (std::size_t k = 0; k < 2; ++k) {
      Scene scene = strip(k == 0 ? 12 : 24, 2e-3);
      scene.initial.angular_velocity = {0.0, 0.0, share * kFirst};
      const SteadyMotion motion = steady_motion_of(scene);
      found[k] = frequencies_along(motion, 2, std::max(1.05 * share, 0.5) * kFirst)[0] / kFirst;
    }
    const double limit = found[1] + (found[1] - found[0]) / 3.0;
    std::printf("Omega %.2f: %.5f %.5f, limit %.5f for %.5f\n", share, found[0], found[1], limit, expected);
    EXPECT_NEAR(limit, expected, 2e-3 * expected);
  }
}

// Lamb and Southwell (1921, Proc. R. Soc. A 99, 272-280): transverse motions r^n ... cos(n phi) of a free
// disc that only its spin stiffens, s nodal circles, k = n + 2 s, in axes that turn with it: 8 omega^2 /
// Omega^2 = (3 + nu) k (k + 2) - (1 + 3 nu) n^2
TEST(TruePlate, SpinningDiscMeetsLambAndSouthwell) {
  constexpr double kNu = 0.3, kSpin = 1.0;
  std::array<std::vector<double>, 2> found;
  for (std::size_t mesh = 0; mesh < 2; ++mesh) {
    const int rings = mesh == 0 ? 3 : 5;
    Scene scene;
    add_point(scene, 1.0, Vector3d::Zero());
    // ring j holds 6 j points, from 1 + 3 j (j - 1) on
    for (int j = 1; j <= rings; ++j)
      for (int i = 0; i < 6 * j; ++i) {
        const double angle = M_PI / 3.0 * i / j, radius = static_cast<double>(j) / rings;
        add_point(scene, 1.0, {radius * std::cos(angle), radius * std::sin(angle), 0.0});
      }
    const Plate plate{1e4 / 1e-4, kNu, 1e-4};  // E h = 1e4 of the density per area times Omega^2 a^2
    const auto at = [](int j, int i) { return j == 0 ? 0 : 1 + 3 * j * (j - 1) + (i + 6 * j) % (6 * j); };
    for (int j = 1; j <= rings; ++j)
      for (int sector = 0; sector < 6; ++sector)
        for (int i = 0; i < j; ++i) {
          const int outer = sector * j + i, inner = sector * (j - 1) + i;
          add_plate(scene, {at(j - 1, inner), at(j, outer), at(j, outer + 1)}, plate);
          if (i > 0) add_plate(scene, {at(j - 1, inner - 1), at(j, outer), at(j - 1, inner)}, plate);
        }
    set_masses(scene, 1.0);
    scene.initial.angular_velocity = {0.0, 0.0, kSpin};
    found[mesh] = frequencies_along(steady_motion_of(scene), 2, 1.1 * kSpin);
  }
  // 2 diameters; 1 circle; 3 diameters: the first two times each
  const auto expected = [](int n, int s) {
    const double k = n + 2.0 * s;
    return kSpin * std::sqrt(((3.0 + kNu) * k * (k + 2.0) - (1.0 + 3.0 * kNu) * n * n) / 8.0);
  };
  const std::pair<std::size_t, double> modes[] = {
      {0, expected(2, 0)}, {2, expected(0, 1)}, {3, expected(3, 0)}};
  for (const auto& [index, frequency] : modes) {
    const double coarse = found[0][index], fine = found[1][index];
    const double limit = fine + (fine - coarse) * 9.0 / 16.0;
    std::printf("%.5f %.5f, limit %.5f for %.5f\n", coarse, fine, limit, frequency);
    EXPECT_NEAR(fine, frequency, 0.06 * frequency);
    EXPECT_NEAR(limit, frequency, 0.01 * frequency);
  }
}

}  // namespace
}  // namespace freeflex::testing
