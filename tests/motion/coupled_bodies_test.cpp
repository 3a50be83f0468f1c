// These tests check bodies on the rung `coupled` by momenta, conserved quantities and the work of torques.
#include <gtest/gtest.h>

#include <cstdio>
#include <random>

#include "core/plan/make_plan.hpp"
#include "core/scene/bodies.hpp"
#include "core/structure/links/link_factor.hpp"
#include "core/structure/masses/particles.hpp"
#include "tests/motion/rotations.hpp"
#include "tests/motion/rung_cases.hpp"
#include "tests/motion/watched.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {
namespace {

// Returns three bodies and a point mass that beams join. They do not lie on one line. Two of the bodies have
// offsets.
Scene bodies_on_beams() {
  Scene scene;
  std::mt19937_64 engine(5);
  std::uniform_real_distribution<double> some(-1.0, 1.0);
  for (int k = 0; k < 4; ++k) {
    add_point(scene, 1.0 + 0.4 * k, {1.0 * k, 0.4 * some(engine), 0.4 * some(engine)});
    if (k == 2) continue;
    PointMass& body = scene.points.back();
    const Eigen::Vector3d S(0.03 + 0.02 * k, 0.05, 0.1);  // second moments along the axes of the body
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

// For particles at arms a on bodies that rotate by theta, this struct gives the position r + V + (exp [theta
// x] - 1) a as a function of the modal coordinates q, and the derivatives of this position by central
// differences.
struct RotatedParticles {
  const Structure& structure;
  std::vector<CarriedMass> carried;
  Freedoms freedoms;

  RotatedParticles(const Scene& scene, const Structure& of)
      : structure(of), carried(carried_masses(scene, Freedoms(scene))), freedoms(scene) {}

  Eigen::Vector3d position(std::size_t p, const Eigen::VectorXd& q) const {
    const int point = carried[p].point;
    Eigen::Vector3d x =
        structure.mass_properties.r.col(point) + structure.shapes.middleRows<3>(3 * Eigen::Index{point}) * q;
    if (carried[p].arm.isZero(0.0)) return x;
    const Eigen::Vector3d theta =
        structure.rotations.middleRows<3>(freedoms.rotation(point) - freedoms.num_displacements()) * q;
    const double angle = theta.norm();
    if (angle == 0.0) return x + carried[p].arm;
    return x + Eigen::AngleAxisd(angle, theta / angle) * carried[p].arm;
  }
  // central differences of fourth order have an error of some 1e-12
  Eigen::Matrix3Xd derivatives(std::size_t p, const Eigen::VectorXd& q) const {
    constexpr double kStep = 2e-3;
    Eigen::Matrix3Xd all(3, q.size());
    for (Eigen::Index l = 0; l < q.size(); ++l) {
      const auto at = [&](double s) {
        Eigen::VectorXd moved = q;
        moved[l] += s * kStep;
        return position(p, moved);
      };
      all.col(l) = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * kStep);
    }
    return all;
  }
};

struct Momenta {
  Eigen::Vector3d H = Eigen::Vector3d::Zero();
  Eigen::VectorXd p;  // over the total mass
};
// the momenta refer to the centre of mass, which bodies with an offset move at second order
Momenta momenta_of(const RotatedParticles& particles, const Eigen::VectorXd& q, const Eigen::VectorXd& q_dot,
                   const Eigen::Vector3d& w) {
  const double mass = particles.structure.mass_properties.mass;
  std::vector<Eigen::Vector3d> x;
  std::vector<Eigen::Matrix3Xd> b;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3Xd moves = Eigen::Matrix3Xd::Zero(3, q.size());
  for (std::size_t p = 0; p < particles.carried.size(); ++p) {
    x.push_back(particles.position(p, q));
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

// The angular momentum H has an error of third order in the elastic motion, and the modal momenta p have an
// error of second order, because both derive from the energy up to second order   (THEORY 12.45).
TEST(CoupledBodies, MomentaMatchTheSumOverParticlesOfRotatedBodies) {
  const Scene scene = bodies_on_beams();
  const Structure structure = build(scene);
  const RotatedParticles particles(scene, structure);
  Plan plan = without_load_stiffness(compile(scene));
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

// The energy does not drift, because the rates and the momenta derive from the same energy.
TEST(CoupledBodies, EnergyAndMomentumAreConservedToTheOrderOfTheMethod) {
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

// The power of a torque on a body is the torque times the angular velocity of that body. Up to the order of
// the energy, this angular velocity is w + theta' + theta x theta' / 2, whatever the angle of the body.
TEST(CoupledBodies, TheWorkOfATorqueDependsOnTheAngularVelocityOfItsOwnBody) {
  Scene scene = bodies_on_beams();
  scene.rate = 8000.0;
  Group group;
  group.name = "end";
  group.points = {3};
  scene.groups.push_back(group);
  const Structure structure = build(scene);
  const Freedoms freedoms(scene);
  Plan plan = without_load_stiffness(compile(scene));
  plan.initial.q[0] = 0.1;
  Simulation simulation(std::move(plan));
  const Eigen::Vector3d torque(3.0, -5.0, 4.0);
  ForceCommand command = make_command(0, 1);
  command.num_wrenches = 1;
  command.wrenches[0].group = 0;
  command.wrenches[0].torque = {torque.x(), torque.y(), torque.z()};
  const auto power = [&] {
    const State& state = simulation.state;
    const Eigen::Map<const Eigen::VectorXd> q_dot(state.q_dot.data(), structure.omega.size());
    const Eigen::Vector3d theta = joint_rotation(structure, freedoms, 3, state),
                          theta_dot = structure.rotations.middleRows<3>(freedoms.rotation(3) -
                                                                        freedoms.num_displacements()) *
                                      q_dot,
                          w = Eigen::Map<const Eigen::Vector3d>(state.coupled.w_B.data());
    const Quat& a = state.q_WB;
    return torque.dot(Eigen::Quaterniond(a[0], a[1], a[2], a[3]) *
                      (w + theta_dot + 0.5 * theta.cross(theta_dot)));
  };
  const double energy = energy_of(simulation);
  double work = power(), largest = 0.0;
  constexpr int kTicks = 800;
  for (int tick = 1; tick <= kTicks; ++tick) {
    simulation.run(1, tick == 1 ? std::span(&command, 1) : std::span<const ForceCommand>());
    work += (tick == kTicks ? 1.0 : tick % 2 == 1 ? 4.0 : 2.0) * power();
    largest = std::max(largest, joint_rotation(structure, freedoms, 3, simulation.state).norm());
  }
  work /= 3.0 * scene.rate;
  const double gained = energy_of(simulation) - energy;
  std::printf("a torque on a body that rotates by up to %.2f rad: energy %.9f J, work %.9f J\n", largest,
              gained, work);
  EXPECT_GT(largest, 0.05);
  // Simpson's rule and the step both have order 4, and w h = 0.05 for the highest mode, which moves little
  EXPECT_NEAR(gained, work, 1e-7 * std::abs(work));
}

// The shadow of a plan with bodies restarts from the modal coordinates, because the positions of points do
// not determine the rotations of bodies. If the shadow started from other coordinates, the error would be of
// their size.
TEST(CoupledBodies, TheShadowRestartsFromTheRotationsOfTheBodies) {
  Scene scene = bodies_on_beams();
  scene.initial.angular_velocity *= 1e-3;
  scene.initial.modes = {{1, 1e-4, 0.0}, {2, 0.0, 1e-4}};
  scene.verdict.horizon = 0.1;
  Watched watched(scene);
  double largest = 0.0;
  for (int tick = 0; tick < 350; ++tick) {
    const Verdict& verdict = watched.run(1);
    largest = std::max(largest, verdict.error.deformation / verdict.scale);
  }
  std::printf("bodies over three horizons of 0.1 s: error at most %.1e of the scale\n", largest);
  EXPECT_GT(largest, 0.0);
  EXPECT_LT(largest, 1e-3);
}

}  // namespace
}  // namespace freeflex::testing
