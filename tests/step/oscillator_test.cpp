// The modal coordinates after n complete steps, of single oscillators and of a structure, compared with the
// closed form at t = n h.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>

#include "core/plan/rungs/rates.hpp"
#include "core/rounding.hpp"
#include "tests/step/hand_plan.hpp"
#include "tests/support/simulation.hpp"
#include "tests/support/structures.hpp"
#include "tools/verification/reference/closed_form.hpp"

namespace freeflex::testing {
namespace {

constexpr double kPi = 3.141592653589793;
constexpr std::array<double, 5> kRatios = {0.0, 1e-9, 0.02, 1.0, 1e3};

/// Lists the loads on the modes. The modes also have initial displacements and rates.
enum class Load { kNone, kConstant, kLinear };
constexpr double kForce = 0.37;       // [N] along x of the body
constexpr double kRampTime = 2048.0;  // [s] time at which the linear load would reach kForce

/// Returns values of omega h [rad] over sixteen decades: powers of ten, values at and near simple fractions
/// of a cycle, where the same rounding errors repeat from step to step, and random values.
std::vector<double> steps_in_radians(std::uint64_t seed, int num_random) {
  std::vector<double> W;
  for (int decade = -8; decade <= 8; ++decade) W.push_back(std::pow(10.0, decade));
  for (const double angle : {kPi / 6, kPi / 4, kPi / 3, kPi / 2, 2 * kPi / 3, kPi, 2 * kPi, 1000 * kPi}) {
    W.push_back(angle);
    W.push_back(angle * (1.0 + 1e-12));
  }
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<double> decade(-8.0, 8.0);
  for (int k = 0; k < num_random; ++k) W.push_back(std::pow(10.0, decade(engine)));
  return W;
}

std::vector<Mode> modes_for(double period, std::uint64_t seed, int num_random) {
  std::mt19937_64 engine(seed + 1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<Mode> modes;
  for (const double W : steps_in_radians(seed, num_random))
    for (const double ratio : kRatios) {
      const double omega = W / period;
      modes.push_back({omega, ratio * omega, 1e-3 * uniform(engine), 1e-3 * omega * uniform(engine)});
    }
  for (const double decay : {0.0, 1e-6, 3.0, 1e4}) modes.push_back({0.0, decay, 1e-3, 0.2 * uniform(engine)});
  return modes;
}

/// Holds the largest error of any mode at any checkpoint, in units of eps times the largest |(omega q,
/// q_dot)| of the mode up to that checkpoint.
struct Worst {
  double error = 0.0;  // [eps]
  double share = 0.0;  // largest error as a fraction of the bound (2 + 0.2 n) eps after n ticks
  std::string where;
};

/// \param row  mode-shape row of the plan in the direction of the force, so that Q = kForce row
void compare(const StepPlan& plan, const State& state, std::int64_t n, Load load, std::span<const double> row,
             const std::vector<double>& largest, Worst& worst) {
  const Real t = Real(n) * Real(plan.period), M(plan.mass);
  for (std::size_t l = 0; l < static_cast<std::size_t>(plan.num_elastic); ++l) {
    const Real w(plan.omega[l]), Q = Real(kForce) * Real(row[l]);
    const OscillatorMotion exact =
        oscillate(w, Real(plan.decay[l]), Real(plan.initial.q[l]), Real(plan.initial.q_dot[l]),
                  load == Load::kConstant ? Q / M : Real(0),
                  load == Load::kLinear ? Q / (M * Real(kRampTime)) : Real(0), t);
    const Real dq = w * (Real(state.q[l]) - exact.q), dv = Real(state.q_dot[l]) - exact.q_dot;
    const double error = sqrt(dq * dq + dv * dv).convert_to<double>() / (kEpsilon * largest[l]);
    const double share = error / (2.0 + 0.2 * static_cast<double>(n));
    if (error > worst.error)
      worst.where = fmt::format("omega h {:.6g}, decay h {:.2g}, n {}", plan.omega[l] * plan.period,
                                plan.decay[l] * plan.period, n);
    worst.error = std::max(worst.error, error);
    worst.share = std::max(worst.share, share);
  }
}

/// Steps to the last checkpoint and compares at every checkpoint.
Worst run_and_compare(const StepPlan& plan, std::span<const ForceCommand> commands, Load load,
                      std::span<const double> row, std::int64_t last) {
  HandRun run(plan);
  std::vector<double> largest(static_cast<std::size_t>(plan.num_padded));
  const auto note = [&] {
    for (std::size_t l = 0; l < largest.size(); ++l)
      largest[l] = std::max(largest[l], std::hypot(plan.omega[l] * run.state.q[l], run.state.q_dot[l]));
  };
  note();
  Worst worst;
  for (std::int64_t n = 1; n <= last; ++n) {
    run.run(1, n == 1 ? commands : std::span<const ForceCommand>{});
    note();
    if (n == 1 || n == 1000 || n == 1000000) compare(plan, run.state, n, load, row, largest, worst);
  }
  std::printf("worst error %.3f eps (%s), %.3g of (2 + 0.2 n) eps\n", worst.error, worst.where.c_str(),
              worst.share);
  return worst;
}

/// Applies the load to a point, along x of the given axes. Returns the commands for a constant load, or adds
/// a history for a linear load to the plan.
std::vector<ForceCommand> load_point(StepPlan& plan, int point, std::int32_t axes, Load load) {
  const PointForce force{point, 0, {kForce, 0.0, 0.0}};
  std::vector<ForceCommand> commands;
  if (load == Load::kConstant) {
    commands.push_back(hand_command("test", 0, axes));
    add_force(commands[0], point, force.force);
  }
  if (load == Load::kLinear) {
    PlanHistory ramp;
    ramp.kind = PlanHistory::Kind::kTable;
    ramp.times = {0.0, kRampTime};
    ramp.values = {0.0, 1.0};
    ramp.pattern = build_pattern(plan, {axes, std::span(&force, 1), {}, {}});
    plan.histories.push_back(ramp);
  }
  return commands;
}

Worst run_to(double period, std::uint64_t seed, int num_random, Load load, std::int64_t last) {
  StepPlan plan = hand_plan(period, modes_for(period, seed, num_random));
  // the load has no moment, so the body does not rotate and world axes remain body axes
  plan.points[0].r = {};
  const auto commands = load_point(plan, 0, 0, load);
  return run_and_compare(plan, commands, load, plan.rows, last);
}

/// Runs a spinning truss. A point that hangs on a single spring adds two mechanisms, and each ratio of
/// kRatios damps some of the modes. The force at a corner is in body axes, so it rotates with the truss.
Worst run_structure_to(double rate, double stiffer, Load load, std::int64_t last) {
  Scene scene = square_truss(3);
  scene.rate = rate;
  scene.points.push_back({"hung", 0.5, {2.0, 0.5, 0.5}, Eigen::Vector3d::Zero()});
  scene.links.push_back({"tether", {11, 12}, Spring{1e3}, {}});
  for (Link& link : scene.links) std::get<Spring>(link.kind).stiffness *= stiffer;
  scene.initial.angular_velocity = {0.3, -0.2, 0.4};
  scene.initial.points.push_back({3, {1e-3, 0.0, 2e-3}, {0.0, 0.1, 0.0}});
  StepPlan plan = plan_of(scene);
  for (std::size_t l = 2; l < static_cast<std::size_t>(plan.num_elastic); ++l)
    plan.decay[l] = kRatios[l % kRatios.size()] * plan.omega[l];
  set_rate(plan, rate);
  const auto commands = load_point(plan, 10, 1, load);
  const auto row = std::span<const double>(plan.rows).subspan(
      3 * static_cast<std::size_t>(plan.points[10].row) * static_cast<std::size_t>(plan.num_padded));
  return run_and_compare(plan, commands, load, row, last);
}

// If q and q_dot are each rounded once, by at most half a unit in the last place, the relative error of each
// is at most eps / 2. This limit leaves room for smaller errors.
constexpr double kRoundedOnce = 0.75;

TEST(Oscillator, FreeMotionAfterAThousandTicksIsTheClosedFormRoundedOnce) {
  EXPECT_LE(run_to(1e-3, 1, 40, Load::kNone, 1000).error, kRoundedOnce);
  EXPECT_LE(run_to(1.0 / 3000.0, 2, 40, Load::kNone, 1000).error, kRoundedOnce);
}

TEST(Oscillator, ErrorUnderAConstantLoadStaysWithinTheBoundOverAThousandTicks) {
  EXPECT_LE(run_to(1e-3, 3, 40, Load::kConstant, 1000).share, 1.0);
}

TEST(Oscillator, ErrorUnderALinearLoadStaysWithinTheBoundOverAThousandTicks) {
  EXPECT_LE(run_to(1e-3, 4, 40, Load::kLinear, 1000).share, 1.0);
}

// In the three pairs of rate and stiffness, omega h is at most 1e-3, 1 and 1e6, so that the modes are slow,
// about as fast as, and much faster than the steps.
TEST(Structure, ASpinningStructureFollowsTheClosedFormUnderForcesInBodyAxes) {
  for (const auto& [rate, stiffer] : {std::pair{1e6, 1.0}, {1e3, 1.0}, {1e3, 1e12}})
    for (const Load load : {Load::kNone, Load::kConstant, Load::kLinear})
      EXPECT_LE(run_structure_to(rate, stiffer, load, 1000).share, 1.0) << rate << ' ' << stiffer;
}

TEST(StructureOverAMillionTicks, ASpinningStructureFollowsTheClosedFormUnderForcesInBodyAxes) {
  EXPECT_LE(run_structure_to(1e3, 1.0, Load::kConstant, 1000000).share, 1.0);
  EXPECT_LE(run_structure_to(1e3, 1.0, Load::kLinear, 1000000).share, 1.0);
}

TEST(OscillatorOverAMillionTicks, FreeMotionIsTheClosedFormRoundedOnce) {
  EXPECT_LE(run_to(1e-3, 5, 0, Load::kNone, 1000000).error, kRoundedOnce);
}

TEST(OscillatorOverAMillionTicks, ErrorUnderALoadStaysWithinTheBound) {
  EXPECT_LE(run_to(1e-3, 6, 0, Load::kConstant, 1000000).share, 1.0);
  EXPECT_LE(run_to(1e-3, 7, 0, Load::kLinear, 1000000).share, 1.0);
}

}  // namespace
}  // namespace freeflex::testing
