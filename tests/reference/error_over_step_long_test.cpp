// The error and the energy of the rung `corotational` over the length of a tick, for beams whose stiffest
// mode is far above the tick.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/motion.hpp"
#include "core/step/readout.hpp"
#include "tests/reference/true_geometry.hpp"
#include "tools/verification/reference/integrate.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

// A free beam of 11 points with 1 kg each, 10 m long. Its lowest frequency is 8.785 rad/s, its highest 6260.
constexpr double kLowest = 8.785;
Scene beam() {
  Scene scene;
  for (int i = 0; i <= 10; ++i) add_point(scene, 1.0, {1.0 * i - 5.0, 0.0, 0.0});
  for (int i = 0; i < 10; ++i) add_link(scene, i, i + 1, Beam{1e7, 2200.0, 2200.0, 2200.0, {0.0, 0.0, 1.0}});
  scene.fidelity = Fidelity::kCorotational;
  return scene;
}

// Kicks the lowest three pairs of bending modes in both planes. `size` is about the share of the length by
// which the lowest mode bends, and `spin` is relative to its frequency.
Scene kicked(double size, double spin) {
  constexpr std::array<double, 6> kParts{1.0, 0.6, 0.3, 0.2, 0.1, 0.1};
  Scene scene = beam();
  const Structure structure = build(scene);
  Eigen::VectorXd V = Eigen::VectorXd::Zero(structure.shapes.rows());
  for (std::size_t k = 0; k < 6; ++k) {
    const auto pair = static_cast<Eigen::Index>(k / 2 * 2);
    // the shape of the pair that bends along y or z, of unit mass norm, with the tip above
    Eigen::VectorXd along = Eigen::VectorXd::Zero(V.size());
    const Eigen::Index axis = k % 2 == 0 ? 1 : 2;
    for (const Eigen::Index l : {pair, pair + 1})
      along += structure.shapes(axis, l) * structure.shapes.col(l);
    along *= std::sqrt(11.0) / along.norm();
    const double omega = structure.omega[pair];
    V += 10.0 * size * kParts[k] * omega * std::min(1.0, 1.5 * structure.omega[0] / omega) * along;
  }
  EXPECT_NEAR(structure.omega[0], kLowest, 1e-3);
  for (int i = 0; i <= 10; ++i) scene.initial.points.push_back({i, Vector3d::Zero(), V.segment<3>(3 * i)});
  scene.initial.angular_velocity = spin * kLowest * Vector3d(0.0, 0.2, 1.0);
  return scene;
}

double rms(const Matrix3Xd& x) { return x.norm() / std::sqrt(static_cast<double>(x.cols())); }

// Returns the largest error of the positions over the times of the reference [m], or infinity if the motion
// fails.
double error_over(Scene scene, double period, const ReferenceRun& run, std::span<const double> times) {
  scene.rate = 1.0 / period;
  const Plan plan = compile(scene);
  Motion motion(plan, kMotionAlone);
  double error = 0.0;
  for (std::size_t t = 0; t < times.size(); ++t) {
    while (static_cast<double>(motion.state().tick) * period < times[t] - 1e-9)
      if (motion.advance().status != StepStatus::kOk) return HUGE_VAL;
    Matrix3Xd off = run.states[t].p_W;
    for (int i = 0; i <= 10; ++i)
      off.col(i) -= Eigen::Map<const Vector3d>(read_point(plan, motion.state(), i).p_W.data());
    error = std::max(error, rms(off));
  }
  return error;
}

struct Row {
  double size, spin;
  // [-] bounds of the error over the peak: twice those that were measured. Infinity: the run stops, because a
  // joint has no equilibrium
  std::array<double, 6> bounds;
};

TEST(ErrorOverStep, OfAKickedBeam) {
  constexpr std::array<double, 6> kPeriods{0.0005, 0.001, 0.002, 0.005, 0.01, 0.02};
  constexpr std::array<Row, 5> kRows{{{1e-3, 0.0, {1.4e-7, 5e-7, 1.4e-7, 2e-7, 2e-7, 2e-7}},
                                      {1e-2, 0.0, {4e-5, 1e-4, 1.4e-4, 1.8e-4, 2.6e-4, 2.4e-3}},
                                      {3e-2, 0.0, {1.6e-3, 4e-3, 8e-3, 1e-2, 6e-3, HUGE_VAL}},
                                      {1e-2, 1.0, {4e-5, 5e-4, 6e-3, 8e-3, 8e-3, 8e-3}},
                                      {5e-2, 0.0, {1e-2, 2.4e-2, 5e-2, 4e-2, 6e-2, HUGE_VAL}}}};
  std::vector<double> times;
  for (int k = 1; k <= 10; ++k) times.push_back(0.1 * k);
  std::printf("peak / L    spin   ");
  for (const double period : kPeriods) std::printf("%8g ms", 1e3 * period);
  for (const Row& row : kRows) {
    const Scene scene = kicked(row.size, row.spin);
    ReferenceOptions options;
    options.tolerance = 1e-10;
    const ReferenceRun run = integrate(true_geometry_of(scene), times, options);
    ASSERT_EQ(run.error, "");
    std::printf("\n%.1e  %4.1f   ", run.scale.displacement / 10.0, row.spin);
    for (std::size_t k = 0; k < kPeriods.size(); ++k) {
      const double error = error_over(scene, kPeriods[k], run, times) / run.scale.displacement;
      std::printf("%11.0e", error);
      std::fflush(stdout);
      EXPECT_LE(error, row.bounds[k]);
    }
  }
  std::printf("\n");
}

double energy_of(const Plan& plan, const Motion& motion) {
  const Invariants all = read_invariants(plan, motion.state());
  return all.kinetic_rigid + all.kinetic_elastic + all.potential;
}

// The filter takes the vibration that a tick does not resolve out of the forces, so the energy is not exact.
// After 60 s at 10 ms.
TEST(EnergyOverTime, OfAKickedBeam) {
  std::printf("change of the energy in 60 s:");
  for (const auto& [size, bound] : {std::pair(1e-3, 4e-6), std::pair(1e-2, 1.3e-3), std::pair(2e-2, 0.034)}) {
    Scene scene = kicked(size, 0.0);
    scene.rate = 100.0;
    const Plan plan = compile(scene);
    Motion motion(plan, kMotionAlone);
    const double start = energy_of(plan, motion);
    double most = 0.0;
    for (int k = 0; k < 6000; ++k) {
      ASSERT_EQ(motion.advance().status, StepStatus::kOk);
      most = std::max(most, std::abs(energy_of(plan, motion) / start - 1.0));
    }
    std::printf("  %.1e, at most %.1e (kick %g)", energy_of(plan, motion) / start - 1.0, most, size);
    EXPECT_LT(most, bound);
  }
  std::printf("\n");
}

/// Relative changes of the energy of an undamped spinning beam.
struct EnergyChange {
  double most = 0.0;  // largest change since the start
  double rise = 0.0;  // largest rise in one tick
};

/// Moves a spinning beam, with an amplitude of 1e-4 of its length, over a number of ticks.
/// \param phase  [rad] of the lowest mode in a tick
EnergyChange energy_change(Fidelity fidelity, double phase, int num_ticks) {
  Scene scene = kicked(1e-4, 0.1);
  scene.fidelity = fidelity;
  scene.rate = kLowest / phase;
  const Plan plan = compile(scene);
  Motion motion(plan, kMotionAlone);
  EXPECT_EQ(motion.advance().status, StepStatus::kOk);
  EnergyChange change;
  const double start = energy_of(plan, motion);
  double last = start;
  for (int k = 1; k < num_ticks; ++k) {
    EXPECT_EQ(motion.advance().status, StepStatus::kOk);
    const double now = energy_of(plan, motion);
    change.rise = std::max(change.rise, (now - last) / start);
    change.most = std::max(change.most, std::abs(now / start - 1.0));
    last = now;
  }
  std::printf("energy changes by at most %.1e, and rises by at most %.1e in a tick\n", change.most,
              change.rise);
  return change;
}

// The energy also rises and falls by 8e-9 from tick to tick, with the axial vibration that a tick does not
// resolve (70 rad of the fastest mode in a tick).
TEST(EnergyOverTime, OfASpinningBeamOverAMillionTicks) {
  const EnergyChange change = energy_change(Fidelity::kCorotational, 0.1, 1000000);
  EXPECT_LT(change.most, 2e-8);
  EXPECT_LT(change.rise, 2e-8);
}

// `full` resolves that vibration: 1e-15 a tick is the rounding error of the energy.
TEST(EnergyOverTime, OfASpinningBeamWhereTheTickIsDividedUntilItIsResolved) {
  const EnergyChange change = energy_change(Fidelity::kFull, 0.1, 10000);
  EXPECT_LT(change.most, 2e-13);
  EXPECT_LT(change.rise, 2e-14);
}

}  // namespace
}  // namespace freeflex::testing
