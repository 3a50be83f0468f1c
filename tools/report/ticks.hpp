// Random bodies with wheels at any rate: what the word says beside the attitude of SUNDIALS (THEORY X200 to
// X204).
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/validity/judgement.hpp"

namespace freeflex::tools {

/// One body in free motion, for 100 s, 3000 ticks or 20,000 rad, whichever is least.
struct TickRow {
  int number = 0;
  double rate = 0.0;           // [Hz]
  double turn = 0.0;           // [rad] |w| h of a tick at the start
  double wheel = 0.0;          // [-] its momentum over that of the body
  double inertia_ratio = 0.0;  // [-] of the largest principal moment to the least
  int substeps = 0;            // of a tick
  std::int64_t ticks = 0;
  Verdict::Word word = Verdict::Word::kGood;  // the worst
  double attitude_error = NAN;  // [rad] at the end, beside SUNDIALS at 1e-12; where the word is good
  double energy_error = NAN;    // [-] relative change of the energy of rotation
  double ns_per_tick = 0.0;     // CPU, of the step alone
  std::string error;            // why the reference has no answer
};

/// Body `number` of a seed: a needle, a flat body or a compact one, moments in ratios to 1e6, axes askew; 1
/// Hz to 10 kHz, 0.001 to 3 rad a tick, two of three with a wheel of 0.01 to 1000 times its momentum, each
/// drawn per decade; the odd ones on `coupled`. \param keep_going  told the share that is done; false ends
/// the study
std::vector<TickRow> study_ticks(std::uint64_t seed, int count,
                                 const std::function<bool(double)>& keep_going);

/// Bodies whose turn a tick is in one half of a decade.
struct TickBin {
  double from = 0.0, to = 0.0;  // [rad]
  int count = 0, num_good = 0, num_watch = 0, num_outside = 0;
  double worst_attitude = 0.0, worst_energy = 0.0;  // of the good ones
  double ns_per_tick = 0.0;                         // median
};
std::vector<TickBin> bin_ticks(const std::vector<TickRow>& rows);

}  // namespace freeflex::tools
