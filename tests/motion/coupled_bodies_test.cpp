// Bodies on the coupled rung: their momenta, what they keep, and rigid bodies on springs at true geometry.
#include <gtest/gtest.h>

#include <complex>
#include <cstdio>
#include <random>

#include "core/scene/bodies.hpp"
#include "core/structure/link_factor.hpp"
#include "core/structure/particles.hpp"
#include "tests/motion/lagrange_equations.hpp"
#include "tests/motion/rung_cases.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {
namespace {

// four bodies off each other's axes on beams, two with offsets, one point mass
Scene bodies_on_beams() {
  Scene scene;
  std::mt19937_64 engine(5);
  std::uniform_real_distribution<double> some(-1.0, 1.0);
  for (int k = 0; k < 4; ++k) {
    add_point(scene, 1.0 + 0.4 * k, {1.0 * k, 0.4 * some(engine), 0.4 * some(engine)});
    if (k == 2) continue;
    PointMass& body = scene.points.back();
    const Eigen::Vector3d S(0.03 + 0.02 * k, 0.05, 0.1);  // second moments along its axes
    const Eigen::Matrix3d axes =
        Eigen::AngleAxisd(1.0 + k, Eigen::Vector3d(some(engine), some(engine), 1.0).normalized())
            .toRotationMatrix();
    body.inertia =
        axes * Eigen::Vector3d(S[1] + S[2], S[0] + S[2], S[0] + S[1]).asDiagonal() * axes.transpose();
    body.inertia = 0.5 * (body.inertia + body.inertia.transpose()).eval();
    if (k != 1) body.offset = {0.1 * some(engine), 0.2, 0.1 * some(engine)};
  }
  for (int k = 0; k < 3; ++k) add_link(scene, k, k + 1, Beam{4e4, 300.0, 400.0, 500.0, {0.1, 0.2, 1.0}});
  for (int k = 0; k < 4; ++k) scene.publication.points.push_back(k);
  scene.fidelity = Fidelity::kCoupled;
  scene.rate = 1000.0;
  scene.initial.angular_velocity = {0.9, -0.6, 1.4};
  return scene;
}

// a particle on a body that has turned by theta: r + V + (exp [theta x] - 1) a, its rate and its derivative
// by each coordinate, for coordinates q
struct TurnedParticles {
  const Structure& structure;
  std::vector<CarriedMass> carried;
  Freedoms freedoms;

  TurnedParticles(const Scene& scene, const Structure& of)
      : structure(of), carried(carried_masses(scene.points)), freedoms(scene) {}

  Eigen::Vector3d place(std::size_t p, const Eigen::VectorXd& q) const {
    const int point = carried[p].point;
    Eigen::Vector3d x =
        structure.mass_properties.r.col(point) + structure.shapes.middleRows<3>(3 * Eigen::Index{point}) * q;
    if (carried[p].arm.isZero(0.0)) return x;
    const Eigen::Vector3d theta =
        structure.turns.middleRows<3>(freedoms.rotation(point) - freedoms.num_displacements()) * q;
    const double angle = theta.norm();
    if (angle == 0.0) return x + carried[p].arm;
    return x + Eigen::AngleAxisd(angle, theta / angle) * carried[p].arm;
  }
  // by central differences of fourth order, which the places of turned bodies stand to 1e-12
  Eigen::Matrix3Xd derivatives(std::size_t p, const Eigen::VectorXd& q) const {
    constexpr double kStep = 2e-3;
    Eigen::Matrix3Xd all(3, q.size());
    for (Eigen::Index l = 0; l < q.size(); ++l) {
      const auto at = [&](double s) {
        Eigen::VectorXd moved = q;
        moved[l] += s * kStep;
        return place(p, moved);
      };
      all.col(l) = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * kStep);
    }
    return all;
  }
};

struct Momenta {
  Eigen::Vector3d H = Eigen::Vector3d::Zero();
  Eigen::VectorXd p;  // over the mass
};
// about the centre of mass, which the second order of offset bodies moves
Momenta momenta_of(const TurnedParticles& particles, const Eigen::VectorXd& q, const Eigen::VectorXd& q_dot,
                   const Eigen::Vector3d& w) {
  const double mass = particles.structure.mass_properties.mass;
  std::vector<Eigen::Vector3d> x;
  std::vector<Eigen::Matrix3Xd> b;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3Xd moves = Eigen::Matrix3Xd::Zero(3, q.size());
  for (std::size_t p = 0; p < particles.carried.size(); ++p) {
    x.push_back(particles.place(p, q));
    b.push_back(particles.derivatives(p, q));
    centre += particles.carried[p].mass / mass * x.back();
    moves += particles.carried[p].mass / mass * b.back();
  }
  Momenta sum;
  sum.p = Eigen::VectorXd::Zero(q.size());
  for (std::size_t p = 0; p < x.size(); ++p) {
    const Eigen::Vector3d arm = x[p] - centre, v = (b[p] - moves) * q_dot + w.cross(arm);
    sum.H += particles.carried[p].mass * arm.cross(v);
    sum.p += particles.carried[p].mass / mass * (b[p] - moves).transpose() * v;
  }
  return sum;
}

// H to third order in the elastic motion, p to second: both come of the energy to second order   (X194)
TEST(CoupledBodies, MomentaAreThoseOfTurnedBodies) {
  const Scene scene = bodies_on_beams();
  const Structure structure = build(scene);
  const TurnedParticles particles(scene, structure);
  Plan plan = compile(scene);
  const Eigen::Index n = structure.omega.size();
  ASSERT_EQ(plan.coupled.kinetics.num_tables, kBodyTables);
  const Eigen::Vector3d w = scene.initial.angular_velocity;
  std::vector<double> of_H, of_p;
  for (const double size : {0.08, 0.04, 0.02, 0.01}) {
    Eigen::VectorXd q(n), q_dot(n);
    for (Eigen::Index l = 0; l < n; ++l) {
      q[l] = size * std::cos(3.0 * static_cast<double>(l)) / (1.0 + static_cast<double>(l));
      q_dot[l] = size * std::sin(1.0 + 2.0 * static_cast<double>(l));
      plan.initial.q[static_cast<std::size_t>(l)] = q[l];
      plan.initial.q_dot[static_cast<std::size_t>(l)] = q_dot[l];
    }
    const State state = make_state(plan);
    const Momenta expected = momenta_of(particles, q, q_dot, w);
    of_H.push_back((Eigen::Map<const Eigen::Vector3d>(state.H_W.data()) - expected.H).norm());
    of_p.push_back((Eigen::Map<const Eigen::VectorXd>(state.coupled.momentum.data(), n) - expected.p).norm());
  }
  std::printf("momenta of bodies: H off by %.1e %.1e %.1e %.1e, p by %.1e %.1e %.1e %.1e\n", of_H[0], of_H[1],
              of_H[2], of_H[3], of_p[0], of_p[1], of_p[2], of_p[3]);
  for (std::size_t k = 1; k < of_H.size(); ++k) {
    EXPECT_NEAR(std::log2(of_H[k - 1] / of_H[k]), 3.0, 0.2);
    EXPECT_NEAR(std::log2(of_p[k - 1] / of_p[k]), 2.0, 0.2);
  }
}

// the rates come of the energy that the momenta come of, or it would drift
TEST(CoupledBodies, KeepEnergyAndMomentumToTheOrderOfTheMethod) {
  Scene scene = bodies_on_beams();
  std::vector<double> drift;
  for (const double rate : {500.0, 1000.0, 2000.0, 4000.0}) {
    scene.rate = rate;
    Plan plan = compile(scene);
    plan.initial.q[0] = 0.05;
    plan.initial.q[3] = 0.01;
    plan.initial.q_dot[1] = 0.3;
    Simulation simulation(std::move(plan));
    const double energy = energy_of(simulation);
    const Vec3 H = simulation.state.H_W;
    simulation.run(std::llround(0.5 * rate));
    drift.push_back(std::abs(energy_of(simulation) / energy - 1.0));
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(simulation.state.H_W[k], H[k]);
  }
  std::printf("energy of bodies on beams off by %.1e %.1e %.1e %.1e at 500 to 4000 Hz\n", drift[0], drift[1],
              drift[2], drift[3]);
  for (std::size_t k = 1; k < drift.size(); ++k) EXPECT_GT(std::log2(drift[k - 1] / drift[k]), 3.5);
}

Eigen::Vector3d turn_of(const Structure& structure, const Freedoms& freedoms, int point, const State& state) {
  const Eigen::Map<const Eigen::VectorXd> q(state.q.data(), structure.omega.size());
  return structure.turns.middleRows<3>(freedoms.rotation(point) - freedoms.num_displacements()) * q;
}

// Two discs J = (Jt, Jt, Jp) on the ends of a round massless shaft, spun about it by W, tilted against each
// other by phi: in axes that do not turn Jt phi'' - i W Jp phi' + (2 EI / L) phi = 0, phi = phi_x + i phi_y,
// so that whirls are at (W Jp +- (W^2 Jp^2 + 4 Jt k)^(1/2)) / (2 Jt)   (Genta, Dynamics of Rotating Systems,
// 2005, section 4.4: a rotor with gyroscopic effect, Jt w^2 - Jp W w - k = 0).
TEST(CoupledBodies, DiscsOnAShaftWhirlAsTheClosedFormSays) {
  constexpr double kJt = 0.3, kJp = 0.55, kL = 0.8, kEI = 240.0, kSpin = 25.0, kTilt = 1e-5;
  Scene scene;
  for (const double z : {0.0, kL}) {
    add_point(scene, 4.0, {0.0, 0.0, z});
    scene.points.back().inertia = Eigen::Vector3d(kJt, kJt, kJp).asDiagonal();
  }
  add_link(scene, 0, 1, Beam{1e6, 500.0, kEI, kEI, {0.0, 1.0, 0.0}});
  scene.publication.points = {0, 1};
  scene.fidelity = Fidelity::kCoupled;
  scene.rate = 4000.0;
  scene.initial.angular_velocity = {0.0, 0.0, kSpin};
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
