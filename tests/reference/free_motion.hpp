// Checks that random structures conserve energy and momenta in free motion, for the tests of the
// true-geometry reference.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cstdio>
#include <random>
#include <vector>

#include "tests/reference/true_geometry.hpp"
#include "tests/support/mixed_structures.hpp"
#include "tools/verification/reference/integrate.hpp"

namespace freeflex::testing {

/// Returns columns with entries in [-size, size].
inline Eigen::Matrix3Xd random_columns(std::mt19937_64& engine, Eigen::Index count, double size) {
  std::uniform_real_distribution<double> uniform(-size, size);
  return Eigen::Matrix3Xd::NullaryExpr(3, count, [&]() { return uniform(engine); });
}

/// Expects that a spinning, vibrating random_mixture conserves its energy and its linear and angular
/// momentum.
inline void expect_conservation(std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  Scene scene = random_mixture(seed, 7);
  scene.initial.angular_velocity = {0.8, -1.1, 1.7};
  scene.initial.velocity = {0.3, 0.2, -0.1};
  for (int i = 0; i < 7; ++i) {
    const Eigen::Vector3d displacement = random_columns(engine, 1, 0.01);
    scene.initial.points.push_back({i, displacement, Eigen::Vector3d::Zero()});
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
  const double angular =
      (last.angular_momentum - first.angular_momentum).norm() / first.angular_momentum.norm();
  const double linear = (last.linear_momentum - first.linear_momentum).norm() / first.linear_momentum.norm();
  std::printf("seed %d: energy %.1e, angular momentum %.1e, momentum %.1e, elastic error %.1e\n",
              static_cast<int>(seed), drift, angular, linear, run.accuracy);
  EXPECT_LT(std::abs(drift), 1e-7);
  EXPECT_LT(angular, 1e-7);
  EXPECT_LT(linear, 1e-10);
  EXPECT_LT(run.accuracy, 1e-5);
}

}  // namespace freeflex::testing
