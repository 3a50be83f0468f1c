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
  const Scene bodies = random.scene();
  const Scene whole = as_point_masses(bodies);
  const auto truth = true_displacements(whole, random.end());
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled}) {
    std::printf("%llu\n", static_cast<unsigned long long>(seed));
    const JudgedError judged = compare_verdict(bodies, rung, random.end(), truth, {}, &whole);
    const double error = judged.error;
    const Verdict::Level level = judged.level;
    ++counts.all;
    const bool is_good = level == Verdict::Level::kGood;
    counts.good += is_good;
    counts.false_good += is_good && error > 0.05;
    counts.harmless += error < 0.01;
    counts.false_outside += level == Verdict::Level::kOutside && error < 0.01;
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
