// Random bodies with wheels, at any rate and any turn per tick, against SUNDIALS: none is good where it is
// wrong.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "core/reference/sundials_solver.hpp"
#include "core/step/readout.hpp"
#include "core/step/tick_turn.hpp"
#include "core/validity/judgement.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/simulation.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Matrix3d, Eigen::Quaterniond, Eigen::Vector3d;

struct Body {
  Matrix3d inertia;
  Vector3d spin, wheel;  // [rad/s], [N m s]
  double rate = 0.0;     // [Hz]
};

Body random_body(std::mt19937_64& engine) {
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine);
  };
  const auto decades = [&](double low, double high) { return std::pow(10.0, between(low, high)); };
  const auto direction = [&] {
    return Vector3d(between(-1, 1), between(-1, 1), between(-1, 1)).normalized();
  };
  const double thin = decades(-6.0, 0.0), other = between(thin, 1.0), a = between(0.3, 1.0);
  const std::array<Vector3d, 3> kinds{Vector3d(thin, 1.0, between(1.0, 1.0 + thin)),
                                      Vector3d(1.0, other, 1.0 + other),
                                      Vector3d(a, 1.0, between(1.0, 1.0 + a))};
  const Vector3d moments = kinds[engine() % 3];
  const Matrix3d axes =
      Quaterniond(between(-1, 1), between(-1, 1), between(-1, 1), between(-1, 1)).normalized().matrix();
  Body body;
  body.inertia = axes * moments.asDiagonal() * axes.transpose();
  body.inertia = (0.5 * (body.inertia + body.inertia.transpose())).eval();
  body.rate = decades(0.0, 4.0);
  body.spin = decades(-3.0, 0.5) * body.rate * direction();
  body.wheel = Vector3d::Zero();
  if (engine() % 3 != 0) body.wheel = decades(-2.0, 3.0) * (body.inertia * body.spin).norm() * direction();
  return body;
}

/// Attitude of the body after a time, by Euler's equations in its own axes with the attitude beside them.
std::string turn_by_sundials(const Body& body, double time, Quaterniond& attitude) {
  const double unit = body.spin.norm();
  const Matrix3d inverse = body.inertia.inverse();
  SmoothProblem problem;
  problem.slope = [&](double, std::span<const double> y, std::span<double> y_dot) {
    const Quaterniond q(y[0], y[1], y[2], y[3]);
    const Vector3d w = unit * Vector3d(y[4], y[5], y[6]), half = 0.5 * w;
    const Quaterniond rate = q * Quaterniond(0.0, half.x(), half.y(), half.z());
    const Vector3d w_dot = inverse * (body.inertia * w + body.wheel).cross(w) / unit;
    const std::array<double, 8> all{rate.w(), rate.x(), rate.y(), rate.z(),
                                    w_dot[0], w_dot[1], w_dot[2], 0.0};
    std::copy(all.begin(), all.end(), y_dot.begin());
  };
  ReferenceOptions options;
  options.tolerance = 1e-12;
  const Vector3d start = body.spin / unit;
  std::vector<double> y{1.0, 0.0, 0.0, 0.0, start[0], start[1], start[2], 0.0};
  SundialsSolver solver(problem, options, {1.0, 1.0}, 0.0, y);
  const std::string error = solver.advance(time, y);
  attitude = Quaterniond(y[0], y[1], y[2], y[3]).normalized();
  return error;
}

// 100 s, or as far as the reference turns by 20,000 rad and the ticks number 3000
TEST(TicksLong, NoneOfAThousandRandomBodiesIsGoodWhereItIsWrong) {
  std::mt19937_64 engine(2026);
  int num_good = 0, num_outside = 0, num_tried = 0;
  double worst_good = 0.0, worst_energy = 0.0;
  for (int k = 0; k < 1000; ++k) {
    const Body body = random_body(engine);
    Scene scene;
    add_point(scene, 1.0, Vector3d::Zero());
    scene.points[0].inertia = body.inertia;
    scene.publication.points = scene.pushable = {0};
    scene.rate = body.rate;
    scene.fidelity = k % 2 == 0 ? Fidelity::kSeparated : Fidelity::kCoupled;
    scene.initial.angular_velocity = body.spin;
    if (!body.wheel.isZero(0.0))
      scene.wheels.push_back({"w", 0, body.wheel.normalized(), body.wheel.norm(), {}});
    Simulation simulation(scene);
    Judgement judgement(simulation.plan);
    Budget none;
    judgement.take(simulation.state, none);
    StepLoads loads;
    loads.wheels.h[0] = wheel_momentum_B(simulation.plan, simulation.state);
    const TickTurn turn =
        turn_in_tick(simulation.plan, simulation.state, rotation_matrix(simulation.state.q_WB), loads);
    const double ticks_of_reference = 2e4 / std::max(turn.whole, turn.uneven);
    const auto ticks = static_cast<std::int64_t>(
        std::clamp(std::min({100.0 * body.rate, 3000.0, ticks_of_reference}), 1.0, 3000.0));
    const double energy = read_invariants(simulation.plan, simulation.state).kinetic_rigid;
    for (std::int64_t tick = 0; tick < ticks; ++tick) {
      simulation.run(1);
      judgement.take(simulation.state, none);
    }
    const bool is_good = judgement.worst().tick == -1;
    num_outside += judgement.worst().word == Verdict::Word::kOutside ? 1 : 0;
    if (!is_good) continue;
    ++num_good;
    worst_energy =
        std::max(worst_energy,
                 std::abs(read_invariants(simulation.plan, simulation.state).kinetic_rigid / energy - 1.0));
    if (turn.whole * static_cast<double>(ticks) > 4e4) continue;  // the reference would not end
    ++num_tried;
    Quaterniond right;
    ASSERT_EQ(turn_by_sundials(body, static_cast<double>(ticks) / body.rate, right), "");
    const Quat& q = simulation.state.q_WB;
    const double off = right.angularDistance(Quaterniond(q[0], q[1], q[2], q[3]));
    worst_good = std::max(worst_good, off);
    EXPECT_LT(off, 0.05) << "body " << k << ": " << turn.whole << " rad a tick, " << ticks << " ticks";
  }
  std::printf(
      "1000 random bodies: %d good, %d outside; of the good %d were held against SUNDIALS, the worst "
      "attitude off "
      "by %.1e rad, the worst energy by %.1e\n",
      num_good, num_outside, num_tried, worst_good, worst_energy);
  EXPECT_GT(num_good, 900);
  EXPECT_LT(worst_energy, 1e-9);
}

}  // namespace
}  // namespace freeflex::testing
