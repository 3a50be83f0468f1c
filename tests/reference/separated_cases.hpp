// Computes the elastic error of the separated equations relative to the full system, for the quick and the
// long tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/simulation.hpp"
#include "tests/support/structures.hpp"
#include "tools/verification/reference/elastic_error.hpp"
#include "tools/verification/reference/integrate.hpp"

namespace freeflex::testing {

inline constexpr double kCaseEnd = 2.0;  // [s]

struct FullSystem {
  Eigen::VectorXd mass;
  Eigen::Matrix3Xd rest;
  Eigen::Matrix3Xd u;  // [m] elastic displacements at kCaseEnd
  double accuracy = 0.0;
};

inline FullSystem full_system(const Scene& scene, const ReferenceOptions& options, bool with_estimate) {
  std::string error;
  const auto system = make_cartesian_system(scene, error);
  EXPECT_TRUE(system.has_value()) << error;
  const double times[] = {kCaseEnd};
  const ReferenceRun run =
      with_estimate ? integrate_with_estimate(*system, times, options) : integrate(*system, times, options);
  EXPECT_EQ(run.error, "");
  FullSystem full{system->mass, system->r, {}, run.accuracy};
  full.u = elastic_displacements(system->mass, system->r, run.states.at(0).p_W);
  return full;
}

/// Returns the elastic displacements at kCaseEnd, from the world positions of a simulation at `rate` [Hz].
inline Eigen::Matrix3Xd separated(Scene scene, const FullSystem& full, double rate) {
  scene.rate = rate;
  Simulation simulation(scene);
  simulation.run(std::llround(kCaseEnd * rate));
  return elastic_displacements(full.mass, full.rest, simulation.positions_W());
}

/// Expects that the elastic error at 1 kHz equals `expected` to two digits, and that the errors of the step
/// and of the reference are negligible.
inline void expect_elastic_error(const char* name, const Scene& scene, const FullSystem& full,
                                 double expected) {
  const Eigen::Matrix3Xd u1 = separated(scene, full, 1000.0);
  const Eigen::Matrix3Xd u2 = separated(scene, full, 2000.0);
  const Eigen::Matrix3Xd u4 = separated(scene, full, 4000.0);
  const double error = elastic_error(u1, full.u);
  const double first = elastic_error(u1, u2), second = elastic_error(u2, u4);
  std::printf("%s: elastic error %.4e (expected %.1e); h = 1 ms to 0.5 ms changes %.1e, to 0.25 ms %.1e",
              name, error, expected, first, second);
  if (full.accuracy > 0.0) std::printf("; reference accuracy %.1e", full.accuracy);
  std::printf("\n");
  const double second_digit = std::pow(10.0, std::floor(std::log10(expected)) - 1.0);
  EXPECT_NEAR(error, expected, 0.5 * second_digit);
  EXPECT_LT(first, 0.05 * second_digit);
  EXPECT_LT(full.accuracy, 0.2 * second_digit);
  // for world-fixed loads on a rotating frame the error of the step is proportional to the square of the
  // step, down to the rounding errors of the fastest phase and of the world positions
  const Plan plan = plan_of(scene);
  const double phase = 2.3e-16 * *std::max_element(plan.omega.begin(), plan.omega.end()) * kCaseEnd;
  const double rounding = 2.3e-16 * full.rest.norm() / full.u.norm();
  EXPECT_LT(second, 0.3 * first + 10.0 * phase + 2.0 * rounding);
}

}  // namespace freeflex::testing
