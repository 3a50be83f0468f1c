// Prints percentiles of the daemon's lateness, and those of cyclictest for comparison.
#pragma once

#include <array>
#include <string>

namespace freeflex::testing {

/// Prints the percentiles 50, 99, 99.9 and the maximum [us] as a line of a table.
void print_row(const std::string& name, const std::array<double, 4>& us);
template <class Numbers>
std::array<double, 4> four(const Numbers& us) {
  return {us[0], us[1], us[2], us[3]};
}

/// Prints the percentiles of one cyclictest thread at the daemon's priority and rate over `seconds`.
void print_cyclictest(const std::string& name, int seconds);

}  // namespace freeflex::testing
