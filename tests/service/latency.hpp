// Percentiles of lateness beside those that the machine gives anybody: cyclictest's.
#pragma once

#include <array>
#include <string>

namespace freeflex::testing {

/// Percentiles 50, 99, 99.9 and max [us], a line of a table.
void print_row(const std::string& name, const std::array<double, 4>& us);
template <class Numbers>
std::array<double, 4> four(const Numbers& us) {
  return {us[0], us[1], us[2], us[3]};
}

/// Those of one cyclictest thread at the daemon's priority and rate, over so many seconds.
void print_cyclictest(const std::string& name, int seconds);

}  // namespace freeflex::testing
