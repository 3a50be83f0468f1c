// These tests check wheels on the rung `coupled`, where the axes of wheels rotate with the bodies. They use
// closed forms, momenta, and bodies at true geometry.
#include <gtest/gtest.h>

#include <array>
#include <complex>
#include <cstdio>

#include "core/plan/make_plan.hpp"
#include "tests/motion/newton_euler.hpp"
#include "tests/motion/rotations.hpp"
#include "tests/motion/rung_cases.hpp"
#include "tests/motion/watched.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Vector3d;

Vector3d as_vector(const Vec3& v) { return {v[0], v[1], v[2]}; }

ForceCommand motor_command(double torque) {
  ForceCommand command = make_command(0, 1);
  command.num_wheels = 1;
  command.wheels[0] = {0, 0, torque};
  return command;
}

// Returns three bodies in a row on two beams. The wheel axes are not principal axes.
Scene bodies_with_wheels() {
  Scene scene;
  for (const Vector3d& at : {Vector3d(0.0, 0.0, 0.0), Vector3d(1.1, 0.2, 0.0), Vector3d(1.9, -0.3, 0.4)}) {
    add_point(scene, 2.0, at);
    scene.points.back().inertia = Vector3d(0.10, 0.13, 0.16).asDiagonal();
  }
  for (int k = 0; k < 2; ++k) add_link(scene, k, k + 1, Beam{4e4, 300.0, 400.0, 500.0, {0.1, 0.2, 1.0}});
  scene.publication.points = scene.pushable = {0, 1, 2};
  scene.wheels.push_back({"first", 0, Vector3d(0.6, 0.0, 0.8), 1.1, {}});
  scene.wheels.push_back({"last", 2, Vector3d(2.0, -1.0, 2.0) / 3.0, -0.7, {}});
  scene.fidelity = Fidelity::kCoupled;
  scene.rate = 1000.0;
  scene.initial.angular_velocity = {0.4, -0.3, 0.7};
  return scene;
}

// The motion is the whirl of discs on a shaft, but the rotors spin and the bodies do not. The equation J
// phi'' - i h phi' + (2 EI / L) phi = 0 has the whirl speeds (h +- (h^2 + 4 J k)^(1/2)) / (2 J)   (Genta,
// Dynamics of Rotating Systems, 2005, section 4.4).
TEST(CoupledWheels, BodiesWithRotorsWhirlAsInClosedForm) {
  constexpr double kJ = 0.3, kSpan = 0.8, kBending = 240.0, kh = 13.0, kTilt = 1e-5;
  Scene scene;
  for (const double z : {0.0, kSpan}) {
    add_point(scene, 4.0, {0.0, 0.0, z});
    scene.points.back().inertia = Vector3d(kJ, kJ, kJ).asDiagonal();
    scene.wheels.push_back({z > 0.0 ? "upper" : "lower", z > 0.0 ? 1 : 0, Vector3d::UnitZ(), kh, {}});
  }
  add_link(scene, 0, 1, Beam{1e6, 500.0, kBending, kBending, {0.0, 1.0, 0.0}});
  scene.publication.points = {0, 1};
  scene.fidelity = Fidelity::kCoupled;
  scene.rate = 4000.0;
  const Structure structure = build(scene);
  const Freedoms freedoms(scene);
  const double k = 2.0 * kBending / kSpan;
  Plan plan = compile(scene);
  Eigen::Index mode = 0;
  (structure.omega.array() - std::sqrt(k / kJ)).abs().minCoeff(&mode);
  plan.initial.q[static_cast<std::size_t>(mode)] = kTilt;
  Simulation simulation(std::move(plan));
  const auto tilt = [&] {
    const Vector3d phi = joint_rotation(structure, freedoms, 0, simulation.state) -
                         joint_rotation(structure, freedoms, 1, simulation.state);
    return std::complex<double>(phi.x(), phi.y());
  };
  const std::complex<double> start = tilt(), i(0.0, 1.0);
  ASSERT_GT(std::abs(start), 0.5 * kTilt);
  const double root = std::sqrt(kh * kh + 4.0 * kJ * k);
  const double forward = (kh + root) / (2.0 * kJ), backward = (kh - root) / (2.0 * kJ);
  const std::complex<double> of_forward = start * -backward / (forward - backward);  // phi' = 0
  double worst = 0.0;
  for (int tick = 1; tick <= 8000; ++tick) {
    simulation.run(1);
    const double t = tick / scene.rate;
    const std::complex<double> phi =
        of_forward * std::exp(i * forward * t) + (start - of_forward) * std::exp(i * backward * t);
    worst = std::max(worst, std::abs(tilt() - phi) / std::abs(start));
  }
  std::printf("whirls of rotors at %.4f and %.4f rad/s, %.4f at rest: tilt off by %.1e of itself over 2 s\n",
              forward, backward, std::sqrt(k / kJ), worst);
  // the bound is above the error of order 4 at w h = 0.02 over 2 s, and terms of second order in the tilt are
  // only 1e-10
  EXPECT_LT(worst, 1e-6);
}

// The angular momentum H is constant. The body rotates about H at |H| / I_1 and about its axis at w_3 - (I_3
// w_3 + h) / I_1 (Hughes 1986).
TEST(CoupledWheels, ADualSpinBodyPrecessesInClosedForm) {
  constexpr double kI1 = 2.0, kI3 = 3.1, kh = 1.7;
  const Vector3d spin(0.8, -0.3, 0.6);
  Scene scene;
  add_point(scene, 4.0, {0.3, 0.1, -0.2});
  scene.points[0].inertia = Vector3d(kI1, kI1, kI3).asDiagonal();
  scene.publication.points = {0};
  scene.wheels.push_back({"rotor", 0, Vector3d::UnitZ(), kh, {}});
  scene.initial.angular_velocity = spin;
  scene.fidelity = Fidelity::kCoupled;
  const Vector3d H(kI1 * spin[0], kI1 * spin[1], kI3 * spin[2] + kh);
  const double t = 5.0, own = spin[2] - (kI3 * spin[2] + kh) / kI1;
  const Eigen::Quaterniond expected(Eigen::AngleAxisd(H.norm() / kI1 * t, H.normalized()) *
                                    Eigen::AngleAxisd(own * t, Vector3d::UnitZ()));
  std::vector<double> errors;
  for (const double rate : {10.0, 20.0, 40.0, 80.0}) {
    scene.rate = rate;
    Simulation simulation(scene);
    simulation.run(std::llround(t * rate));
    const Quat& q = simulation.state.q_WB;
    errors.push_back(expected.angularDistance(Eigen::Quaterniond(q[0], q[1], q[2], q[3])));
  }
  std::printf("dual spin, coupled, 10 to 80 Hz: off by %.1e %.1e %.1e %.1e rad after 5 s\n", errors[0],
              errors[1], errors[2], errors[3]);
  for (const double error : errors) EXPECT_LT(error, 5e-13);
}

Eigen::Matrix3d rotation_by(const Vector3d& theta) { return exponential(theta).toRotationMatrix(); }

// A wheel adds the term h a . w to the Lagrangian. Here w is the angular velocity of the wheel's body in the
// body's own axes. The step expands this term to second order in the rotation theta. It drops the part that
// is the time derivative of h a . theta, because such a part changes no motion (THEORY 16.32). H and p are
// derivatives of the term, so the error of the angular momentum H is of third order in theta, and that of
// the modal momenta p of second order.
TEST(CoupledWheels, MomentaMatchWheelsWhoseAxesRotateWithTheirBodies) {
  const Scene scene = bodies_with_wheels();
  Scene bare = scene;
  bare.wheels.clear();
  const Structure structure = build(scene);
  const Freedoms freedoms(scene);
  const Eigen::Index n = structure.omega.size();
  std::vector<double> of_H, of_p;
  for (const double size : {0.08, 0.04, 0.02, 0.01}) {
    std::array<Plan, 2> plans{without_load_stiffness(compile(scene)), without_load_stiffness(compile(bare))};
    for (Plan& plan : plans)
      for (std::size_t l = 0; l < static_cast<std::size_t>(n); ++l)
        plan.initial.q[l] = size * std::cos(3.0 * static_cast<double>(l)) / (1.0 + static_cast<double>(l));
    const State with = make_state(plans[0]), without = make_state(plans[1]);
    Vector3d H = Vector3d::Zero();
    Eigen::VectorXd p = Eigen::VectorXd::Zero(n);
    for (const Wheel& wheel : scene.wheels) {
      const Vector3d theta = joint_rotation(structure, freedoms, wheel.point, with);
      H += wheel.momentum * rotation_by(theta) * wheel.axis;
      const auto rows =
          structure.rotations.middleRows<3>(freedoms.rotation(wheel.point) - freedoms.num_displacements());
      for (Eigen::Index l = 0; l < n; ++l) {
        // the angular velocity in the body's own axes comes from differences of its attitude along mode l
        constexpr double kStep = 1e-4;
        const Vector3d along = rows.col(l) / rows.col(l).norm();
        const Eigen::Matrix3d rate =
            (rotation_by(theta + kStep * along) - rotation_by(theta - kStep * along)) / (2.0 * kStep);
        const Eigen::Matrix3d W = rotation_by(theta).transpose() * rate;
        const Vector3d own = Vector3d(W(2, 1), W(0, 2), W(1, 0)) * rows.col(l).norm();
        p[l] += wheel.momentum / structure.mass_properties.mass * wheel.axis.dot(own - rows.col(l));
      }
    }
    of_H.push_back((as_vector(with.H_W) - as_vector(without.H_W) - H).norm());
    const Eigen::Map<const Eigen::VectorXd> p_with(with.coupled.momentum.data(), n),
        p_without(without.coupled.momentum.data(), n);
    of_p.push_back((p_with - p_without - p).norm());
  }
  std::printf("momenta of wheels: H off by %.1e %.1e %.1e %.1e, p by %.1e %.1e %.1e %.1e\n", of_H[0], of_H[1],
              of_H[2], of_H[3], of_p[0], of_p[1], of_p[2], of_p[3]);
  for (std::size_t k = 1; k < of_H.size(); ++k) {
    EXPECT_NEAR(std::log2(of_H[k - 1] / of_H[k]), 3.0, 0.2);
    EXPECT_NEAR(std::log2(of_p[k - 1] / of_p[k]), 2.0, 0.2);
  }
}

// The energy does not drift, because the rates and the momenta derive from the same energy.
TEST(CoupledWheels, EnergyAndMomentumAreConservedToTheOrderOfTheMethod) {
  Scene scene = bodies_with_wheels();
  std::vector<double> drift;
  for (const double rate : {250.0, 500.0, 1000.0, 2000.0}) {
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
  std::printf("energy of bodies with wheels off by %.1e %.1e %.1e %.1e at 250 to 2000 Hz\n", drift[0],
              drift[1], drift[2], drift[3]);
  // the order is measured over all three halvings, because the error changes sign between two of them
  EXPECT_GT(std::log2(drift[0] / drift[3]), 3.0 * 3.5);
}

// The motor drives wheel and body in opposite directions. The energy of body and structure grows by the
// torque times the rate at which the body rotates against the wheel.
TEST(CoupledWheels, AMotorDoesWorkOnTheBodyThatCarriesIt) {
  constexpr double kTorque = 2.0;
  Scene scene = bodies_with_wheels();
  scene.rate = 8000.0;
  const Structure structure = build(scene);
  const Freedoms freedoms(scene);
  Plan plan = without_load_stiffness(compile(scene));
  plan.initial.q[0] = 0.05;
  Simulation simulation(std::move(plan));
  const auto own_rate = [&] {
    const State& state = simulation.state;
    const Eigen::Map<const Eigen::VectorXd> q_dot(state.q_dot.data(), structure.omega.size());
    const Vector3d theta = joint_rotation(structure, freedoms, 0, state),
                   theta_dot = structure.rotations.middleRows<3>(freedoms.rotation(0) -
                                                                 freedoms.num_displacements()) *
                               q_dot,
                   w = as_vector(state.coupled.w_B), &a = scene.wheels[0].axis;
    const Vector3d axis = a + theta.cross(a) + 0.5 * theta.cross(theta.cross(a));
    return w.dot(axis) + a.dot(theta_dot - 0.5 * theta.cross(theta_dot));
  };
  const ForceCommand command = motor_command(kTorque);
  const double energy = energy_of(simulation);
  double work = -kTorque * own_rate();
  constexpr int kTicks = 800;
  for (int tick = 1; tick <= kTicks; ++tick) {
    simulation.run(1, tick == 1 ? std::span(&command, 1) : std::span<const ForceCommand>());
    work -= (tick == kTicks ? 1.0 : tick % 2 == 1 ? 4.0 : 2.0) * kTorque * own_rate();
  }
  work /= 3.0 * scene.rate;
  const double gained = energy_of(simulation) - energy;
  std::printf("a motor on a body: energy %.9f J, work %.9f J\n", gained, work);
  EXPECT_GT(std::abs(gained), 1e-3);
  // Simpson's rule and the step both have order 4
  EXPECT_NEAR(gained, work, 1e-6 * std::abs(work));
}

// The acceleration of a point, which contains w' and q'', agrees with differences of its velocity.
TEST(CoupledWheels, AccelerationsAgreeWithDifferencesOfVelocities) {
  Scene scene = bodies_with_wheels();
  scene.rate = 20000.0;
  Plan plan = compile(scene);
  plan.initial.q[0] = 0.03;
  Simulation simulation(std::move(plan));
  const ForceCommand command = motor_command(0.7);
  simulation.run(500, std::span(&command, 1));
  const PointState before = read_point(simulation.plan, simulation.state, 1);
  simulation.run(1);
  const PointState now = read_point(simulation.plan, simulation.state, 1);
  simulation.run(1);
  const PointState after = read_point(simulation.plan, simulation.state, 1);
  const Vector3d difference = 0.5 * scene.rate * (as_vector(after.v_W) - as_vector(before.v_W));
  std::printf("acceleration %.6g m/s^2, by differences off by %.1e of it\n", difference.norm(),
              (as_vector(now.a_W) - difference).norm() / difference.norm());
  EXPECT_GT(difference.norm(), 0.1);
  // the difference has an error of (w h)^2 / 6 for the highest mode
  EXPECT_LT((as_vector(now.a_W) - difference).norm(), 2e-3 * difference.norm());
}

// Bodies and rotors spin about one axis. A torque proportional to the amplitude accelerates one rotor.
TEST(CoupledWheels, BodiesWithWheelsMatchNewtonEulerToSecondOrderInAmplitude) {
  expect_square_of_amplitude([](double size) {
    Stack stack;
    const double torque = 75.0 * size;
    for (const int k : {0, 2}) {
      const double momentum = k == 0 ? 1.2 : -0.5;
      stack.scene.wheels.push_back({k == 0 ? "lower" : "upper", k, Vector3d::UnitZ(), momentum, {}});
      stack.truth.rotors.push_back({k, Vector3d::UnitZ(), momentum, k == 0 ? torque : 0.0});
    }
    Load load;
    load.name = "speed-up";
    load.wheels = {{0, torque}};
    stack.scene.loads.push_back(load);
    return stack;
  });
}

// When the shadow restarts, it takes the momenta of the wheels from the state. After 0.35 s at 1 N m a wheel
// has 1.45 N m s; a shadow with the momentum of the start would turn by some 0.1 rad against the state.
TEST(CoupledWheels, TheShadowTakesTheMomentaOfWheelsFromTheState) {
  Scene scene = bodies_with_wheels();
  scene.initial.angular_velocity *= 1e-2;
  scene.verdict.horizon = 0.1;
  Watched watched(scene);
  const ForceCommand command = motor_command(1.0);
  double largest = 0.0;
  for (int tick = 0; tick < 350; ++tick)
    largest = std::max(largest, watched.run(1, std::span(&command, tick == 0 ? 1U : 0U)).error.attitude);
  std::printf("bodies with wheels over three horizons of 0.1 s: attitude error at most %.1e rad\n", largest);
  EXPECT_GT(largest, 0.0);
  EXPECT_LT(largest, 1e-4);
}

}  // namespace
}  // namespace freeflex::testing
