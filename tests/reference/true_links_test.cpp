// Links of every kind at true geometry: forces are those of an energy, small motions those of the modes, and
// what is conserved is conserved.
#include <Eigen/Geometry>
#include <random>

#include "core/reference/elastic_error.hpp"
#include "core/reference/integrate.hpp"
#include "tests/reference/true_geometry.hpp"
#include "tests/support/mixed_structures.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

Matrix3Xd random_columns(std::mt19937_64& engine, Eigen::Index count, double size) {
  std::uniform_real_distribution<double> uniform(-size, size);
  return Matrix3Xd::NullaryExpr(3, count, [&]() { return uniform(engine); });
}

// a finite rotation, so that nothing rests on the carrier being near
Eigen::Matrix3d some_turn() {
  return Eigen::AngleAxisd(1.9, Vector3d(0.3, -0.5, 0.8).normalized()).toRotationMatrix();
}

TEST(TrueLinks, ForcesAreThoseOfTheEnergy) {
  constexpr double kStep = 1e-4;  // [m]
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    std::mt19937_64 engine(seed);
    const CartesianSystem system = true_geometry_of(random_mixture(seed, 8));
    const TrueGeometry& links = *system.true_geometry;
    const Eigen::Index n = system.mass.size();
    const Matrix3Xd e = some_turn() * (system.r + random_columns(engine, n, 0.05)) - system.r;
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
    // no resultant, no moment, wherever the points are
    Vector3d moment = Vector3d::Zero();
    for (Eigen::Index i = 0; i < n; ++i)
      moment += Vector3d(system.r.col(i) + e.col(i)).cross(Vector3d(force.col(i)));
    EXPECT_LT(force.rowwise().sum().norm(), 1e-10 * force.norm());
    EXPECT_LT(moment.norm(), 1e-9 * force.norm());
  }
}

TEST(TrueLinks, RigidMotionStrainsNothing) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const CartesianSystem system = true_geometry_of(random_mixture(seed, 10));
    const Matrix3Xd e = ((some_turn() * system.r).colwise() + Vector3d(2.0, -1.0, 0.5)) - system.r;
    Matrix3Xd force = Matrix3Xd::Zero(3, e.cols());
    const double energy = system.true_geometry->add_forces(e, force);
    EXPECT_LT(energy, 1e-18);
    EXPECT_LT(force.cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(TrueLinks, SmallMotionsAreTheModes) {
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
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    std::mt19937_64 engine(seed);
    Scene scene = random_mixture(seed, 7);
    scene.initial.angular_velocity = {0.8, -1.1, 1.7};
    scene.initial.velocity = {0.3, 0.2, -0.1};
    for (int i = 0; i < 7; ++i) {
      const Vector3d displacement = random_columns(engine, 1, 0.01);
      scene.initial.points.push_back({i, displacement, Vector3d::Zero()});
    }
    const CartesianSystem system = true_geometry_of(scene);
    const std::vector<double> times{0.05, 0.1, 0.2};
    ReferenceOptions options;
    options.tolerance = 1e-9;
    const ReferenceRun run = integrate_with_estimate(system, times, options);
    ASSERT_EQ(run.error, "") << "seed " << seed;
    const auto total = [&](std::size_t k) {
      return invariants(system, run.states[k]).kinetic + run.strain_energy[k];
    };
    const auto first = invariants(system, run.states[0]), last = invariants(system, run.states[2]);
    const double drift = total(2) / total(0) - 1.0;
    const double turn =
        (last.angular_momentum - first.angular_momentum).norm() / first.angular_momentum.norm();
    const double push = (last.linear_momentum - first.linear_momentum).norm() / first.linear_momentum.norm();
    std::printf("seed %d: energy %.1e, angular momentum %.1e, momentum %.1e, elastic error %.1e\n",
                static_cast<int>(seed), drift, turn, push, run.accuracy);
    EXPECT_LT(std::abs(drift), 1e-7);
    EXPECT_LT(turn, 1e-7);
    EXPECT_LT(push, 1e-10);
    EXPECT_LT(run.accuracy, 1e-5);
  }
}

}  // namespace
}  // namespace freeflex::testing
