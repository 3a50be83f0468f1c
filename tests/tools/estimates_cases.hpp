// Studies of the error estimate, printed.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>

#include "tools/report/estimates.hpp"

namespace freeflex::testing {

inline tools::EstimateSummary print(const std::vector<tools::EstimateRow>& rows) {
  const tools::EstimateSummary sum = tools::summarize(rows);
  for (const auto& row : rows)
    if (!row.error.empty()) std::printf("scene %d: %s\n", row.number, row.error.c_str());
  std::printf(
      "%d scenes (%d without an answer): truth inside the estimate, position %.3f (95 %% lower bound %.3f),\n"
      "elastic %.3f (%.3f); within a factor of 3 %.3f, %.3f; good %.2f, watch %.2f, outside %.2f;\n"
      "auto meets %.3f, is cheapest %.3f\n",
      sum.num_scenes, sum.num_failed, sum.inside_position, sum.lower_position, sum.inside_elastic,
      sum.lower_elastic, sum.close_position, sum.close_elastic, sum.good, sum.watch, sum.outside,
      sum.auto_meets, sum.auto_cheapest);
  const auto bins = tools::histogram(rows, &ErrorSize::elastic);
  std::printf("elastic estimate over truth, fifths of a decade from 0.1 to 10:");
  for (const int bin : bins) std::printf(" %d", bin);
  std::printf("\n");
  return sum;
}

}  // namespace freeflex::testing
