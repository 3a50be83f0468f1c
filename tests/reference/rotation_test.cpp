// A body with three distinct principal moments rotates freely about an axis near its intermediate axis. Its
// rotation is compared with an integration of Euler's equations and of the attitude in 50 decimal digits.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/support/simulation.hpp"
#include "tests/support/structures.hpp"
#include "tests/support/wide_rotation.hpp"

namespace freeflex {
namespace {

using testing::rotate_freely;
using testing::Wide;
using testing::WideRotation;

Wide energy(const WideRotation& body) {
  Wide sum = 0;
  for (std::size_t a = 0; a < 3; ++a) sum += body.moment[a] * body.w[a] * body.w[a] / 2;
  return sum;
}

/// Returns the octahedron with ticks at `rate` [Hz], spinning about an axis 1e-2 rad from the intermediate
/// axis y.
Scene spinning_body(double spin, double rate) {
  Scene scene = testing::octahedron();
  scene.rate = rate;
  scene.initial.angular_velocity = spin * Eigen::Vector3d(0.01, 1.0, 0.005).normalized();
  return scene;
}

WideRotation exact_rotation(const Plan& plan, double time) {
  const std::array<double, 3> moment{plan.inertia[0], plan.inertia[4], plan.inertia[8]};
  const Wide start = energy(rotate_freely(moment, plan.initial.w_B, 0.0));
  const WideRotation body = rotate_freely(moment, plan.initial.w_B, time);
  EXPECT_LT(abs(energy(body) - start), Wide(1e-44) * start) << "the integration is not good to 40 digits";
  return body;
}

/// Returns the angle [rad] between the attitude of the state, including its low parts, and the exact
/// attitude.
double attitude_error(const State& state, const WideRotation& exact) {
  std::array<Wide, 4> q;
  for (std::size_t a = 0; a < 4; ++a) q[a] = Wide(state.q_WB[a]) + Wide(state.q_WB_low[a]);
  const auto& p = exact.q;
  const std::array<Wide, 3> difference = {p[0] * q[1] - p[1] * q[0] - p[2] * q[3] + p[3] * q[2],
                                          p[0] * q[2] - p[2] * q[0] - p[3] * q[1] + p[1] * q[3],
                                          p[0] * q[3] - p[3] * q[0] - p[1] * q[2] + p[2] * q[1]};
  const Wide norm =
      sqrt(difference[0] * difference[0] + difference[1] * difference[1] + difference[2] * difference[2]);
  return 2.0 * static_cast<double>(norm);
}

double attitude_error_after(double spin, double period, double time) {
  testing::Simulation simulation(spinning_body(spin, 1.0 / period));
  simulation.run(std::llround(time / period));
  return attitude_error(simulation.state, exact_rotation(simulation.plan, time));
}

TEST(FreeRotation, TheOctahedronHasThreeKnownPrincipalMoments) {
  const Plan plan = testing::plan_of(spinning_body(1.0, 1000.0));
  for (int k = 0; k < 9; ++k) {
    const double expected = k % 4 == 0 ? 2.0 + k / 4 : 0.0;
    EXPECT_NEAR(plan.inertia[static_cast<std::size_t>(k)], expected, 1e-15);
  }
}

// In the 20 / |w| seconds of this test, the truncation error stays below 1e-3 (|w| h)^6. Near the
// intermediate axis, a rounding error grows as exp(|w| t / sqrt 8) until the body has flipped over. By then
// it has grown by a factor of a thousand.
TEST(FreeRotation, AttitudeIsExactNearTheIntermediateAxis) {
  for (const double spin : {1.0, 5.0}) {
    const double time = 20.0 / spin;
    const double error = attitude_error_after(spin, 1e-3, time);
    std::printf("|w| = %g rad/s, h = 1 ms, t = %g s: attitude error %.2e rad\n", spin, time, error);
    EXPECT_LT(error, 1e-3 * std::pow(spin * 1e-3, 6) + 1e3 * 2.3e-16);
  }
}

// The body rotates by up to two radians per tick. Near the intermediate axis rounding errors grow by a factor
// of a thousand.
TEST(FreeRotation, AttitudeIsExactAtAnyTickLength) {
  constexpr double kTime = 16.0;
  for (const double h : {2.0, 1.0, 0.5, 0.25, 0.125, 1.0 / 32, 1.0 / 128}) {
    const double error = attitude_error_after(1.0, h, kTime);
    std::printf("h = %.4g s: attitude error %.3e rad\n", h, error);
    EXPECT_LT(error, 1e3 * 2.3e-16) << h;
  }
}

/// Returns the largest relative change of the rotational energy over a million ticks.
double energy_drift(double spin) {
  testing::Simulation simulation(spinning_body(spin, 1000.0));
  const double start = read_invariants(simulation.plan, simulation.state).kinetic_rigid;
  double largest = 0.0;
  for (int k = 0; k < 1000; ++k) {
    simulation.run(1000);
    const double now = read_invariants(simulation.plan, simulation.state).kinetic_rigid;
    largest = std::max(largest, std::abs(now - start) / start);
  }
  return largest;
}

TEST(FreeRotation, EnergyIsConstantOverAMillionTicks) {
  for (const double spin : {1.0, 5.0, 25.0, 50.0, 500.0}) {
    const double drift = energy_drift(spin);
    std::printf("|w| h = %g rad: energy drift %.2e over 1e6 ticks\n", spin * 1e-3, drift);
    EXPECT_LT(drift, 1e-12);
  }
}

}  // namespace
}  // namespace freeflex
