// Studies the free motion of random bodies with wheels at any rate. Compares the verdicts with the attitude
// error relative to SUNDIALS (THEORY 7.14 to 7.31).
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/error/verdict.hpp"

namespace freeflex::tools {

/// Result for one body in free motion, over 100 s, 3000 ticks or 20,000 rad, whichever is shortest, but at
/// least until it is judged.
struct TickRow {
  int number = 0;
  double rate = 0.0;           // [Hz]
  double rotation = 0.0;       // [rad] |w| h per tick at the start
  double wheel = 0.0;          // [-] momentum of the wheel divided by the momentum of the body
  double inertia_ratio = 0.0;  // [-] largest principal moment divided by the smallest
  int substeps = 0;            // substeps per tick
  std::int64_t ticks = 0;
  Verdict::Level level = Verdict::Level::kGood;  // worst verdict
  // [rad] attitude error at the end, relative to SUNDIALS with tolerance 1e-12; NaN unless the verdict is
  // `good`
  double attitude_error = NAN;
  double energy_error = NAN;  // [-] relative change of the energy of rotation
  double ns_per_tick = 0.0;   // CPU time of the step alone
  std::string error;          // reason why the reference gives no result
};

/// Studies `count` bodies in free motion. Body `number` of a seed is a needle, a flat body or a compact body,
/// with skew principal axes and ratios of principal moments up to 1e6. It moves at 1 Hz to 10 kHz and rotates
/// by 0.001 to 3 rad per tick. Two of three bodies have a wheel with 0.01 to 1000 times the momentum of the
/// body. The tick rate, the rotation per tick and the momentum of the wheel are drawn uniformly per decade.
/// Bodies with odd numbers run on the rung `coupled`.
/// \param keep_going  called with the finished fraction; returns false to end the study
std::vector<TickRow> study_ticks(std::uint64_t seed, int count,
                                 const std::function<bool(double)>& keep_going);

/// Summary of the bodies whose rotation per tick lies in one bin of half a decade.
struct TickBin {
  double from = 0.0, to = 0.0;  // [rad]
  int count = 0, num_good = 0, num_watch = 0, num_outside = 0;
  double worst_attitude = 0.0, worst_energy = 0.0;  // largest errors of bodies with the verdict `good`
  double ns_per_tick = 0.0;                         // [ns] median
};
std::vector<TickBin> bin_ticks(const std::vector<TickRow>& rows);

}  // namespace freeflex::tools
