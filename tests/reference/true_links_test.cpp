// These tests check links of every kind at true geometry. The forces of the links must be the gradient of an
// energy, small motions must agree with the modes, and free motion must conserve energy and momenta.
#include <Eigen/Geometry>
#include <array>
#include <random>

#include "tests/reference/free_motion.hpp"
#include "tests/reference/true_geometry.hpp"
#include "tests/support/mixed_structures.hpp"
#include "tools/verification/reference/rotations.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Returns a large rotation, so that no test relies on small rotations.
Matrix3d some_rotation() {
  return Eigen::AngleAxisd(1.9, Vector3d(0.3, -0.5, 0.8).normalized()).toRotationMatrix();
}

// Compares the forces and moments of a single link with finite differences of its energy, by displacements of
// the points and by small rotations of the ends. The link has large rotations, a twist, and different
// stiffnesses in its two planes.
template <typename Link, std::size_t Points>
void expect_gradient(const Link& link, std::uint64_t seed, double size) {
  std::mt19937_64 engine(seed);
  const auto at = [&](const Matrix3Xd& moves, const Matrix3Xd& spins,
                      const std::array<Matrix3d, Points>& ends, LinkGradient& result) {
    std::array<Vector3d, Points> d;
    std::array<Matrix3d, Points> rotated;
    for (std::size_t k = 0; k < Points; ++k) {
      const auto column = static_cast<Eigen::Index>(k);
      d[k] = moves.col(column);
      rotated[k] = quaternion_of(spins.col(column)).toRotationMatrix() * ends[k];
    }
    if constexpr (Points == 2)
      link.evaluate(d[1] - d[0], rotated, false, result);
    else
      link.evaluate(d, rotated, false, result);
    return result.energy;
  };
  constexpr Eigen::Index kCount = Points;
  const Matrix3Xd moves = random_columns(engine, kCount, 0.1 * size), no_spins = Matrix3Xd::Zero(3, kCount);
  std::array<Matrix3d, Points> ends;
  for (Matrix3d& end : ends)
    end = quaternion_of(random_columns(engine, 1, size)).toRotationMatrix() * link.rest;
  LinkGradient result, other;
  at(moves, no_spins, ends, result);
  double worst = 0.0, largest = 0.0;
  for (Eigen::Index k = 0; k < 3 * kCount; ++k) {
    constexpr double kStep = 1e-3;
    const auto slope = [&](bool by_spin) {
      const auto energy = [&](double steps) {
        Matrix3Xd moved = moves, spins = no_spins;
        (by_spin ? spins : moved)(k % 3, k / 3) += steps * kStep;
        return at(moved, spins, ends, other);
      };
      return (45.0 * (energy(1.0) - energy(-1.0)) - 9.0 * (energy(2.0) - energy(-2.0)) + energy(3.0) -
              energy(-3.0)) /
             (60.0 * kStep);
    };
    const auto point = static_cast<std::size_t>(k / 3);
    for (const bool by_spin : {false, true}) {
      const double stated = (by_spin ? result.moment : result.force)[point][k % 3];
      worst = std::max(worst, std::abs(stated - slope(by_spin)));
      largest = std::max(largest, std::abs(stated));
    }
  }
  // finite differences of order six have a truncation error of (step / 1 rad)^6 and a rounding error of
  // 1e-16 / step
  EXPECT_LT(worst, 1e-10 * largest) << "seed " << seed;
}

TEST(TrueLinks, ForcesAndMomentsOfOneLinkDeriveFromItsEnergy) {
  const Beam beam{
      .EA = 3e3, .GJ = 150.0, .EI_y = 100.0, .EI_z = 320.0, .y_axis = {0.1, 0.9, -0.2}, .GA_y = 2e3};
  const Plate plate{4e6, 0.3, 0.03};
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    expect_gradient<TrueBeam, 2>(TrueBeam(beam, {0.8, 0.3, -0.2}), seed, 0.4);
    expect_gradient<TruePlate, 3>(
        TruePlate(plate, {Vector3d(0.1, 0.0, 0.2), Vector3d(1.0, 0.1, 0.0), Vector3d(0.3, 0.8, 0.1)}), seed,
        0.4);
  }
}

TEST(TrueLinks, ForcesDeriveFromTheEnergy) {
  constexpr double kStep = 1e-4;  // [m]
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    std::mt19937_64 engine(seed);
    const CartesianSystem system = true_geometry_of(random_mixture(seed, 8));
    const TrueGeometry& links = *system.true_geometry;
    const Eigen::Index n = system.mass.size();
    const Matrix3Xd e = some_rotation() * (system.r + random_columns(engine, n, 0.05)) - system.r;
    Matrix3Xd force = Matrix3Xd::Zero(3, n), unused = force;
    links.add_forces(e, force);
    double worst = 0.0;
    for (Eigen::Index k = 0; k < 3 * n; ++k) {
      const auto energy = [&](double steps) {
        Matrix3Xd moved = e;
        moved(k % 3, k / 3) += steps * kStep;
        return links.add_forces(moved, unused);
      };
      const double slope =
          (8.0 * (energy(1.0) - energy(-1.0)) - (energy(2.0) - energy(-2.0))) / (12.0 * kStep);
      worst = std::max(worst, std::abs(force(k % 3, k / 3) + slope));
    }
    std::printf("seed %d: forces of %.0f N off by %.1e N\n", static_cast<int>(seed),
                force.cwiseAbs().maxCoeff(), worst);
    EXPECT_LT(worst, 1e-8 * force.cwiseAbs().maxCoeff());
    // the forces have no resultant and no moment, wherever the points are
    Vector3d moment = Vector3d::Zero();
    for (Eigen::Index i = 0; i < n; ++i)
      moment += Vector3d(system.r.col(i) + e.col(i)).cross(Vector3d(force.col(i)));
    EXPECT_LT(force.rowwise().sum().norm(), 1e-10 * force.norm());
    EXPECT_LT(moment.norm(), 1e-9 * force.norm());
  }
}

TEST(TrueLinks, RigidMotionStrainsNoLink) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const CartesianSystem system = true_geometry_of(random_mixture(seed, 10));
    const Matrix3Xd e = ((some_rotation() * system.r).colwise() + Vector3d(2.0, -1.0, 0.5)) - system.r;
    Matrix3Xd force = Matrix3Xd::Zero(3, e.cols());
    const double energy = system.true_geometry->add_forces(e, force);
    EXPECT_LT(energy, 1e-18);
    EXPECT_LT(force.cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(TrueLinks, SmallMotionsHaveTheModalFrequencies) {
  double worst = 0.0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Scene scene = random_mixture(seed, 6 + static_cast<int>(seed % 5));
    const VectorXd expected = build(scene).omega;
    const VectorXd found = rest_modes(true_geometry_of(scene)).omega;
    ASSERT_EQ(found.size(), expected.size()) << "seed " << seed;
    for (Eigen::Index k = 0; k < found.size(); ++k) {
      const double off = std::abs(found[k] / expected[k] - 1.0);
      worst = std::max(worst, off);
      EXPECT_LT(off, 1e-8) << "seed " << seed << " mode " << k << " " << expected[k] << " rad/s";
    }
  }
  std::printf("frequencies agree to %.1e\n", worst);
}

TEST(TrueLinks, FreeMotionConservesEnergyAndMomenta) {
  for (const std::uint64_t seed : {1, 2}) expect_conservation(seed);
}

// An integrator may try positions that are far off. The joints must then find back to the equilibrium near
// which they were.
TEST(TrueLinks, JointsFindBackFromPositionsFarOff) {
  std::mt19937_64 engine(7);
  std::normal_distribution<double> normal;
  int num_far = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const Scene scene = random_mixture(seed, 6 + static_cast<int>(seed % 5));
    CartesianSystem fresh = true_geometry_of(scene), used = true_geometry_of(scene);
    const auto random = [&](double size) {
      return Matrix3Xd(size * Matrix3Xd::NullaryExpr(3, fresh.r.cols(), [&] { return normal(engine); }));
    };
    const Matrix3Xd near = random(1e-3), far = random(0.15);
    Matrix3Xd force = Matrix3Xd::Zero(3, near.cols()), expected = force;
    used.true_geometry->add_forces(far, force);
    num_far += force.allFinite();
    force.setZero();
    const double energy = used.true_geometry->add_forces(near, force);
    const double expected_energy = fresh.true_geometry->add_forces(near, expected);
    EXPECT_NEAR(energy, expected_energy, 1e-9 * expected_energy) << "seed " << seed;
    EXPECT_LT((force - expected).norm(), 1e-8 * expected.norm()) << "seed " << seed;
  }
  EXPECT_GT(num_far, 100);
}

}  // namespace
}  // namespace freeflex::testing
