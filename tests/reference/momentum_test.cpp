// The change of the linear momentum of a body equals the impulse of its loads, and the change of the angular
// momentum equals the integral of their moment.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <boost/numeric/odeint.hpp>
#include <cmath>
#include <random>

#include "tests/support/simulation.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Vector3d;

Vector3d vector(const Vec3& v) { return {v[0], v[1], v[2]}; }

TEST(Momentum, LinearMomentumIsTheImpulseOfRandomCommands) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    std::mt19937_64 engine(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    Simulation simulation(random_structure(seed, 8));
    const Vector3d start = vector(read_invariants(simulation.plan, simulation.state).linear_momentum_W);
    Vector3d impulse = Vector3d::Zero();
    double size = 0.0;  // [N s] sum of |F| dt
    for (int k = 0; k < 200; ++k) {
      // a command may last longer than the interval until the next command, and the commands use one slot
      // after another, so commands add up, are replaced and expire
      const auto ticks = static_cast<std::int64_t>(1 + engine() % 40);
      const auto duration = static_cast<std::int64_t>(1 + engine() % 100);
      ForceCommand command = make_command(k % 50, k + 1, Axes::kWorld, duration);
      for (int item = 0; item < 3; ++item) {
        const Vector3d force(uniform(engine), uniform(engine), uniform(engine));
        add_force(command, static_cast<int>(engine() % 8), force);
        impulse += static_cast<double>(duration) * simulation.plan.period * force;
        size += static_cast<double>(duration) * simulation.plan.period * force.norm();
      }
      simulation.run(ticks, {&command, 1});
    }
    simulation.run(200);  // the run ends after the last command has expired
    ASSERT_EQ(simulation.state.num_slots, 0);
    const Vector3d gained =
        vector(read_invariants(simulation.plan, simulation.state).linear_momentum_W) - start;
    std::printf("seed %d: impulse %.3f N s, error %.1e of the sum of |F| dt\n", static_cast<int>(seed),
                impulse.norm(), (gained - impulse).norm() / size);
    EXPECT_LT((gained - impulse).norm(), 1e-12 * size);
  }
}

// Rates of attitude and angular momentum of the rigid body under world forces at body points, in extended
// precision.
using Rigid = std::array<long double, 7>;  // q w x y z, H_W
struct RigidUnderForces {
  const Plan& plan;
  const ForceCommand& command;
  void operator()(const Rigid& y, Rigid& slope, long double) const {
    const Eigen::Quaternion<long double> q(y[0], y[1], y[2], y[3]);
    const Eigen::Matrix<long double, 3, 1> H(y[4], y[5], y[6]);
    using Row = Eigen::Matrix<long double, 3, 3, Eigen::RowMajor>;
    const Row inverse =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(plan.inverse_inertia.data())
            .cast<long double>();
    const auto w = (inverse * (q.conjugate() * H)).eval();
    const auto q_dot = q * Eigen::Quaternion<long double>(0.0L, w[0], w[1], w[2]);
    slope = {0.5L * q_dot.w(), 0.5L * q_dot.x(), 0.5L * q_dot.y(), 0.5L * q_dot.z(), 0.0L, 0.0L, 0.0L};
    for (int k = 0; k < command.num_points; ++k) {
      const PointForce& item = command.points[static_cast<std::size_t>(k)];
      const Vec3& r = plan.points[static_cast<std::size_t>(item.point)].r;
      const Eigen::Matrix<long double, 3, 1> arm(r[0], r[1], r[2]);
      const Eigen::Matrix<long double, 3, 1> force(item.force[0], item.force[1], item.force[2]);
      const auto moment = (q * arm).cross(force).eval();
      for (int a = 0; a < 3; ++a) slope[static_cast<std::size_t>(4 + a)] += moment[a];
    }
  }
};

Rigid exact_rigid(const Simulation& at_start, const ForceCommand& command, double time) {
  const State& state = at_start.state;
  Rigid y = {state.q_WB[0], state.q_WB[1], state.q_WB[2], state.q_WB[3],
             state.H_W[0],  state.H_W[1],  state.H_W[2]};
  namespace odeint = boost::numeric::odeint;
  odeint::runge_kutta_fehlberg78<Rigid, long double> stepper;
  // steps of some 5e-3 rad with order eight have errors far below the rounding error of double precision
  const long double h = time / 2000.0L;
  for (int k = 0; k < 2000; ++k) stepper.do_step(RigidUnderForces{at_start.plan, command}, y, k * h, h);
  return y;
}

TEST(Momentum, AngularMomentumUnderWorldForcesIsAccurateAtAnyTickLength) {
  constexpr double kTime = 2.0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    std::mt19937_64 engine(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    Scene scene = random_structure(seed, 8);
    scene.initial.angular_velocity = {2.0, -1.0, 3.0};
    ForceCommand command = make_command(0, 1);
    for (int point = 0; point < 3; ++point) {
      add_force(command, point, 20.0 * Vector3d(uniform(engine), uniform(engine), uniform(engine)));
    }
    for (const double rate : {5.0, 50.0, 100.0, 200.0, 400.0}) {
      scene.rate = rate;
      Simulation simulation(scene);
      const Rigid exact = exact_rigid(simulation, command, kTime);
      const Vector3d H(static_cast<double>(exact[4]), static_cast<double>(exact[5]),
                       static_cast<double>(exact[6]));
      simulation.run(std::llround(kTime * scene.rate), {&command, 1});
      const double error = (vector(simulation.state.H_W) - H).norm() / H.norm();
      std::printf("seed %d at %g Hz: angular momentum error %.2e\n", static_cast<int>(seed), rate, error);
      // at 5 Hz the body rotates by 0.7 rad per tick; at the other rates only rounding errors of a few
      // hundred ticks remain
      EXPECT_LT(error, rate < 50.0 ? 1e-9 : 1e-12) << rate;
    }
  }
}

TEST(Momentum, LinearAndAngularMomentumKeepEveryBitWithoutLoads) {
  Scene scene = random_structure(4, 9);
  scene.initial.angular_velocity = {0.5, 1.5, -1.0};
  scene.initial.velocity = {1.0, -0.3, 0.2};
  Simulation simulation(scene);
  const Vec3 v = simulation.state.v_WB, H = simulation.state.H_W;
  simulation.run(100000);
  EXPECT_EQ(simulation.state.v_WB, v);
  EXPECT_EQ(simulation.state.H_W, H);
}

}  // namespace
}  // namespace freeflex::testing
