// Random bodies with wheels, at any rate and any rotation per tick, are compared with SUNDIALS. If the motion
// is wrong, the verdict is not `good`.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "core/error/verdict.hpp"
#include "core/step/rigid/tick_rotation.hpp"
#include "tools/verification/report/ticks.hpp"

namespace freeflex::tools {
namespace {

TEST(TicksLong, NoWrongMotionOfAThousandRandomBodiesIsRatedGood) {
  const std::vector<TickRow> rows = study_ticks(2026, 1000, [](double) { return true; });
  ASSERT_EQ(rows.size(), 1000u);
  int num_good = 0, num_outside = 0;
  double worst_attitude = 0.0, worst_energy = 0.0;
  for (const TickRow& row : rows) {
    num_outside += row.level == Verdict::Level::kOutside ? 1 : 0;
    if (row.level != Verdict::Level::kGood) continue;
    ++num_good;
    EXPECT_EQ(row.error, "") << row.number;
    EXPECT_LT(row.attitude_error, kGoodAttitude)
        << "body " << row.number << ": " << row.rotation << " rad a tick";
    worst_attitude = std::max(worst_attitude, row.attitude_error);
    // the verdict does not judge rates, which are wrong before the attitude where substeps do not resolve the
    // nutation
    if (row.substeps < kMaxRotationSubsteps) worst_energy = std::max(worst_energy, row.energy_error);
  }
  std::printf(
      "1000 random bodies: %d good, %d outside; of the good ones attitude off by %.1e rad at most, "
      "energy off by %.1e at most where substeps resolve the nutation\n",
      num_good, num_outside, worst_attitude, worst_energy);
  EXPECT_GT(num_good, 900);
  EXPECT_LT(worst_energy, 1e-9);
}

}  // namespace
}  // namespace freeflex::tools
