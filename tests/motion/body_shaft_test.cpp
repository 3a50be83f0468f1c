// These tests check spinning bodies on the rung `coupled` by the whirl of a shaft, and by rigid bodies on
// springs at true geometry.
#include <gtest/gtest.h>

#include <array>
#include <complex>
#include <cstdio>

#include "core/error/judgement.hpp"
#include "tests/motion/newton_euler.hpp"
#include "tests/motion/rotations.hpp"
#include "tests/motion/rung_cases.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {
namespace {

constexpr double kJt = 0.3, kJp = 0.55, kL = 0.8, kEI = 240.0;

Scene discs_on_a_shaft(double spin) {
  Scene scene;
  for (const double z : {0.0, kL}) {
    add_point(scene, 4.0, {0.0, 0.0, z});
    scene.points.back().inertia = Eigen::Vector3d(kJt, kJt, kJp).asDiagonal();
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
// error of the tilt, and the rung `coupled` gives the true tilt.
TEST(Verdict, EstimatesTheGyroscopicErrorOfRotatingBodies) {
  for (const double spin : {0.02, 0.1, 0.5}) {
    std::array<Plan, 2> plans;
    Eigen::Index mode = 0;
    for (const Fidelity rung : {Fidelity::kCoupled, Fidelity::kSeparated}) {
      Scene scene = discs_on_a_shaft(spin);
      scene.fidelity = rung;
      (build(scene).omega.array() - std::sqrt(2.0 * kEI / kL / kJt)).abs().minCoeff(&mode);
      Plan& plan = plans[rung == Fidelity::kCoupled ? 0 : 1];
      plan = compile(scene);
      plan.initial.q[static_cast<std::size_t>(mode)] = 1e-5;
    }
    Simulation truth(plans[0]), separated(plans[1]);
    Judgement judgement(separated.plan);
    Budget no_budget;
    for (int tick = 0; tick < 4000; ++tick) {
      truth.run(1);
      separated.run(1);
      judgement.take(separated.state, no_budget);
    }
    const auto n = static_cast<Eigen::Index>(truth.plan.num_elastic);
    const double error = (Eigen::Map<const Eigen::VectorXd>(truth.state.q.data(), n) -
                          Eigen::Map<const Eigen::VectorXd>(separated.state.q.data(), n))
                             .norm();
    const Verdict verdict = judgement.now();
    std::printf("spin %.2f rad/s: tilt of the separated rung off by %.1e of itself, reported %.1e, %s\n",
                spin, error / 1e-5, verdict.error / 1e-5, name_of(verdict.level));
    EXPECT_NE(verdict.cause, Verdict::Cause::kUnquantified);
    EXPECT_GT(verdict.error, 0.5 * error);
    EXPECT_LT(verdict.error, 4.0 * error);
  }
}

TEST(CoupledBodies, BodiesOnASpinAxisMatchNewtonEulerToSecondOrderInAmplitude) {
  expect_square_of_amplitude([](double) { return Stack(); });
}

}  // namespace
}  // namespace freeflex::testing
