// Studies random bodies with wheels at any rate. Compares verdicts with the attitude error relative to
// SUNDIALS (THEORY 7.14 to 7.31).
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/validity/judgement.hpp"

namespace freeflex::tools {

/// Result for one body in free motion, over 100 s, 3000 ticks or 20,000 rad, whichever is shortest.
struct TickRow {
  int number = 0;
  double rate = 0.0;           // [Hz]
  double rotation = 0.0;       // [rad] |w| h of a tick at the start
  double wheel = 0.0;          // [-] momentum of the wheel over that of the body
  double inertia_ratio = 0.0;  // [-] largest principal moment over the smallest
  int substeps = 0;            // substeps per tick
  std::int64_t ticks = 0;
  Verdict::Level level = Verdict::Level::kGood;  // worst verdict
  // [rad] attitude error at the end, relative to SUNDIALS at 1e-12, or NaN unless the verdict is `good`
  double attitude_error = NAN;
  double energy_error = NAN;  // [-] relative change of the energy of rotation
  double ns_per_tick = 0.0;   // CPU time of the step alone
  std::string error;          // reason why the reference gives no result
};

/// Studies `count` bodies. Body `number` of a seed is a needle, a flat body or a compact body, with skew axes
/// and moments in ratios up to 1e6, at 1 Hz to 10 kHz and 0.001 to 3 rad per tick. Two of three bodies have a
/// wheel with 0.01 to 1000 times the momentum of the body. All quantities are drawn uniformly per decade.
/// Bodies with odd numbers run on the rung `coupled`.
/// \param keep_going  called with the finished fraction; returns false to end the study
std::vector<TickRow> study_ticks(std::uint64_t seed, int count,
                                 const std::function<bool(double)>& keep_going);

/// Summary of the bodies whose rotation per tick lies in one half of a decade.
struct TickBin {
  double from = 0.0, to = 0.0;  // [rad]
  int count = 0, num_good = 0, num_watch = 0, num_outside = 0;
  double worst_attitude = 0.0, worst_energy = 0.0;  // largest errors of bodies with the verdict `good`
  double ns_per_tick = 0.0;                         // median
};
std::vector<TickBin> bin_ticks(const std::vector<TickRow>& rows);

}  // namespace freeflex::tools
