// The columns of a campaign's table as numbers, and statistics of them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "service/campaign/campaign.hpp"
#include "tools/campaign/results.hpp"

namespace freeflex::campaign {

struct Column {
  std::string name;
  std::vector<double> values;  // one for each case; not a number where there is none
};
struct Columns {
  std::vector<std::int64_t> cases;
  std::vector<std::string> outcomes, messages;
  std::vector<bool> fails;                  // judged, but not passed
  std::vector<Column> variables, measures;  // of a list of texts, the place in it from 1
};
Columns columns_of(const Campaign& campaign, const Results& results);

/// Returns true if all values of a list are numbers.
bool is_numeric(const Choice& choice);

/// Returns the values that are numbers, ascending; they may be infinite.
std::vector<double> sorted_values(const Column& column);
/// Returns the value below which the share u of the sorted values lies; not a number if there are none.
double quantile_of(const std::vector<double>& sorted, double u);
/// Returns Spearman's rank correlation of the cases in which both columns have a number; 0 for fewer than 3.
double rank_correlation(const Column& a, const Column& b);
/// Returns the largest distance between the distribution functions of a column for failing and for other
/// cases (Kolmogorov and Smirnov), 0 to 1; 0 if one of the two has no case.
double separation(const Column& column, const std::vector<bool>& fails);

}  // namespace freeflex::campaign
