// Verdicts on structures with bodies are compared with an independent reference, which has the same masses on
// rigid bodies at true geometry. This file is header only.
#pragma once

#include "tests/motion/body_clones.hpp"
#include "tests/motion/verdict_truth.hpp"

namespace freeflex::testing {

struct BodyCounts {
  int all = 0, good = 0, false_good = 0, harmless = 0, false_outside = 0;
  double worst_good = 0.0;
};

inline void judge_bodies(std::uint64_t seed, BodyCounts& counts) {
  const RandomBodies random(seed);
  Scene bodies = random.scene();
  const auto all_points = true_displacements(as_point_masses(bodies), random.end());
  const auto num_points = static_cast<Eigen::Index>(bodies.points.size());
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled}) {
    bodies.fidelity = rung;
    Simulation simulation(bodies);
    Judgement judgement(simulation.plan);
    Budget no_budget;
    judgement.take(simulation.state, no_budget);
    const auto ticks = std::llround(random.end() * bodies.rate);
    while (simulation.state.tick < ticks) {
      simulation.run(1);
      judgement.take(simulation.state, no_budget);
    }
    const Verdict& verdict = judgement.now();
    double error = HUGE_VAL;
    if (all_points) {
      const Eigen::Matrix3Xd truth = all_points->leftCols(num_points);
      error = rms_over_mass(bodies, simulation.displacements_B() - truth) /
              std::max(verdict.scale, rms_over_mass(bodies, truth));
    }
    std::printf("%llu %-11s error %.2e of the scale, estimate %.2e, unquantified %.2e: %s\n",
                static_cast<unsigned long long>(seed), name_of(rung), error, verdict.error / verdict.scale,
                verdict.unquantified / verdict.scale, name_of(verdict.level));
    ++counts.all;
    const bool is_good = verdict.level == Verdict::Level::kGood;
    counts.good += is_good;
    counts.false_good += is_good && error > 0.05;
    counts.harmless += error < 0.01;
    counts.false_outside += verdict.level == Verdict::Level::kOutside && error < 0.01;
    if (is_good) counts.worst_good = std::max(counts.worst_good, error);
  }
}

inline void expect_honest(std::uint64_t first, std::uint64_t last) {
  BodyCounts counts;
  for (std::uint64_t seed = first; seed <= last; ++seed) judge_bodies(seed, counts);
  std::printf("%d verdicts, %d good, largest error of them %.3f, %d of %d harmless ones outside\n",
              counts.all, counts.good, counts.worst_good, counts.false_outside, counts.harmless);
  EXPECT_EQ(counts.false_good, 0);
  EXPECT_EQ(counts.false_outside, 0);
  EXPECT_GT(counts.good, 0);
}

}  // namespace freeflex::testing
