// Counts of the outcomes of a campaign, and what they say about the probability of failure.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tools/campaign/results.hpp"

namespace freeflex::campaign {

/// An interval that contains the true value with the given confidence.
struct Interval {
  double low = 0.0, high = 1.0;
};
/// Returns the interval of Clopper and Pearson (Biometrika 26, 404-413, 1934) for a probability, of which
/// `count` of `total` independent cases were seen. Its confidence is at least the one that is asked for.
/// \param confidence  0.95
Interval probability_interval(std::int64_t count, std::int64_t total, double confidence);

/// The outcomes, in the order of messages.
inline constexpr std::array<const char*, 7> kAllOutcomes{"passed",  "failed",  "unstable", "controller",
                                                         "refused", "crashed", "hung"};

struct Summary {
  std::array<std::int64_t, kAllOutcomes.size()> counts{};
  double setup_seconds = 0.0, run_seconds = 0.0;  // of all cases, wall clock

  std::int64_t total() const;
  /// Returns the number of cases that had a motion; a refused case has none.
  std::int64_t num_judged() const { return total() - counts[4]; }
  /// Returns the number of cases that ended because of a controller: with an error, crashed or hung.
  std::int64_t num_controller_faults() const { return counts[3] + counts[5] + counts[6]; }
  /// Returns the number of judged cases that did not pass.
  std::int64_t num_failed() const { return num_judged() - counts[0]; }
};
Summary summarize(const Results& results);

/// Returns lines such as "5000 cases: 4950 passed, 50 failed" and "probability of failure 1 % (0.74 to 1.32 %
/// with a confidence of 95 %)".
std::string summary_text(const Summary& summary);

/// Splits a row of the table into its fields.
std::vector<std::string> fields_of(std::string_view row);

}  // namespace freeflex::campaign
