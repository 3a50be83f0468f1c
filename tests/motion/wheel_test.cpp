// These tests check wheels in bodies by the dual-spin body in closed form, spin-up of a wheel, and the load
// of a motor on the structure.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "core/step/readout.hpp"
#include "tests/motion/watched.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/simulation.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Vector3d;

Vector3d vector(const Vec3& v) { return {v[0], v[1], v[2]}; }

Scene one_body(const Vector3d& moments, const Vector3d& axis, double momentum) {
  Scene scene;
  add_point(scene, 4.0, {0.3, 0.1, -0.2});
  scene.points[0].inertia = moments.asDiagonal();
  scene.publication.points = scene.pushable = {0};
  scene.wheels.push_back({"rotor", 0, axis, momentum, {}});
  scene.rate = 1000.0;
  return scene;
}

ForceCommand motor(int wheel, double torque) {
  ForceCommand command = make_command(0, 1);
  command.num_wheels = 1;
  command.wheels[0] = {wheel, 0, torque};
  return command;
}

// The body is an axially symmetric gyrostat with constant angular momentum H. The body rotates about H at |H|
// / I_1 and about its own axis at w_3 - (I_3 w_3 + h) / I_1 (Hughes 1986, Spacecraft Attitude Dynamics,
// section 7.1).
TEST(Wheel, ADualSpinBodyPrecessesInClosedForm) {
  constexpr double kI1 = 2.0, kI3 = 3.1, kh = 1.7;
  const Vector3d spin(0.8, -0.3, 0.6);
  Scene scene = one_body({kI1, kI1, kI3}, Vector3d::UnitZ(), kh);
  scene.initial.angular_velocity = spin;
  Simulation simulation(scene);
  const Vector3d H = vector(simulation.state.H_W);
  EXPECT_LT((H - Vector3d(kI1 * spin[0], kI1 * spin[1], kI3 * spin[2] + kh)).norm(), 1e-14);
  simulation.run(5000);
  const double t = 5.0, own = spin[2] - (kI3 * spin[2] + kh) / kI1;
  const Eigen::Quaterniond expected(Eigen::AngleAxisd(H.norm() / kI1 * t, H.normalized()) *
                                    Eigen::AngleAxisd(own * t, Vector3d::UnitZ()));
  const Quat& q = simulation.state.q_WB;
  const double error = expected.angularDistance(Eigen::Quaterniond(q[0], q[1], q[2], q[3]));
  std::printf("dual spin: attitude after 5 s off by %.1e rad\n", error);
  EXPECT_LT(error, 1e-12);
  const Vector3d w = vector(angular_velocity(simulation.plan, simulation.state));
  EXPECT_NEAR(w[2], spin[2], 1e-13);
  EXPECT_NEAR(w.head<2>().norm(), spin.head<2>().norm(), 1e-13);
  EXPECT_EQ(simulation.state.wheel_momentum[0], kh);
}

// A motor drives wheel and body in opposite directions, and their total angular momentum is constant.
TEST(Wheel, AMotorRotatesTheBodyInTheOppositeDirection) {
  constexpr double kI3 = 3.1, kTorque = 0.02;
  Simulation simulation(one_body({2.0, 2.4, kI3}, Vector3d::UnitZ(), 0.0));
  const ForceCommand command = motor(0, kTorque);
  simulation.run(3000, std::span(&command, 1));
  EXPECT_NEAR(simulation.state.wheel_momentum[0], kTorque * 3.0, 1e-15);
  EXPECT_EQ(vector(simulation.state.H_W).norm(), 0.0);
  const Quat& q = simulation.state.q_WB;
  EXPECT_NEAR(2.0 * std::atan2(q[3], q[0]), -0.5 * kTorque / kI3 * 9.0, 1e-13);
  const PointState point = read_point(simulation.plan, simulation.state, 0);
  EXPECT_LT(vector(point.v_W).norm(), 1e-15);
}

constexpr double kSpan = 1.7;
Scene two_on_a_beam(const Vector3d& axis, double momentum) {
  Scene scene;
  for (const double x : {0.0, kSpan}) {
    add_point(scene, 3.0, {x, 0.0, 0.0});
    scene.points.back().inertia = Vector3d(0.4, 0.5, 0.7).asDiagonal();
  }
  add_link(scene, 0, 1, Beam{5e5, 700.0, 900.0, 1300.0, {0.0, 1.0, 0.0}});
  scene.publication.points = scene.pushable = {0, 1};
  scene.wheels.push_back({"rotor", 0, axis, momentum, {}});
  scene.rate = 1000.0;
  return scene;
}

// The torque of a motor loads the structure like a torque on the body that carries the wheel. The resultant
// of the torque on structure and wheel together is zero.
TEST(Wheel, AMotorLoadsTheStructureLikeATorqueOnItsBody) {
  constexpr double kTorque = 0.05;
  Simulation by_motor(two_on_a_beam(Vector3d::UnitX(), 0.0)),
      by_torque(two_on_a_beam(Vector3d::UnitX(), 0.0));
  const ForceCommand motored = motor(0, kTorque);
  ForceCommand pushed = make_command(0, 1, Axes::kBody);
  pushed.num_torques = 1;
  pushed.torques[0] = {0, 0, {-kTorque, 0.0, 0.0}};
  by_motor.run(700, std::span(&motored, 1));
  by_torque.run(700, std::span(&pushed, 1));
  const Eigen::Index n = by_motor.plan.num_elastic;
  const Eigen::Map<const Eigen::VectorXd> a(by_motor.state.q.data(), n), b(by_torque.state.q.data(), n);
  EXPECT_GT(b.norm(), 1e-7);
  EXPECT_LT((a - b).norm(), 1e-11 * b.norm());
  // the angular momentum H stays zero, so I w = -h a
  EXPECT_LT((vector(angular_velocity(by_motor.plan, by_motor.state)) -
             vector(angular_velocity(by_torque.plan, by_torque.state)))
                .norm(),
            1e-14);
  EXPECT_EQ(vector(by_motor.state.H_W).norm(), 0.0);
}

// A torque of a load on a wheel has the same effect as the same torque in a command.
TEST(Wheel, TheTorqueOfALoadActsLikeACommandedTorque) {
  Scene scene = two_on_a_beam(Vector3d(0.6, 0.0, 0.8), 0.3);
  Simulation commanded(scene);
  Load load;
  load.name = "spin-up";
  load.wheels = {{0, 0.04}};
  scene.loads.push_back(load);
  Simulation built(scene);
  const ForceCommand command = motor(0, 0.04);
  commanded.run(400, std::span(&command, 1));
  built.run(400);
  EXPECT_EQ(commanded.state.wheel_momentum, built.state.wheel_momentum);
  EXPECT_EQ(commanded.state.q, built.state.q);
  EXPECT_EQ(commanded.state.q_WB, built.state.q_WB);
}

// The accelerations agree with differences of velocities.
TEST(Wheel, AccelerationsOfPointsIncludeTheMotor) {
  Scene scene = two_on_a_beam(Vector3d(0.6, 0.0, 0.8), 2.0);
  scene.fidelity = Fidelity::kRigid;
  scene.initial.angular_velocity = {0.2, 0.5, -0.4};
  scene.rate = 10000.0;
  Simulation simulation(scene);
  const ForceCommand command = motor(0, 0.7);
  simulation.run(2000, std::span(&command, 1));
  const PointState before = read_point(simulation.plan, simulation.state, 1);
  simulation.run(1);
  const PointState now = read_point(simulation.plan, simulation.state, 1);
  simulation.run(1);
  const PointState after = read_point(simulation.plan, simulation.state, 1);
  const Vector3d difference = 0.5e4 * (vector(after.v_W) - vector(before.v_W));
  EXPECT_GT(difference.norm(), 0.1);
  EXPECT_LT((vector(now.a_W) - difference).norm(), 1e-6 * difference.norm());
}

// A heavy rotor couples bending in two planes. The rung `separated` omits this coupling, so the verdict is
// never `good` while the structure vibrates. For the pair of bending modes, the phase shift h / (2 M w) is
// 0.05 rad per radian of vibration.
TEST(Wheel, VerdictIsNotGoodIfTheRungOmitsGyroscopicCoupling) {
  for (const double momentum : {0.0, 40.0}) {
    Scene scene = two_on_a_beam(Vector3d::UnitX(), momentum);
    scene.initial.modes = {{1, 1e-4, 0.0}, {2, 1e-4, 0.0}, {3, 1e-4, 0.0}, {4, 1e-4, 0.0}};
    Watched watched(scene);
    const Verdict& verdict = watched.run(2000);
    std::printf("h = %g N m s: error %.2e of %.2e m\n", momentum, verdict.error.deformation, verdict.scale);
    if (momentum == 0.0)
      EXPECT_EQ(verdict.level, Verdict::Level::kGood);
    else
      EXPECT_NE(verdict.level, Verdict::Level::kGood);
  }
}

}  // namespace
}  // namespace freeflex::testing
