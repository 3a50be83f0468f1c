// Translation and rotation of the body in the complete step under gravity, forces and torques.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "core/step/readout.hpp"
#include "core/step/rigid/principal.hpp"
#include "core/step/vector.hpp"
#include "tests/step/hand_plan.hpp"

namespace freeflex::testing {
namespace {

double norm(const Vec3& a) { return std::sqrt(dot(a, a)); }
double distance(const Vec3& a, const Vec3& b) { return norm(sub(a, b)); }
/// Returns the angle between two attitudes [rad].
double angle(const Quat& a, const Quat& b) {
  const Quat c = multiply({a[0], -a[1], -a[2], -a[3]}, b);
  return 2.0 * std::asin(std::min(1.0, std::sqrt(c[1] * c[1] + c[2] * c[2] + c[3] * c[3])));
}

TEST(Translation, ABodyFallsWithConstantAcceleration) {
  StepPlan plan = hand_plan(1e-3, {});
  plan.gravity_W = {0.3, -0.2, -9.81};
  plan.initial.p_WB = {1.0, 2.0, 3.0};
  plan.initial.v_WB = {-4.0, 0.5, 20.0};
  HandRun run(plan);
  constexpr std::int64_t kTicks = 1000000;
  run.run(kTicks);
  const double t = static_cast<double>(kTicks) * plan.period;
  for (std::size_t i = 0; i < 3; ++i) {
    const double v = plan.initial.v_WB[i] + plan.gravity_W[i] * t;
    const double p = plan.initial.p_WB[i] + plan.initial.v_WB[i] * t + 0.5 * plan.gravity_W[i] * t * t;
    // at each tick the products h g and h v are rounded by at most eps / 2 of their value; rounding errors of
    // sums are compensated
    EXPECT_NEAR(run.state.v_WB[i], v, 4e-16 * std::abs(v));
    EXPECT_NEAR(run.state.p_WB[i], p, 1e-15 * (std::abs(p) + std::abs(plan.initial.v_WB[i] * t)));
  }
}

TEST(Translation, MomentumEqualsTheImpulseOfCommandsAndPulses) {
  StepPlan plan = hand_plan(1e-3, {}, 5);
  const PointForce pushed{3, 0, {0.2, -0.7, 0.1}};
  PlanHistory pulse;
  pulse.kind = PlanHistory::Kind::kPulse;
  pulse.start_tick = 17;
  pulse.end_tick = 117;
  pulse.pattern = build_pattern(plan, {0, std::span(&pushed, 1), {}, {}});
  plan.histories.push_back(pulse);
  plan.initial.w_B = {0.4, -2.0, 1.0};
  HandRun run(plan);
  ForceCommand command = hand_command("test", 0);
  command.duration_ticks = 321;
  add_force(command, 1, {3.0, 1.0, -2.0});
  run.run(1000, std::span(&command, 1));
  const double h = plan.period;
  const Vec3 impulse = add(scale(321 * h, command.points[0].force), scale(100 * h, pushed.force));
  EXPECT_LE(distance(scale(plan.mass, run.state.v_WB), impulse), 1e-12 * norm(impulse));
}

/// Returns the state after `time` of a spinning body under forces in world and in body axes.
State pushed_body(double period, double time, const std::vector<ForceCommand>& commands) {
  StepPlan plan = hand_plan(period, {}, 4);
  plan.initial.w_B = {0.5, 2.0, -1.0};
  HandRun run(plan);
  run.run(std::llround(time / period), commands);
  return run.state;
}

/// Compares the motion over ticks in which the body rotates by up to 1 rad with the motion over ticks in
/// which it rotates by 1 mrad.
void expect_right_at_any_tick(const char* what, const std::vector<ForceCommand>& commands, double most) {
  constexpr double kTime = 2.0;
  const State exact = pushed_body(1.0 / 2048, kTime, commands);
  for (const double period : {1.0 / 2, 1.0 / 8, 1.0 / 16, 1.0 / 32, 1.0 / 64, 1.0 / 128, 1.0 / 512}) {
    const State state = pushed_body(period, kTime, commands);
    const double error = angle(state.q_WB, exact.q_WB) + distance(state.H_W, exact.H_W) +
                         distance(state.v_WB, exact.v_WB) + distance(state.p_WB, exact.p_WB);
    std::printf("%s, h = 1/%g s: error %.2e\n", what, 1 / period, error);
    EXPECT_LT(error, most) << what << ", " << period << " s";
  }
}

// flows_test checks the order of convergence over long ticks. The next two tests cover both short and long
// ticks, which are advanced by different methods.
TEST(Rotation, RotationUnderWorldForcesIsAccurateAtAnyTickLength) {
  ForceCommand command = hand_command("test", 0);
  add_force(command, 0, {3.0, 1.0, -2.0});
  add_force(command, 2, {-1.0, 2.0, 1.0});
  expect_right_at_any_tick("world forces", {command}, 1e-9);
}

TEST(Rotation, RotationUnderBodyForcesIsAccurateAtAnyTickLength) {
  ForceCommand command = hand_command("test", 0, 1);
  add_force(command, 1, {3.0, 1.0, -2.0});
  expect_right_at_any_tick("body forces", {command}, 1e-9);
}

TEST(Rotation, SpinAboutAPrincipalAxisIsConstant) {
  StepPlan plan = hand_plan(1e-3, {});
  plan.initial.w_B = {0.0, 0.0, 3.0};
  HandRun run(plan);
  constexpr std::int64_t kTicks = 100000;
  run.run(kTicks);
  const double half = 0.5 * 3.0 * static_cast<double>(kTicks) * plan.period;
  const Quat exact = {std::cos(half), 0.0, 0.0, std::sin(half)};
  // the bound is the error of the method, (omega h)^7 / (7! 2^6) per tick, plus rounding errors proportional
  // to the angle
  EXPECT_LE(angle(run.state.q_WB, exact), 1e-13 + 4e-16 * 2.0 * half);
  EXPECT_LE(std::abs(read_invariants(plan, run.state).quaternion_norm_error), 4e-16);
}

TEST(Rotation, ATorqueFixedInTheBodySpinsItUpAboutAPrincipalAxis) {
  StepPlan plan = hand_plan(1e-3, {}, 6);
  plan.groups.push_back(hand_group(plan, {0, 1, 2, 3, 4, 5}));
  HandRun run(plan);
  ForceCommand command = hand_command("test", 0, 1);
  add_wrench(command, 0, {}, {0.0, 0.7, 0.0});
  constexpr std::int64_t kTicks = 2000;
  run.run(kTicks, std::span(&command, 1));
  const double t = static_cast<double>(kTicks) * plan.period;
  EXPECT_NEAR(angular_velocity(plan, run.state)[1], 0.7 / 3.0 * t, 1e-13);
  const double half = 0.25 * 0.7 / 3.0 * t * t;
  EXPECT_LE(angle(run.state.q_WB, {std::cos(half), 0.0, std::sin(half), 0.0}), 1e-12);
}

TEST(Rotation, ACollinearBodyHasNoSpinAboutItsLine) {
  StepPlan plan = hand_plan(1e-3, {}, 2);
  plan.points[0].r = {-1.0, 0.0, 0.0};
  plan.points[1].r = {1.0, 0.0, 0.0};
  plan.inertia = {0, 0, 0, 0, 2.0, 0, 0, 0, 2.0};
  plan.inverse_inertia = {0, 0, 0, 0, 0.5, 0, 0, 0, 0.5};
  set_principal(plan);
  plan.line = {1.0, 0.0, 0.0};
  plan.rigid_freedoms = 5;
  plan.initial.w_B = {0.0, 1.0, 0.5};
  HandRun run(plan);
  ForceCommand command = hand_command("test", 0);
  add_force(command, 0, {0.3, 0.2, -0.1});
  run.run(5000, std::span(&command, 1));
  EXPECT_EQ(angular_velocity(plan, run.state)[0], 0.0);
  // the loads have no moment about the line, so the angular momentum about the line is zero
  EXPECT_LE(std::abs(multiply_transposed(rotation_matrix(run.state.q_WB), run.state.H_W)[0]),
            1e-13 * norm(run.state.H_W));
}

TEST(Rotation, ASinglePointDoesNotRotate) {
  StepPlan plan = hand_plan(1e-3, {}, 1);
  plan.points[0].r = {};
  plan.inertia = plan.inverse_inertia = {};
  set_principal(plan);
  plan.rigid_freedoms = 3;
  HandRun run(plan);
  ForceCommand command = hand_command("test", 0, 1);
  add_force(command, 0, {0.3, 0.2, -0.1});
  run.run(1000, std::span(&command, 1));
  EXPECT_EQ(run.state.q_WB, (Quat{1.0, 0.0, 0.0, 0.0}));
  EXPECT_NEAR(run.state.v_WB[0], 0.3 / plan.mass * 1.0, 1e-15);
}

TEST(Rotation, AForceInBodyAxesOnASteadilySpinningBodyGivesACircularPath) {
  StepPlan plan = hand_plan(1e-3, {}, 1);
  plan.points[0].r = {};  // the point is at the centre of mass, so that there is no moment
  plan.initial.w_B = {0.0, 0.0, 2.0};
  HandRun run(plan);
  ForceCommand command = hand_command("test", 0, 1);
  add_force(command, 0, {0.5, 0.0, 0.0});
  constexpr std::int64_t kTicks = 3000;
  run.run(kTicks, std::span(&command, 1));
  const double t = static_cast<double>(kTicks) * plan.period, a = 0.5 / plan.mass, w = 2.0;
  // the error of Simpson's rule is h^4 w^4 / 2880 times the acceleration, which is below the tolerance
  EXPECT_NEAR(run.state.v_WB[0], a / w * std::sin(w * t), 1e-13);
  EXPECT_NEAR(run.state.v_WB[1], a / w * (1.0 - std::cos(w * t)), 1e-13);
  EXPECT_NEAR(run.state.p_WB[0], a / (w * w) * (1.0 - std::cos(w * t)), 1e-13);
  EXPECT_NEAR(run.state.p_WB[1], a / (w * w) * (w * t - std::sin(w * t)), 1e-13);
}

}  // namespace
}  // namespace freeflex::testing
