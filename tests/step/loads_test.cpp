// Loads: patterns, projections onto modes, wrenches, and amplitudes of histories just before and just after
// ticks.
#include "core/step/loads/loads.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/step/loads/history.hpp"
#include "core/step/readout.hpp"
#include "core/step/vector.hpp"
#include "tests/step/hand_plan.hpp"
#include "tools/verification/reference/closed_form.hpp"

namespace freeflex::testing {
namespace {

const std::vector<Mode> kModes(11, Mode{100.0, 1.0, 0.0, 0.0});
const Quat kAttitude = {0.5, 0.1, -0.7, 0.5};

Mat3 some_rotation() {
  const double norm = std::sqrt(0.25 + 0.01 + 0.49 + 0.25);
  return rotation_matrix(
      {kAttitude[0] / norm, kAttitude[1] / norm, kAttitude[2] / norm, kAttitude[3] / norm});
}

StepPlan loads_plan() {
  StepPlan plan = hand_plan(1e-3, kModes, 7);
  plan.groups.push_back(hand_group(plan, {1, 3, 4, 6}));
  plan.points[2].r = add_scaled(plan.points[0].r, 0.5, sub(plan.points[5].r, plan.points[0].r));
  plan.groups.push_back(hand_group(plan, {0, 2, 5}));  // on a line
  plan.groups.push_back(hand_group(plan, {4}));
  return plan;
}

/// Returns Q_l = sum_i F_i . b_il for forces F_i in body axes, point by point (THEORY 4.20).
std::vector<double> direct_sum(const StepPlan& plan, const std::vector<Vec3>& force_B) {
  std::vector<double> Q(static_cast<std::size_t>(plan.num_padded), 0.0);
  for (std::size_t i = 0; i < force_B.size(); ++i)
    for (int l = 0; l < plan.num_elastic; ++l)
      Q[static_cast<std::size_t>(l)] += dot(force_B[i], hand_shape(static_cast<int>(i), l));
  return Q;
}

std::vector<double> projected(const StepPlan& plan, const LoadPattern& pattern, const Mat3& R,
                              double amplitude = 1.0) {
  std::vector<double> Q(static_cast<std::size_t>(plan.num_padded), 0.0);
  EXPECT_TRUE(project(plan, pattern, R, amplitude, false, Q.data()));
  return Q;
}

void expect_equal(const std::vector<double>& found, const std::vector<double>& exact, double tolerance) {
  for (std::size_t l = 0; l < exact.size(); ++l) EXPECT_NEAR(found[l], exact[l], tolerance) << "mode " << l;
}

constexpr double kRounding = 1e-14;  // sums of some ten terms of order one

TEST(Loads, TheProjectionWithOrWithoutATableIsTheSumOverPoints) {
  const StepPlan plan = loads_plan();
  const Mat3 R = some_rotation();
  for (const int num_pushed : {1, 2, 3, 4, 7}) {
    std::vector<PointForce> forces;
    std::vector<Vec3> force_B(7);
    for (int i = 0; i < num_pushed; ++i) {
      const Vec3 F = {1.0 + i, -0.5 * i, 2.0};
      forces.push_back({i, 0, F});
      force_B[static_cast<std::size_t>(i)] = scale(1.5, multiply_transposed(R, F));
    }
    const LoadPattern pattern = build_pattern(plan, {0, forces, {}, {}});
    EXPECT_EQ(pattern.uses_table, num_pushed > LoadPattern::kMaxDirect);
    expect_equal(projected(plan, pattern, R, 1.5), direct_sum(plan, force_B), 4 * kRounding);
  }
}

TEST(Loads, TheProjectionOfForcesInBodyAxesDoesNotDependOnTheAttitude) {
  const StepPlan plan = loads_plan();
  const std::vector<PointForce> forces = {{2, 0, {1.0, 2.0, 3.0}}, {5, 0, {-1.0, 0.5, 0.0}}};
  const LoadPattern pattern = build_pattern(plan, {1, forces, {}, {}});
  std::vector<Vec3> force_B(7);
  for (const PointForce& f : forces) force_B[static_cast<std::size_t>(f.point)] = f.force;
  expect_equal(projected(plan, pattern, some_rotation()), direct_sum(plan, force_B), kRounding);
  expect_equal(projected(plan, pattern, rotation_matrix({1, 0, 0, 0})), direct_sum(plan, force_B), kRounding);
}

/// Returns the forces on points, in body axes, as which a wrench is distributed by definition (THEORY 8.8).
std::vector<Vec3> spread(const StepPlan& plan, std::size_t group_index, const Vec3& F_B, const Vec3& T_B) {
  const PlanGroup& group = plan.groups[group_index];
  std::vector<Vec3> forces(plan.points.size());
  for (const std::int32_t i : group.points) {
    const PlanPoint& point = plan.points[static_cast<std::size_t>(i)];
    const Vec3 angular = cross(multiply(group.inverse_inertia, T_B), sub(point.r, group.centre));
    forces[static_cast<std::size_t>(i)] = scale(point.mass, add_scaled(angular, 1.0 / group.mass, F_B));
  }
  return forces;
}

TEST(Wrench, PointForcesOfAWrenchHaveItsForceTorqueAndProjection) {
  const StepPlan plan = loads_plan();
  const Mat3 R = some_rotation();
  const Vec3 F = {1.0, -2.0, 0.5}, T = {0.3, 0.7, -1.1};
  for (std::size_t k = 0; k < plan.groups.size(); ++k) {
    const Wrench wrench{static_cast<std::int32_t>(k), 0, F, T};
    for (const std::int32_t axes : {0, 1}) {
      const LoadPattern pattern = build_pattern(plan, {axes, {}, std::span(&wrench, 1), {}});
      const Vec3 F_B = axes == 0 ? multiply_transposed(R, F) : F,
                 T_B = axes == 0 ? multiply_transposed(R, T) : T;
      const std::vector<Vec3> forces = spread(plan, k, F_B, T_B);
      expect_equal(projected(plan, pattern, R), direct_sum(plan, forces), 4 * kRounding);
      // compare the resultant and the moment of these forces with those that the frame computes from the
      // pattern
      Vec3 resultant{}, moment{};
      for (std::size_t i = 0; i < forces.size(); ++i) {
        resultant = add(resultant, forces[i]);
        moment = add(moment, cross(plan.points[i].r, forces[i]));
      }
      StepPlan unrotated = plan;
      unrotated.initial.q_WB = {1.0, 0.0, 0.0, 0.0};
      Vec3 moment_found = pattern.torque_B;
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t a = 0; a < 3; ++a)
          for (std::size_t b = 0; b < 3; ++b)
            moment_found[c] += R[3 * b + a] * pattern.moment_W[9 * c + 3 * a + b];
      const Vec3 force_found = add(multiply_transposed(R, pattern.force_W), pattern.force_B);
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(force_found[i], resultant[i], kRounding);
        EXPECT_NEAR(force_found[i], F_B[i], kRounding);
        EXPECT_NEAR(moment_found[i], moment[i], 4 * kRounding);
      }
    }
  }
}

TEST(Wrench, ATorqueAlongTheLineOfACollinearGroupHasNoEffect) {
  const StepPlan plan = loads_plan();
  const Wrench along{1, 0, {}, scale(3.0, plan.groups[1].line)};
  HandRun run(plan);
  ForceCommand command = hand_command("test", 0, 1);
  add_wrench(command, 1, along.force, along.torque);
  run.run(10, std::span(&command, 1));
  EXPECT_LE(std::sqrt(dot(run.state.H_W, run.state.H_W)), 1e-16);
  for (const double Q : run.state.Q) EXPECT_LE(std::abs(Q), 1e-13);
}

TEST(Wrench, AWrenchMovesTheBodyLikeItsPointForces) {
  const StepPlan plan = loads_plan();
  const Vec3 F = {0.2, 0.1, -0.3}, T = {0.3, 0.7, -1.1};
  HandRun by_wrench(plan), by_forces(plan);
  ForceCommand wrench = hand_command("test", 0, 1), forces = hand_command("test", 0, 1);
  add_wrench(wrench, 0, F, T);
  const std::vector<Vec3> f = spread(plan, 0, F, T);
  for (int i = 0; i < 7; ++i) add_force(forces, i, f[static_cast<std::size_t>(i)]);
  by_wrench.run(500, std::span(&wrench, 1));
  by_forces.run(500, std::span(&forces, 1));
  for (std::size_t l = 0; l < by_wrench.state.q.size(); ++l)
    EXPECT_NEAR(by_wrench.state.q[l], by_forces.state.q[l], 1e-16);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(by_wrench.state.H_W[i], by_forces.state.H_W[i], 1e-14);
}

PlanHistory history_of(const StepPlan& plan, PlanHistory::Kind kind) {
  PlanHistory history;
  history.kind = kind;
  const PointForce force{0, 0, {1.0, 0.0, 0.0}};
  history.pattern = build_pattern(plan, {1, std::span(&force, 1), {}, {}});
  return history;
}

TEST(History, APulseActsFromItsStartTickUntilItsEndTick) {
  PlanHistory pulse;
  pulse.kind = PlanHistory::Kind::kPulse;
  pulse.start_tick = 3;
  pulse.end_tick = 5;
  const std::vector<double> right = {0, 0, 0, 1, 1, 0, 0}, left = {0, 0, 0, 0, 1, 1, 0};
  for (std::int64_t tick = 0; tick < 7; ++tick) {
    EXPECT_EQ(amplitude_right(pulse, 1e-3, tick), right[static_cast<std::size_t>(tick)]) << tick;
    EXPECT_EQ(amplitude_left(pulse, 1e-3, tick), left[static_cast<std::size_t>(tick)]) << tick;
    EXPECT_EQ(amplitude_middle(pulse, 1e-3, tick), right[static_cast<std::size_t>(tick)]) << tick;
  }
}

TEST(History, ASineKeepsItsPhaseForATrillionTicks) {
  PlanHistory sine;
  sine.kind = PlanHistory::Kind::kSine;
  std::mt19937_64 engine(3);
  std::uniform_real_distribution<double> frequency(0.01, 499.0), phase(-1.0, 1.0);
  std::uniform_int_distribution<std::int64_t> ticks(0, 1000000000000);
  const Real two_pi = 2 * boost::math::constants::pi<Real>();
  for (int k = 0; k < 200; ++k) {
    sine.frequency = frequency(engine);
    sine.phase = phase(engine);
    const std::int64_t tick = k < 20 ? k : ticks(engine);
    const Real cycles = Real(tick) * Real(1e-3) * Real(sine.frequency) + Real(sine.phase);
    const double exact = sin(two_pi * cycles).convert_to<double>();
    // the slope of the sine, 2 pi, multiplies the rounding error of the phase, which is at most 1/2 cycle
    EXPECT_NEAR(amplitude_right(sine, 1e-3, tick), exact, 8e-16);
    const Real middle = cycles + Real(1e-3) * Real(sine.frequency) / 2;
    EXPECT_NEAR(amplitude_middle(sine, 1e-3, tick), sin(two_pi * middle).convert_to<double>(), 8e-16);
  }
}

TEST(History, ATableIsLinearBetweenRowsAndConstantOutsideThem) {
  PlanHistory table;
  table.kind = PlanHistory::Kind::kTable;
  table.times = {1.0, 2.0, 4.0};
  table.values = {10.0, -10.0, 30.0};
  const auto at = [&](std::int64_t tick) { return amplitude_right(table, 0.25, tick); };
  EXPECT_EQ(at(0), 10.0);
  EXPECT_EQ(at(4), 10.0);
  EXPECT_EQ(at(6), 0.0);
  EXPECT_EQ(at(8), -10.0);
  EXPECT_EQ(at(12), 10.0);
  EXPECT_EQ(at(16), 30.0);
  EXPECT_EQ(at(100), 30.0);
  EXPECT_EQ(amplitude_middle(table, 0.25, 5), amplitude_right(table, 0.125, 11));
}

TEST(History, APulseDrivesAModeAsInClosedForm) {
  StepPlan plan = hand_plan(1e-3, kModes, 1);
  plan.points[0].r = {};
  PlanHistory pulse = history_of(plan, PlanHistory::Kind::kPulse);
  pulse.start_tick = 10;
  pulse.end_tick = 35;
  plan.histories.push_back(pulse);
  HandRun run(plan);
  run.run(100);
  for (std::size_t l = 0; l < kModes.size(); ++l) {
    const Real w(kModes[l].omega), d(kModes[l].decay), h(plan.period),
        a = Real(hand_shape(0, static_cast<int>(l))[0]) / 2;
    const OscillatorMotion at_end = oscillate(w, d, 0, 0, a, 0, 25 * h);
    const OscillatorMotion exact = oscillate(w, d, at_end.q, at_end.q_dot, 0, 0, 65 * h);
    EXPECT_NEAR(run.state.q[l], exact.q.convert_to<double>(),
                1e-15 * std::abs(a.convert_to<double>()) / 100.0);
    EXPECT_NEAR(run.state.q_dot[l], exact.q_dot.convert_to<double>(),
                1e-15 * std::abs(a.convert_to<double>()));
  }
}

TEST(History, TheTimeOfAHistoryIsCountedFromTheStartOfTheEpoch) {
  StepPlan plan = hand_plan(1e-3, kModes, 1);
  PlanHistory pulse = history_of(plan, PlanHistory::Kind::kPulse);
  pulse.start_tick = 5;
  pulse.end_tick = 9;
  plan.histories.push_back(pulse);
  HandRun run(plan);
  run.run(40);
  const Array first = run.state.q;
  reset_state(plan, run.state);
  EXPECT_EQ(run.state.tick, 40);
  EXPECT_EQ(run.state.epoch, 1);
  run.run(40);
  EXPECT_EQ(run.state.q, first);
  EXPECT_NE(first[0], 0.0);
}

// In a large structure few points have mode-shape rows.
TEST(Loads, LoadsTakeMemoryOnlyForPointsWithModeShapeRows) {
  constexpr int kWithRows = 3;
  const StepPlan plan = hand_plan(1e-3, kModes, kWithRows);
  StepPlan large = plan;
  for (int k = 0; k < 1000; ++k)
    large.points.insert(large.points.begin() + k % 2, PlanPoint{"", 0.0, {}, -1, false});
  const auto has_rows = [](const PlanPoint& point) { return point.row >= 0; };
  EXPECT_EQ(make_load_sums(large).force_W.size(), std::size_t{kWithRows});
  HandRun run(plan), large_run(large);
  std::vector<ForceCommand> pushes, large_pushes;
  for (const std::int32_t axes : {0, 1}) {
    ForceCommand push = hand_command("test", axes, axes), large_push = push;
    std::int32_t index = 0;
    for (int k = 0; k < kWithRows; ++k, ++index) {
      while (!has_rows(large.points[static_cast<std::size_t>(index)])) ++index;
      const Vec3 force = {1.0 + k, -0.5 * k, 0.25};
      add_force(push, k, force);
      add_force(large_push, index, force);
    }
    pushes.push_back(push);
    large_pushes.push_back(large_push);
  }
  run.run(50, pushes);
  large_run.run(50, large_pushes);
  EXPECT_EQ(run.state.q, large_run.state.q);
  EXPECT_EQ(run.state.q_WB, large_run.state.q_WB);
}

TEST(Loads, TheStateKeepsTheLeftLimitOfTheLoads) {
  const StepPlan plan = hand_plan(1e-3, kModes, 1);
  HandRun run(plan);
  ForceCommand push = hand_command("test", 0, 1), clear = hand_command("test", 0, 1);
  add_force(push, 0, {2.0, 0.0, 0.0});
  for (const double force : run.state.force_W) EXPECT_EQ(force, 0.0);
  run.run(1, std::span(&push, 1));
  EXPECT_EQ(multiply_transposed(rotation_matrix(run.state.q_WB), run.state.force_W)[0], 2.0);
  EXPECT_EQ(run.state.Q[3], 2.0 * hand_shape(0, 3)[0]);
  run.run(1, std::span(&clear, 1));
  EXPECT_EQ(run.state.force_W[0], 0.0);
  EXPECT_EQ(run.state.Q[3], 0.0);
}

}  // namespace
}  // namespace freeflex::testing
