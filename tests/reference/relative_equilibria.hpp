// Steady motions on the rung `corotational`, and the comparison of the small motions about them with the
// reference and with the motion itself.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/motion.hpp"
#include "core/plan/make_plan.hpp"
#include "core/steady/relative_equilibrium.hpp"
#include "core/step/readout.hpp"
#include "core/structure/structure.hpp"
#include "tests/reference/true_geometry.hpp"

namespace freeflex::testing {

// [-] The frequencies must agree with those of the reference to this share. Both come from finite
// differences: 2e-10 was measured on frames, and up to 5e-7 on the rocket, whose EA is 1e6 times EI / L^2.
inline constexpr double kSame = 1e-6;

inline Plan true_plan(const Scene& scene) {
  Faults faults;
  const auto structure = build_structure(scene, faults);
  EXPECT_TRUE(structure.has_value());
  auto plan = make_full_plan(scene, *structure, Fidelity::kCorotational, faults);
  EXPECT_TRUE(plan.has_value());
  return *plan;
}

inline RelativeEquilibrium equilibrium_of(const Scene& scene, const Eigen::Vector3d& spin) {
  RelativeEquilibria equilibria(true_plan(scene), scene.loads.empty() ? std::nullopt : std::optional(0.0));
  RelativeEquilibrium found = equilibria.find(spin);
  EXPECT_EQ(found.error, "");
  EXPECT_LT(found.accuracy, kSame);
  return found;
}

/// Returns the largest distance of a rate from the nearest one of the reference, over its size, and checks
/// that no rate of the reference beyond those of rigid motion is missing.
inline double compare(const Scene& scene, const RelativeEquilibrium& found) {
  CartesianSystem system = true_geometry_of(scene);
  system.spin = found.spin;
  const Eigen::VectorXd e = found.displacements.reshaped();
  const SteadyMotion expected = steady_motion(system, e);
  EXPECT_EQ(expected.error, "");
  double worst = 0.0;
  for (const SmallMotion& small : found.motions) {
    double nearest = HUGE_VAL;
    for (const std::complex<double> rate : expected.rates)
      nearest = std::min(nearest, std::abs(rate - small.rate) / std::abs(small.rate));
    worst = std::max(worst, nearest);
  }
  for (const std::complex<double> rate : expected.rates) {
    // The carrier rotates with the body, so a body at another place or attitude moves at 0 and at the spin.
    const double spin = found.spin.norm();
    if (rate.imag() < 0.0 || std::abs(rate) < (spin > 0.0 ? 1e-2 * spin : 0.1) ||
        std::abs(rate - std::complex<double>(0.0, spin)) < 1e-2 * spin)
      continue;
    double nearest = HUGE_VAL;
    for (const SmallMotion& small : found.motions)
      nearest = std::min(nearest, std::abs(rate - small.rate) / std::abs(rate));
    EXPECT_LT(nearest, kSame) << rate << " is missing";
  }
  return worst;
}

/// Returns the frequency at which the motion of the step vibrates if it begins at the steady motion with a
/// displacement of 1e-6 of the length in the lowest mode along an axis, above the frequency `above` [rad/s],
/// from 20 half periods. Sets `expected` to that of the reference.
inline double measured_frequency(Scene scene, const RelativeEquilibrium& found, int axis, double above,
                                 double& expected) {
  CartesianSystem system = true_geometry_of(scene);
  system.spin = found.spin;
  const SteadyMotion steady = steady_motion(system, found.displacements.reshaped());
  expected = frequencies_along(steady, axis, above)[0];
  Eigen::Index mode = 0;
  (steady.rates.array() - std::complex<double>(0.0, expected)).abs().minCoeff(&mode);
  const Eigen::VectorXd shape = (steady.shapes.col(mode) / steady.shapes(axis, mode)).real();
  scene.fidelity = Fidelity::kCorotational;
  scene.rate = 20000.0;
  scene.initial.angular_velocity = found.spin;
  for (Eigen::Index i = 0; i < found.displacements.cols(); ++i) {
    const Eigen::Vector3d displaced = found.displacements.col(i) + 1e-6 * shape.segment<3>(3 * i);
    scene.initial.points.push_back({static_cast<int>(i), displaced, Eigen::Vector3d::Zero()});
  }
  const Plan plan = true_plan(scene);
  Motion motion(plan, kMotionAlone);
  std::vector<double> crossings;
  double last = 1.0;
  for (long k = 1; crossings.size() < 21; ++k) {
    EXPECT_EQ(motion.advance().status, StepStatus::kOk);
    const double V = read_point(plan, motion.state(), 0).V_B[static_cast<std::size_t>(axis)];
    if ((V > 0.0) != (last > 0.0) && k > 1)
      crossings.push_back((static_cast<double>(k) - V / (V - last)) / scene.rate);
    last = V;
  }
  return 20.0 * M_PI / (crossings.back() - crossings.front());
}

}  // namespace freeflex::testing
