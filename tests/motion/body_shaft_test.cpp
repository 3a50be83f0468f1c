// Spinning bodies on the coupled rung: whirls of a shaft, rigid bodies on springs at true geometry.
#include <gtest/gtest.h>

#include <array>
#include <complex>
#include <cstdio>

#include "core/validity/judgement.hpp"
#include "tests/motion/lagrange_equations.hpp"
#include "tests/motion/rung_cases.hpp"
#include "tests/motion/turns.hpp"
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

// Two discs J = (Jt, Jt, Jp) on the ends of a round massless shaft, spun about it by W, tilted against each
// other by phi: in axes that do not turn Jt phi'' - i W Jp phi' + (2 EI / L) phi = 0, phi = phi_x + i phi_y,
// so that whirls are at (W Jp +- (W^2 Jp^2 + 4 Jt k)^(1/2)) / (2 Jt)   (Genta, Dynamics of Rotating Systems,
// 2005, section 4.4: a rotor with gyroscopic effect, Jt w^2 - Jp W w - k = 0).
TEST(CoupledBodies, DiscsOnAShaftWhirlAsTheClosedFormSays) {
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
    const Eigen::Vector3d phi =
        turn_of(structure, freedoms, 0, simulation.state) - turn_of(structure, freedoms, 1, simulation.state);
    return std::complex<double>(phi.x(), phi.y());
  };
  const std::complex<double> start = tilt();
  ASSERT_GT(std::abs(start), 0.5 * kTilt);
  const double root = std::sqrt(kSpin * kSpin * kJp * kJp + 4.0 * kJt * k);
  const double forward = (kSpin * kJp + root) / (2.0 * kJt), backward = (kSpin * kJp - root) / (2.0 * kJt);
  // in axes that do not turn phi' = i W phi at the start
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
  // order 4 at w h = 0.02, 2 s; the second order of the tilt is 1e-10
  EXPECT_LT(worst, 1e-7);
}

// Where the rung lacks what spin does to turning bodies, the word knows it: the tilt by the separated rung,
// that by the coupled one, and what the word says of the first.
TEST(Word, KnowsWhatSpinDoesToBodiesThatTurn) {
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
    Budget none;
    for (int tick = 0; tick < 4000; ++tick) {
      truth.run(1);
      separated.run(1);
      judgement.take(separated.state, none);
    }
    const auto n = static_cast<Eigen::Index>(truth.plan.num_elastic);
    const double error = (Eigen::Map<const Eigen::VectorXd>(truth.state.q.data(), n) -
                          Eigen::Map<const Eigen::VectorXd>(separated.state.q.data(), n))
                             .norm();
    const Verdict verdict = judgement.now();
    std::printf("spin %.2f rad/s: tilt of the separated rung off by %.1e of itself, told %.1e, %s\n", spin,
                error / 1e-5, verdict.error / 1e-5, name_of(verdict.word));
    EXPECT_NE(verdict.cause, Verdict::Cause::kUnseen);
    EXPECT_GT(verdict.error, 0.5 * error);
    EXPECT_LT(verdict.error, 4.0 * error);
  }
}

// Rigid bodies by Newton and Euler, each with an attitude of its own, joined by springs between arms at true
// length and direction.
struct NewtonEuler {
  struct Spring {
    int first, second;           // bodies
    Eigen::Vector3d arm, other;  // [m] from their centres, their axes
    double stiffness, length;    // [N/m], [m]
  };
  std::vector<double> mass;
  std::vector<Eigen::Matrix3d> J;
  std::vector<Spring> springs;

  // y = (place, velocity, attitude x y z w, spin in own axes) of each
  Eigen::VectorXd rates(const Eigen::VectorXd& y) const {
    Eigen::VectorXd dot(y.size());
    std::vector<Eigen::Vector3d> force(mass.size(), Eigen::Vector3d::Zero()), torque = force;
    const auto attitude = [&](std::size_t k) {
      return Eigen::Quaterniond(Eigen::Vector4d(y.segment<4>(13 * static_cast<Eigen::Index>(k) + 6)))
          .normalized();
    };
    for (const Spring& spring : springs) {
      const auto i = static_cast<std::size_t>(spring.first), j = static_cast<std::size_t>(spring.second);
      const Eigen::Vector3d arm = attitude(i) * spring.arm, other = attitude(j) * spring.other;
      const Eigen::Vector3d span =
          y.segment<3>(13 * spring.second) + other - y.segment<3>(13 * spring.first) - arm;
      const Eigen::Vector3d pull = spring.stiffness * (span.norm() - spring.length) * span.normalized();
      force[i] += pull;
      force[j] -= pull;
      torque[i] += arm.cross(pull);
      torque[j] -= other.cross(pull);
    }
    for (std::size_t k = 0; k < mass.size(); ++k) {
      const Eigen::Index at = 13 * static_cast<Eigen::Index>(k);
      const Eigen::Vector3d w = y.segment<3>(at + 10), half = 0.5 * w;
      const Eigen::Quaterniond now(Eigen::Vector4d(y.segment<4>(at + 6)));
      dot.segment<3>(at) = y.segment<3>(at + 3);
      dot.segment<3>(at + 3) = force[k] / mass[k];
      dot.segment<4>(at + 6) = (now * Eigen::Quaterniond(0.0, half.x(), half.y(), half.z())).coeffs();
      dot.segment<3>(at + 10) =
          J[k].inverse() * (attitude(k).inverse() * torque[k] - w.cross(Eigen::Vector3d(J[k] * w)));
    }
    return dot;
  }
};

Eigen::Quaterniond exponential(const Eigen::Vector3d& theta) {
  const double angle = theta.norm();
  return angle == 0.0 ? Eigen::Quaterniond::Identity()
                      : Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d(theta / angle)));
}

// three bodies on an axis, each with three arms; every arm has a spring to each arm of the next body
struct Stack {
  Scene scene;
  NewtonEuler truth;
  Stack() {
    constexpr std::array<double, 3> kAt{0.0, 0.7, 1.5};
    for (std::size_t k = 0; k < 3; ++k) {
      add_point(scene, 2.0 + static_cast<double>(k), {0.0, 0.0, kAt[k]});
      scene.points.back().inertia =
          Eigen::Vector3d(0.2 + 0.05 * static_cast<double>(k), 0.25, 0.36).asDiagonal();
      truth.mass.push_back(scene.points.back().mass);
      truth.J.push_back(scene.points.back().inertia);
    }
    std::vector<std::array<int, 3>> arms;
    for (int k = 0; k < 3; ++k) {
      std::array<int, 3> own{};
      for (int a = 0; a < 3; ++a)
        own[static_cast<std::size_t>(a)] =
            add_point(scene, 0.0, scene.points[static_cast<std::size_t>(k)].position + arm(k, a));
      arms.push_back(own);
    }
    for (int k = 0; k < 3; ++k) {
      const auto& own = arms[static_cast<std::size_t>(k)];
      add_link(scene, {k, own[0], own[1], own[2]}, Rigid{});
    }
    for (int k = 0; k < 2; ++k)
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) {
          const double stiffness = 800.0 + 100.0 * a;
          add_link(scene, arms[static_cast<std::size_t>(k)][static_cast<std::size_t>(a)],
                   arms[static_cast<std::size_t>(k) + 1][static_cast<std::size_t>(b)], Spring{stiffness});
          const Eigen::Vector3d span = scene.points[static_cast<std::size_t>(k) + 1].position +
                                       arm(k + 1, b) - scene.points[static_cast<std::size_t>(k)].position -
                                       arm(k, a);
          truth.springs.push_back({k, k + 1, arm(k, a), arm(k + 1, b), stiffness, span.norm()});
        }
    for (int k = 0; k < 3; ++k) scene.publication.points.push_back(k);
    scene.fidelity = Fidelity::kCoupled;
    scene.rate = 4000.0;
    scene.initial.angular_velocity = {0.0, 0.0, 6.0};
  }
  static Eigen::Vector3d arm(int body, int k) {
    const double angle = 2.0 * M_PI * k / 3.0 + 0.4 * body;
    return {0.3 * std::cos(angle), 0.3 * std::sin(angle), 0.05};
  }
};

// places of bodies and their attitudes, of the step; from those at the start the truth sets out
Eigen::VectorXd bodies_of(const Structure& structure, const Freedoms& freedoms,
                          const Simulation& simulation) {
  Eigen::VectorXd y(39);
  const Quat& a = simulation.state.q_WB;
  const Eigen::Quaterniond R(a[0], a[1], a[2], a[3]);
  const Vec3& w = simulation.state.coupled.w_B;
  for (int k = 0; k < 3; ++k) {
    const PointState point = read_point(simulation.plan, simulation.state, k);
    const Eigen::Quaterniond turn = exponential(turn_of(structure, freedoms, k, simulation.state));
    y.segment<3>(13 * k) = Eigen::Map<const Eigen::Vector3d>(point.p_W.data());
    y.segment<3>(13 * k + 3) = Eigen::Map<const Eigen::Vector3d>(point.v_W.data());
    y.segment<4>(13 * k + 6) = (R * turn).coeffs();
    y.segment<3>(13 * k + 10) = turn.inverse() * Eigen::Map<const Eigen::Vector3d>(w.data());  // q' = 0
  }
  return y;
}

TEST(CoupledBodies, OnASpinAxisAreRigidBodiesOnSpringsToTheSquareOfTheAmplitude) {
  const Stack stack;
  const Structure structure = build(stack.scene);
  const Freedoms freedoms(stack.scene);
  ASSERT_EQ(structure.omega.size(), 12);
  std::vector<double> errors;
  for (const double size : {4e-3, 2e-3, 1e-3, 5e-4}) {
    Plan plan = compile(stack.scene);
    for (std::size_t l = 0; l < 12; ++l) plan.initial.q[l] = size * std::cos(2.0 * static_cast<double>(l));
    Simulation simulation(std::move(plan));
    Eigen::VectorXd y = bodies_of(structure, freedoms, simulation);
    for (int k = 0; k < 250; ++k)
      y = extrapolated_step([&](double, const Eigen::VectorXd& at) { return stack.truth.rates(at); }, 0.0, y,
                            4e-3);
    simulation.run(4000);
    const Eigen::VectorXd found = bodies_of(structure, freedoms, simulation);
    double error = 0.0;
    for (int k = 0; k < 3; ++k) {
      error = std::max(error, (found - y).segment<3>(13 * k).norm());
      const Eigen::Quaterniond a(Eigen::Vector4d(found.segment<4>(13 * k + 6))),
          b(Eigen::Vector4d(y.segment<4>(13 * k + 6)));
      error = std::max(error, a.angularDistance(b));
    }
    errors.push_back(error);
  }
  std::printf(
      "three bodies on springs, 1 s at 6 rad/s: off by %.1e %.1e %.1e %.1e m or rad as the amplitude halves "
      "from 4 mm\n",
      errors[0], errors[1], errors[2], errors[3]);
  for (std::size_t k = 1; k < errors.size(); ++k)
    EXPECT_NEAR(std::log2(errors[k - 1] / errors[k]), 2.0, 0.25);
}

}  // namespace
}  // namespace freeflex::testing
