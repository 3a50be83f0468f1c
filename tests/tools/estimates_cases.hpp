// Prints studies of the error estimate and counts their results.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>

#include "tools/verification/report/estimates.hpp"

namespace freeflex::testing {

inline tools::EstimateSummary print(const std::vector<tools::EstimateRow>& rows) {
  const tools::EstimateSummary sum = tools::summarize(rows);
  for (const auto& row : rows)
    if (!row.error.empty()) std::printf("scene %d: %s\n", row.number, row.error.c_str());
  std::printf(
      "%d scenes (%d without an answer): within a factor of 1.3 %.3f of the attitude errors (95 %% lower "
      "bound %.3f),\n%.3f of the elastic errors (%.3f); within a factor of 3 %.3f, %.3f; good %.2f, watch "
      "%.2f, outside %.2f;\n"
      "auto meets %.3f, is cheapest %.3f\n",
      sum.num_scenes, sum.num_failed, sum.close_attitude, sum.lower_attitude, sum.close_elastic,
      sum.lower_elastic, sum.near_attitude, sum.near_elastic, sum.good, sum.watch, sum.outside,
      sum.auto_meets, sum.auto_cheapest);
  const auto bins = tools::histogram(rows, &tools::ErrorSize::elastic);
  std::printf("elastic estimate over truth, fifths of a decade from 0.1 to 10:");
  for (const int bin : bins) std::printf(" %d", bin);
  std::printf("\n");
  return sum;
}

/// Counts the verdicts `good`. Such a verdict is false if the true elastic error exceeds 5 % of
/// `Verdict::scale`; the false ones are also counted. The scale is never smaller than the present
/// displacement. Also counts the scenes with a true elastic error below 1 %, and the verdicts `good` and
/// `outside` on these scenes. Rows with an error are skipped, and so are verdicts whose cause is an error of
/// place.
struct VerdictTally {
  int good = 0, false_good = 0;                      // false_good: the true error exceeds 5 % of the scale
  int small = 0, small_good = 0, small_outside = 0;  // scenes with a true elastic error below 1 %
};
inline VerdictTally tally_verdicts(const std::vector<tools::EstimateRow>& rows) {
  VerdictTally sum;
  for (const auto& row : rows) {
    // a verdict that is caused by the error of the position says nothing about the elastic error
    if (!row.error.empty() || row.verdict.cause == Verdict::Cause::kPosition) continue;
    const double share = row.truth.elastic * row.verdict.displacement_now / row.verdict.scale;
    const bool is_good = row.verdict.level == Verdict::Level::kGood,
               is_outside = row.verdict.level == Verdict::Level::kOutside,
               is_small = row.truth.elastic < 0.01;
    sum.good += is_good;
    sum.false_good += is_good && share > 0.05;
    sum.small += is_small;
    sum.small_good += is_small && is_good;
    sum.small_outside += is_small && is_outside;
  }
  std::printf(
      "%d good, %d of them off by more than 5 %%; %d off by less than 1 %%, of these %d good, %d outside\n",
      sum.good, sum.false_good, sum.small, sum.small_good, sum.small_outside);
  return sum;
}

}  // namespace freeflex::testing
