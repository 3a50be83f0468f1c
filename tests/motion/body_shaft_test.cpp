// These tests check spinning bodies on the rung `coupled` by the whirl of a shaft, and by rigid bodies on
// springs at true geometry.
#include <gtest/gtest.h>

#include <array>
#include <complex>
#include <cstdio>

#include "tests/motion/newton_euler.hpp"
#include "tests/motion/rotations.hpp"
#include "tests/motion/rung_cases.hpp"
#include "tests/motion/watched.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {
namespace {

constexpr double kJt = 0.3, kJp = 0.55, kL = 0.8, kEI = 240.0;

// The second disc has `ratio` times the inertia of the first.
Scene discs_on_a_shaft(double spin, double ratio = 1.0) {
  Scene scene;
  for (const double z : {0.0, kL}) {
    add_point(scene, 4.0, {0.0, 0.0, z});
    scene.points.back().inertia = (z > 0.0 ? ratio : 1.0) * Eigen::Vector3d(kJt, kJt, kJp).asDiagonal();
  }
  add_link(scene, 0, 1, Beam{1e6, 500.0, kEI, kEI, {0.0, 1.0, 0.0}});
  scene.publication.points = {0, 1};
  scene.fidelity = Fidelity::kCoupled;
  scene.rate = 4000.0;
  scene.initial.angular_velocity = {0.0, 0.0, spin};
  return scene;
}

// Two discs with J = (Jt, Jt, Jp) at the ends of a round massless shaft spin about the shaft at the rate W,
// and their tilts differ by phi. In axes that do not rotate, Jt phi'' - i W Jp phi' + (2 EI / L) phi = 0 with
// phi = phi_x + i phi_y, so the whirl speeds are (W Jp +- (W^2 Jp^2 + 4 Jt k)^(1/2)) / (2 Jt)   (Genta,
// Dynamics of Rotating Systems, 2005, section 4.4: a rotor with gyroscopic effect, Jt w^2 - Jp W w - k = 0).
TEST(CoupledBodies, DiscsOnAShaftWhirlAsInClosedForm) {
  constexpr double kSpin = 25.0, kTilt = 1e-5;
  const Scene scene = discs_on_a_shaft(kSpin);
  const Structure structure = build(scene);
  const Freedoms freedoms(scene);
  const double k = 2.0 * kEI / kL;
  Plan plan = compile(scene);
  Eigen::Index mode = 0;
  (structure.omega.array() - std::sqrt(k / kJt)).abs().minCoeff(&mode);
  plan.initial.q[static_cast<std::size_t>(mode)] = kTilt;
  Simulation simulation(std::move(plan));
  const auto tilt = [&] {
    const Eigen::Vector3d phi = joint_rotation(structure, freedoms, 0, simulation.state) -
                                joint_rotation(structure, freedoms, 1, simulation.state);
    return std::complex<double>(phi.x(), phi.y());
  };
  const std::complex<double> start = tilt();
  ASSERT_GT(std::abs(start), 0.5 * kTilt);
  const double root = std::sqrt(kSpin * kSpin * kJp * kJp + 4.0 * kJt * k);
  const double forward = (kSpin * kJp + root) / (2.0 * kJt), backward = (kSpin * kJp - root) / (2.0 * kJt);
  // at the start phi' = i W phi in axes that do not rotate
  const std::complex<double> of_forward = start * (kSpin - backward) / (forward - backward);
  double worst = 0.0;
  for (int tick = 1; tick <= 8000; ++tick) {
    simulation.run(1);
    const double t = tick / scene.rate;
    const std::complex<double> i(0.0, 1.0);
    const std::complex<double> phi = of_forward * std::exp(i * (forward - kSpin) * t) +
                                     (start - of_forward) * std::exp(i * (backward - kSpin) * t);
    worst = std::max(worst, std::abs(tilt() - phi) / std::abs(start));
  }
  std::printf("whirls at %.4f and %.4f rad/s, %.4f at rest: tilt off by %.1e of itself over 2 s\n", forward,
              backward, std::sqrt(k / kJt), worst);
  // the bound is the error of order 4 at w h = 0.02 over 2 s, and terms of second order in the tilt are only
  // 1e-10
  EXPECT_LT(worst, 1e-7);
}

// The rung `separated` omits the gyroscopic terms of rotating bodies. The verdict of the rung estimates the
// error, and the rung `coupled` gives the true motion.
TEST(Verdict, EstimatesTheGyroscopicErrorOfRotatingBodies) {
  for (const double spin : {0.02, 0.1, 0.5}) {
    // points at the centres of equal discs would not move
    Scene scene = discs_on_a_shaft(spin, 1.5);
    publish_everything(scene);
    scene.initial.modes = {{1, 1e-5, 0.0}};
    Watched truth(judged_plan_of(scene));
    scene.fidelity = Fidelity::kSeparated;
    Watched separated(judged_plan_of(scene));
    truth.run(4000);
    const Verdict& verdict = separated.run(4000);
    const double error = distance_between(scene, truth, separated);
    std::printf("spin %.2f rad/s: separated rung off by %.1e of the scale, reported %.1e, %s\n", spin,
                error / verdict.scale, verdict.error.deformation / verdict.scale, name_of(verdict.level));
    EXPECT_NE(verdict.cause, Verdict::Cause::kShared);
    EXPECT_NEAR(verdict.error.deformation, error, 0.02 * error);
  }
}

TEST(CoupledBodies, BodiesOnASpinAxisMatchNewtonEulerToSecondOrderInAmplitude) {
  expect_square_of_amplitude([](double) { return Stack(); });
}

}  // namespace
}  // namespace freeflex::testing
